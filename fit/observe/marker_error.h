#pragma once

#include <Eigen/Core>
#include <vector>

namespace clothfit {

/// These functions measure how far predicted tracks lie from observed ones. Tracks are a matrix per
/// marker, coordinates x frames (metres in space or pixels of a camera), NaN where there is
/// nothing. A place counts where it is both observed and predicted. Where no place counts, an error
/// is NaN.

/// Returns the root mean square of the distance, over all places.
double rms_distance(const std::vector<Eigen::MatrixXd>& observed,
                    const std::vector<Eigen::MatrixXd>& predicted);

/// Shifts predictions, marker by marker, by a constant: the mean of observed - predicted. The mean
/// is over the frames before `held_out_from`. The error that remains is motion. The removed one is
/// a wrong place of the marker on the cloth, or a wrong shape of the cloth at rest. A marker that
/// does not count in these frames is not shifted.
std::vector<Eigen::MatrixXd> centred(const std::vector<Eigen::MatrixXd>& observed,
                                     std::vector<Eigen::MatrixXd> predicted, int held_out_from);

/// Returns rms_distance() with markers that count differently,
///
///   sqrt( sum_m w_m mean_f |x_m(f) - y_m(f)|^2  /  sum_m w_m ),
///
/// with the mean of marker m over the frames that it counts in, and sums over markers that count in
/// any. Weights are >= 0, one per marker.
double weighted_rms_distance(const std::vector<Eigen::MatrixXd>& observed,
                             const std::vector<Eigen::MatrixXd>& predicted,
                             const std::vector<double>& weights);

}  // namespace clothfit
