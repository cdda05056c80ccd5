#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "fit/observe/observations.h"

namespace clothfit {

/// Constants, one vector per marker (m, world), by which markers are seen beside the model's
/// places. A tracker may round the cloth's corners, or a marker lie elsewhere than its (s, t) say.
/// The constants say nothing of the cloth and are not wanted. They are therefore removed from the
/// cost in closed form instead of being fitted: Gaussian with mean 0 and standard deviation tau per
/// coordinate, and least squares in them while everything else stands still.
///
/// For one marker and coordinate, with r_k the residuals (prediction - observation) / sigma_k of
/// its observations, w_k = 1 / sigma_k and W = w'w:
///
///   min over o of  |r + w o|^2 + o^2 / tau^2  =  |r|^2 - (w'r)^2 / (W + 1 / tau^2)  =  |P r|^2,
///   at o = -w'r / (W + 1 / tau^2),   P = 1 - c w w' / W,   c = 1 - 1 / sqrt(1 + tau^2 W).
///
/// P does not depend on the parameters, so derivatives of P r are P times those of r. Under Huber's
/// loss the offsets are still those of least squares. A gross outlier among n observations moves
/// them by a share 1 / n of itself.

/// The residuals of one marker in space.
struct MarkerResiduals {
  struct Row {
    int first = 0;       ///< row of the residual's x among all residuals; y and z follow
    double sigma_m = 0;  ///< > 0
  };
  int marker = 0;
  std::vector<Row> rows;
};

/// Removes the offsets: `columns` (residuals, or their derivatives column by column) becomes P
/// times itself. `tau_m` > 0.
void profile_out_offsets(std::span<const MarkerResiduals> markers, double tau_m,
                         Eigen::Ref<Eigen::MatrixXd> columns);

/// Estimates the offsets from the observations in the frames before `frames`, to be added to
/// predictions. They are 3 x markers, m, 0 for a marker without observations. `positions` are the
/// predicted ones, 3 x markers a frame. `set` is one in space.
Eigen::Matrix3Xd estimate_offsets(const ObservationSet& set,
                                  const std::vector<Eigen::Matrix3Xd>& positions, int frames,
                                  double tau_m);

}  // namespace clothfit
