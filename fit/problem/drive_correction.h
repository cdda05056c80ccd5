#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <vector>

#include "data/markers.h"
#include "fit/problem/drive.h"
#include "fit/problem/parameter_space.h"

namespace clothfit {

/// What the smoothed tracks of held points are off by, as unknowns of a fit: to each tracked
/// point's motion a path c(t) is added, in the world's axes, a natural cubic spline through its
/// values at K knots evenly spread over the fitted frames. The values are parameters, 3 K a point,
/// with the prior that smoothing itself leaves (path_covariance()).
///
/// Held-out frames show nothing by which to correct the drive. Behind the last knot c goes to zero
/// within the distance of two knots, as the cubic spline with knots at its thirds that begins with
/// the value and slope that c has there (its second derivative is zero) and ends in rest: c is
/// smooth to its second derivative everywhere, and a natural cubic spline as a whole.
struct DriveCorrection {
  /// The knots and the three behind them, s, with the values and second derivatives of the natural
  /// spline there as they follow from the values at the knots.
  struct Basis {
    std::vector<double> time_s;         ///< K + 3
    Eigen::MatrixXd value;              ///< (K + 3) x K
    Eigen::MatrixXd second_derivative;  ///< (K + 3) x K, 1/s^2
    int knots() const { return static_cast<int>(value.cols()); }
  };
  struct Point {
    int held = 0;                 ///< index of the held point
    std::vector<Binding> values;  ///< m: x, y, z at the first knot, at the second, ...
  };
  std::shared_ptr<const Basis> basis;
  std::vector<Point> points;  ///< none: nothing is corrected
  double prior_rms_m = 0;     ///< of a coordinate at a knot, as the priors have it

  int knots() const { return basis ? basis->knots() : 0; }
};

/// The covariance of a coordinate of the smoothed path at `time_s`, from the noise of its samples
/// (rising times; m^2; square, symmetric, positive definite). A smoothing spline is the mean of
/// what is known of a path, to start with the integral of white noise twice over, after its samples
/// [wahba1983]: with H from samples to path, W^-1 their variances up to a common factor and s^2
/// that factor, samples' values have the covariance s^2 H W^-1.
///
/// Its columns are paths through a single sample of 1, smoothed as the track was: O(n) for each
/// time. A time between samples is made a sample for that, whose own weight is then taken out
/// again: with h what the path makes of it, of variance v, the column without is v h / (1 - h
/// there).
///
/// A micrometre of independent noise is added, so that the matrix can be inverted however many
/// times there are, and for tracks without any noise. Throws InputError at `where` for a track so
/// short that it says nothing of its noise.
Eigen::MatrixXd path_covariance(const TrackedPoint& point, const std::vector<double>& time_s,
                                const std::string& where);

/// Adds the parameters, named after the points' markers and starting from zero, and their priors to
/// a fit. `knots` >= 4; `first_s` < `last_s`.
DriveCorrection make_drive_correction(const std::vector<TrackedPoint>& tracked, double first_s,
                                      double last_s, int knots, const MarkerSet& markers,
                                      ParameterSpace& space, std::vector<GaussianPrior>& priors);

/// Of each of `held` points, what is added to its motion: ParameterSet::held_shift.
std::vector<std::function<Eigen::Vector3d(double time_s)>> drive_shifts(
    const DriveCorrection& correction, const Eigen::VectorXd& values, size_t held);

/// How c changes when its value at a knot changes by `change`: Direction::held_motion.
std::function<Eigen::Vector3d(double time_s)> drive_shift_by_value(
    const DriveCorrection& correction, int knot, const Eigen::Vector3d& change);

/// The times by which a motion with knots at the frames is known when it is corrected: these and
/// the correction's knots; the frames alone where nothing is corrected.
std::vector<double> corrected_times(const DriveCorrection& correction,
                                    const std::vector<double>& frame_time_s);

/// Root mean square of a coordinate of the corrections over times and points.
double rms_correction_m(const DriveCorrection& correction, const Eigen::VectorXd& values,
                        const std::vector<double>& time_s);

}  // namespace clothfit
