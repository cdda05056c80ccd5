#pragma once

#include "fit/diagnosis/fitted_model.h"

namespace clothfit {

/// How a recording's residuals (whitened) would change if the model were cut finer.
struct DiscretisationError {
  Eigen::VectorXd expected;    ///< empty where nothing is
  Eigen::MatrixXd directions;  ///< residuals x directions, by a standard normal amount each
};

/// Of each recording. The time step, carried on to step zero: the scheme is of first order, so that
/// much is expected, give or take half. The mesh, against one of twice the cells a side, or of half
/// as many where that leaves enough, fitted to the same observations (with the same parameters the
/// other mesh is often another cloth); cloth is no limit of meshes, so nothing of it is expected.
/// Springs whose natural lengths are fitted are those of one mesh, which then has no such error.
std::vector<DiscretisationError> discretisation_errors(const DiagnosisSetup& setup,
                                                       const FittedModel& model);

/// The setup with the mesh that directions are taken from.
DiagnosisSetup with_other_mesh(const DiagnosisSetup& setup);

/// The shortest share of the frames over which a model is fitted on another mesh.
inline constexpr double kFirstOnMesh = 0.28;

/// The model fitted on another mesh, over growing horizons. It begins with the derivatives of the
/// model's own mesh, where there are any, which serve for most of the way; where recordings begin
/// in motion all the way, and it ends near the optimum. `own_only`: what is shared by recordings
/// stays.
FittedModel fit_on_mesh(const DiagnosisSetup& other, const FittedModel& model,
                        const ProgressCallback& progress = {}, bool own_only = false);

/// One of these horizons: over a share of the model's frames, from where the fit over the shorter
/// one stands; from where the model stands if that has no parts.
FittedModel lead_to_mesh(const DiagnosisSetup& other, const FittedModel& model, double share,
                         const FittedModel& shorter, const ProgressCallback& progress,
                         bool own_only = false);

/// Refines a model together with the amounts by which its discretisation errs, in the directions of
/// where it stands first. A direction that is asked for by several times what it may be is no error
/// of that discretisation: something else is missing, by which the two meshes were led to different
/// optima. It is left out, and what was expected along it. A model that leaves more than thirty
/// times what noise makes, once refined, has none: they cost most where they say least.
void refine_with_discretisation(FittedModel& model, const DiagnosisSetup& setup,
                                const ProgressCallback& progress);

}  // namespace clothfit
