#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "fit/diagnosis/fitted_model.h"

namespace clothfit {

/// The force per mass that data ask for beyond a model's. It is the acceleration of the residual of
/// 3D tracks, observed less predicted. Each marker's residual is smoothed by a parabola, and by a
/// spline (fit/observe/smoothing_spline.h) of what the parabola leaves.
///
/// Cloth answers a missing force with others, above all those of its springs. What is seen here is
/// the missing force less that answer. It gives a picture, and regressions that say what it goes
/// with. Amplitudes are the proposed law's (fit/diagnosis/proposed_law.h), which knows the answer.
struct ResidualForce {
  struct OfMarker {
    int marker = 0;
    Eigen::Vector3d mean_m_per_s2;  ///< over its frames, world
    Eigen::Vector3d rms_m_per_s2;   ///< of each coordinate
  };
  /// The least squares of the residual acceleration r on one thing x. For a vector, r = slope x.
  /// For a number, r = constant + slope x with a vector slope.
  struct Regression {
    std::string on;
    std::string unit;  ///< of the slope
    /// Correlation with a vector, from -1 to 1. For a number it is the multiple one, from 0 to 1.
    double correlation = 0;
    double slope = 0;  ///< for a number, the length of the vector
    double sigma = 0;  ///< with residuals that may depend on each other over a marker's frames
  };
  std::vector<OfMarker> markers;
  std::vector<double> rms_by_frame_m_per_s2;  ///< length; NaN where nothing is known
  std::vector<Regression> regressions;
  std::string why_none;  ///< empty: there is one
};

/// Computes the residual force of a model's fitted frames, in its first recording. The first two
/// and the last two frames of each marker are left out, for a natural spline is straight there.
ResidualForce residual_force(const FittedModel& model);

}  // namespace clothfit
