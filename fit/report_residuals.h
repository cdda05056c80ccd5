#pragma once

#include "fit/problem.h"

namespace clothfit {

/// What the model leaves of the observations, beside what the trivial predictors leave: fills
/// `report.residuals` and `report.result.errors`. `mesh_positions` is the free run over all frames;
/// `marker_offset_m`, 3 x markers where there are any, is added to every frame's markers.
void fill_residuals(const FitProblem& problem, const std::vector<Eigen::Matrix3Xd>& mesh_positions,
                    const Eigen::Matrix3Xd& marker_offset_m, FitReport& report);

}  // namespace clothfit
