#pragma once

#include <Eigen/Core>
#include <functional>

#include "fit/fit.h"
#include "fit/problem/problem.h"
#include "fit/problem/simulation.h"
#include "model/fabric/fabric.h"

namespace clothfit {

/// Returns where the point of a cloth at s, t (m) is at a time (s): x (m, world). Before 0 it
/// stands.
using SyntheticMotion =
    std::function<Eigen::Vector3d(double time_s, const Eigen::Vector2d& place_m)>;

/// A small cloth whose every number is known: the truth that fits are to find again.
struct SyntheticCloth {
  Fabric fabric{.tension_warp_n_per_m = 40,
                .tension_weft_n_per_m = 50,
                .shear_n_per_m = 18,
                .flexion_warp_n_per_m = 9,
                .flexion_weft_n_per_m = 7,
                .damping_warp_s = 2.5e-3,
                .damping_weft_s = 2e-3};
  double drag_rate_per_s = 0;      ///< viscous_damping of the air
  double critical_elongation = 0;  ///< for every spring, mode `positions`; 0: no strain limit
  int mesh = 9;                    ///< columns and rows
  int markers = 7;                 ///< columns and rows, evenly spread, corners included
  double marker_margin_m = 0;      ///< or so far from the edges
  int frames = 36;
  int held_out_from = 26;
  double noise_m = 5e-4;
  double noise_px = 0.3;
  double clock_offset_s = 0;  ///< >= 0: frames show the cloth so much later than their time says
  double scale = 1;           ///< scale of the measurement, about the sheet's middle
  unsigned seed = 1;
  /// Returns where a marker of a stated place appears in a frame of a stated time. None: where it
  /// is then.
  std::function<Eigen::Vector3d(const SyntheticMotion& motion, double time_s,
                                const Eigen::Vector2d& place_m)>
      seen;
  /// Returns where a pixel appears to be. None: where it is.
  std::function<Eigen::Vector2d(const Eigen::Vector2d& pixel)> pixel;
};

/// Simulates a cloth of 0.4 m and 30 g that hangs by its upper corners. It is let go flat, turned
/// 25 degrees out of the vertical. It is filmed at 60 Hz and simulated at a time step of its own,
/// with noisy 3D tracks and the noisy pixels of one camera. Tracks state their sigma.
FitInput synthetic_input(const SyntheticCloth& cloth);

/// Returns the start of a fit, except the fabric, which is given.
Eigen::VectorXd start_with(const FitProblem& problem, const Fabric& fabric);

/// Returns the camera of the input: 1 m in front of the cloth, with distortion.
CameraParameters synthetic_camera();

}  // namespace clothfit
