#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "fit/diagnosis/fitted_model.h"

namespace clothfit {

/// Derivatives of whitened residuals: residuals x amplitudes of each recording.
using Columns = std::vector<Eigen::MatrixXd>;

/// Differentiates a model's residuals by the amplitudes of each hypothesis, at neutral and at its
/// shape. Derivatives are per unit of the amplitude. Amplitudes of the measurement are each
/// recording's own: they come one after the other, zero in the others' residuals. A hypothesis has
/// no columns where its effect cannot act in this model, or where they could not be computed. It
/// has none either where a predictor has no room for it beside the model's own effects of the
/// measurement.
std::vector<Columns> hypothesis_derivatives(const FittedModel& model,
                                            std::span<const Hypothesis> hypotheses);

/// Returns the share of a vector's square that columns explain. It is their squared multiple
/// correlation, under whatever projection both have gone through. It is 0 for no columns.
double squared_multiple_correlation(const Eigen::VectorXd& of, const Eigen::MatrixXd& columns);

}  // namespace clothfit
