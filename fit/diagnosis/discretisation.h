#pragma once

#include "fit/diagnosis/fitted_model.h"

namespace clothfit {

/// The change of a recording's whitened residuals if the model were cut finer.
struct DiscretisationError {
  Eigen::VectorXd expected;    ///< empty where none is expected
  Eigen::MatrixXd directions;  ///< residuals x directions, each of a standard normal amplitude
};

/// Estimates how each recording's model errs through its time step and its mesh. The step's error
/// is carried on to step zero. The scheme is of first order, so that much is expected, give or take
/// half. The mesh is held against one of twice the cells a side, or of half as many where that
/// leaves enough. Both are fitted to the same observations, for with the same parameters the other
/// mesh is often another cloth. Cloth is no limit of meshes, so nothing is expected of the mesh's
/// error. Springs whose natural lengths are fitted are those of one mesh, which then has no such
/// error.
std::vector<DiscretisationError> discretisation_errors(const DiagnosisSetup& setup,
                                                       const FittedModel& model);

/// Returns the setup with the mesh that directions are taken from.
DiagnosisSetup with_other_mesh(const DiagnosisSetup& setup);

/// The shortest share of the frames over which a model is fitted on another mesh.
inline constexpr double kFirstOnMesh = 0.28;

/// Fits the model on another mesh, over growing horizons. Where there are derivatives of the
/// model's own mesh, the fit begins with them, and they serve for most of the way. Where recordings
/// begin in motion they serve all the way, and the fit ends near the optimum. With `own_only`, what
/// recordings share stays.
FittedModel fit_on_mesh(const DiagnosisSetup& other, const FittedModel& model,
                        const ProgressCallback& progress = {}, bool own_only = false);

/// Fits over one of these horizons, a share of the model's frames. It begins where the fit over the
/// shorter one stands, or where the model stands if `shorter` has no parts.
FittedModel lead_to_mesh(const DiagnosisSetup& other, const FittedModel& model, double share,
                         const FittedModel& shorter, const ProgressCallback& progress,
                         bool own_only = false);

/// Refines a model together with the amplitudes of its discretisation's errors. Their directions
/// are those where the model stands first. A direction that is asked for by several times what it
/// may be is no error of that discretisation. Something else is missing then, which led the two
/// meshes to different optima. The direction is left out, and so is what was expected along it. A
/// model that misfits grossly once it is refined has no directions: they cost most where they say
/// least.
void refine_with_discretisation(FittedModel& model, const DiagnosisSetup& setup,
                                const ProgressCallback& progress);

}  // namespace clothfit
