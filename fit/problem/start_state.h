#pragma once

#include <Eigen/Core>
#include <vector>

#include "calib/camera/rigid3.h"
#include "fit/observe/observations.h"
#include "fit/problem/parameter_space.h"
#include "model/topology/mesh.h"

namespace clothfit {

/// The state of a cloth that was already moving when its recording began. It is a first guess with
/// corrections of positions and velocities. These are smooth over the cloth, and each is a
/// parameter of the fit:
///
///   P(v) = guess + sum_k B(v, k) p_k,   V(v) = guess + sum_k B(v, k) w_k
///
/// B are the cardinal functions of a natural bicubic spline (model/topology/surface.h) with few
/// nodes: the correction is p_k at node k. Shapes: 3 x vertices, world.
struct StartState {
  Eigen::Matrix3Xd position_m, velocity_m_per_s;  ///< the guess
  Eigen::MatrixXd basis;                          ///< vertices x nodes; 0 nodes: nothing to correct
  /// Numbers of node k and axis c at 3 k + c.
  std::vector<Binding> position, velocity;

  int nodes() const { return static_cast<int>(basis.cols()); }
};

struct StartStateOptions {
  /// Nodes a side where the guessed shape is smooth, and where it is not.
  static constexpr int kFewNodes = 4, kManyNodes = 8;
  int nodes = 0;                      ///< a side of the cloth, >= 2; 0: few or many
  double position_sigma_m = 0.03;     ///< for the correction at a node where the guess is good
  double velocity_sigma_m_per_s = 1;  ///< the same
};

/// Guesses the state from the tracks and adds the corrections to `space`, with priors as wide as
/// the guess's error. In space the guess is the smoothed markers at the first frame with their
/// velocities. From pixels it is the shapes of the first frames (fit/observe/shape_from_pixels.h).
/// Where neither works out it is the flat sheet, at rest, with priors as wide as a cloth can be
/// away from that.
StartState make_start_state(const std::vector<ObservationSet>& sets,
                            const Eigen::Matrix2Xd& marker_m,
                            const std::vector<double>& frame_time_s, int first_held_out,
                            const Mesh& mesh, const Rigid3& world_from_sheet,
                            const StartStateOptions& options, ParameterSpace& space,
                            std::vector<GaussianPrior>& priors);

}  // namespace clothfit
