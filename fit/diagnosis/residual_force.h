#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "fit/diagnosis/fitted_model.h"

namespace clothfit {

/// The force per mass that data ask for beyond a model's: the acceleration of what the model leaves
/// of 3D tracks, observed less predicted, each marker's smoothed by a parabola
/// and a spline (fit/observe/smoothing_spline.h) of what that leaves.
///
/// Cloth answers a missing force with others, those of its springs above all, so that what is seen
/// here is the missing force less that answer: a picture, and regressions that say what it goes
/// with. Amounts are the proposed law's (fit/diagnosis/proposed_law.h), which knows the answer.
struct ResidualForce {
  struct OfMarker {
    int marker = 0;
    Eigen::Vector3d mean_m_per_s2;  ///< over its frames, world
    Eigen::Vector3d rms_m_per_s2;   ///< of each coordinate
  };
  /// The least squares of the residual acceleration r on one thing: r = slope x for a vector x, r =
  /// constant + slope x with a vector slope for a number x.
  struct Regression {
    std::string on;
    std::string unit;  ///< of the slope
    /// Of vectors from -1 to 1, of a number the multiple one, from 0 to 1.
    double correlation = 0;
    double slope = 0;  ///< of a number the length of the vector
    double sigma = 0;  ///< with residuals that may depend on each other over a marker's frames
  };
  std::vector<OfMarker> markers;
  std::vector<double> rms_by_frame_m_per_s2;  ///< length; NaN where nothing is known
  std::vector<Regression> regressions;
  std::string why_none;  ///< empty: there is one
};

/// Of a model's fitted frames, of its first recording. The first and the last two of each marker
/// are left out: a natural spline is straight there.
ResidualForce residual_force(const FittedModel& model);

}  // namespace clothfit
