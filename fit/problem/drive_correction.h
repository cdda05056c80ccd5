#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <vector>

#include "data/markers.h"
#include "fit/problem/drive.h"
#include "fit/problem/parameter_space.h"

namespace clothfit {

/// The errors of the smoothed tracks of held points, as unknowns of a fit. To each tracked point's
/// motion a path c(t) is added, in the world's axes. It is a natural cubic spline through its
/// values at K knots evenly spread over the fitted frames. The values are parameters, 3 K a point,
/// whose prior is the uncertainty after smoothing (path_covariance()).
///
/// Held-out frames show nothing by which to correct the drive. Behind the last knot c goes to zero
/// within the distance of two knots. There it is a cubic spline with knots at the thirds of that
/// distance. It begins with c's value and slope (its second derivative is zero) and ends at rest.
/// So c is smooth to its second derivative everywhere, and a natural cubic spline as a whole.
struct DriveCorrection {
  /// The knots and the three behind them, s, with the natural spline's values and second
  /// derivatives there. Both follow from the values at the knots.
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
  std::vector<Point> points;  ///< none: no correction
  double prior_rms_m = 0;     ///< prior of a coordinate at a knot

  int knots() const { return basis ? basis->knots() : 0; }
};

/// Returns the covariance of a coordinate of the smoothed path at `time_s`, from the noise of its
/// samples. Times rise; the matrix is square, symmetric, positive definite, in m^2. A smoothing
/// spline is the posterior mean of a path after its samples, whose prior is the integral of white
/// noise twice over [wahba1983]. With H from samples to path, W^-1 their variances up to a common
/// factor and s^2 that factor, the samples' values have the covariance s^2 H W^-1.
///
/// Its columns are paths through a single sample of 1, smoothed as the track was: O(n) for each
/// time. A time between samples is made a sample, and the weight of that is then taken out again.
/// With h the path through it, of variance v, the column without it is v h / (1 - h there).
///
/// A micrometre of independent noise is added. With it the matrix can be inverted for any number of
/// times, and for tracks without noise. Throws InputError at `where` for a track too short to tell
/// its noise.
Eigen::MatrixXd path_covariance(const TrackedPoint& point, const std::vector<double>& time_s,
                                const std::string& where);

/// Adds the parameters and their priors to a fit. The parameters are named after the points'
/// markers and start from zero. `knots` >= 4; `first_s` < `last_s`.
DriveCorrection make_drive_correction(const std::vector<TrackedPoint>& tracked, double first_s,
                                      double last_s, int knots, const MarkerSet& markers,
                                      ParameterSpace& space, std::vector<GaussianPrior>& priors);

/// Returns the shift added to the motion of each of `held` points: ParameterSet::held_shift.
std::vector<std::function<Eigen::Vector3d(double time_s)>> drive_shifts(
    const DriveCorrection& correction, const Eigen::VectorXd& values, size_t held);

/// Returns the change of c when its value at a knot changes by `change`: Direction::held_motion.
std::function<Eigen::Vector3d(double time_s)> drive_shift_by_value(
    const DriveCorrection& correction, int knot, const Eigen::Vector3d& change);

/// Returns the times that determine a corrected motion with knots at the frames: these and the
/// correction's knots. Without a correction the frames suffice.
std::vector<double> corrected_times(const DriveCorrection& correction,
                                    const std::vector<double>& frame_time_s);

/// Returns the root mean square of a coordinate of the corrections over times and points.
double rms_correction_m(const DriveCorrection& correction, const Eigen::VectorXd& values,
                        const std::vector<double>& time_s);

}  // namespace clothfit
