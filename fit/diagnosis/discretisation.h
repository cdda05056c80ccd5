#pragma once

#include "fit/diagnosis/model_fit.h"

namespace clothfit {

/// How the residuals change when the model is cut finer or coarser: directions in which it may err
/// by about as much, of unit variance each, residuals x directions (whitened). One for the time
/// step, carried on to step zero (the scheme is of first order), and one for the mesh, against one
/// of twice the cells a side, or of half as many where that leaves enough, each with the parameters
/// that suit it best (with the same ones the other mesh is often another cloth). Springs whose
/// natural lengths are fitted are those of one mesh, which then has none.
Eigen::MatrixXd discretisation_directions(const DiagnosisSetup& setup, const ModelFit& model);

}  // namespace clothfit
