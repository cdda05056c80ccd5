#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "data/camera_parameters.h"
#include "data/recording.h"
#include "model/fabric/fabric.h"

namespace clothfit {

/// Series of draws under a scene's seed: a new draw of one thing does not change the others.
enum SceneSeries : int { kRelease, kNoise3d, kLosses, kHand, kNoise2d, kPictures };

/// The integrator of the truth's motion.
enum class TruthIntegrator {
  euler,       ///< the scheme of fits
  runge_kutta  ///< another one, of fourth order (apps/study/scene/runge_kutta_run.h)
};
std::string to_string(TruthIntegrator integrator);

/// An effect that acts in the truth and that its recording does not declare. It is one of motion or
/// of the measurement.
struct HiddenEffect {
  std::string name;
  std::vector<double> values;  ///< all its parameters, in the description's order and units
};

/// Options of synthetic recordings. The cloth hangs from its two upper corners, is let go flat, and
/// swings. Its turn before that is drawn for each recording.
struct SyntheticScene {
  double size_m = 0.4;    ///< side of the square cloth, > 0
  double mass_kg = 0.03;  ///< > 0
  Fabric fabric{.tension_warp_n_per_m = 40,
                .tension_weft_n_per_m = 50,
                .shear_n_per_m = 18,
                .flexion_warp_n_per_m = 9,
                .flexion_weft_n_per_m = 7,
                .damping_warp_s = 2.5e-3,
                .damping_weft_s = 2e-3};
  double drag_per_s = 0;  ///< viscous damping of the air; not declared in the recording, >= 0
  std::vector<HiddenEffect> hidden;
  TruthIntegrator integrator = TruthIntegrator::euler;
  int truth_mesh = 17;        ///< vertices a side of the simulation that is the truth, >= 3
  double truth_steps = 1;     ///< as many times more time steps than stability asks for, >= 1
  int markers = 17;           ///< a side, evenly spread over the cloth, >= 2
  int frames = 61;            ///< >= 10
  int held_out_from = 0;      ///< frame from which nothing is fitted; 0: all is
  double frame_rate_hz = 60;  ///< > 0
  double before_s = 0;        ///< the cloth has swung so long when the recording begins, >= 0
  int cameras = 1;            ///< 1 to 4, 1 m away around the cloth's front
  double noise_m = 1e-3;      ///< for 3D tracks, per coordinate, > 0
  double noise_px = 0.3;      ///< > 0
  bool noisy = true;          ///< false: observations state that noise and have none
  double missing = 0;         ///< share of observations dropped at random, 0 to 0.9
  bool hand = false;          ///< a hand hides a quarter of the cloth for a third of the time
  double outliers = 0;        ///< share of observations off by up to 0.1 m or 60 px, 0 to 0.5
  std::function<bool()> is_cancelled;  ///< as FitOptions::is_cancelled

  void validate() const;  ///< throws InputError, naming options of `clothfit recover`
};

/// Returns what is known of the scene before anybody looks: cloth, held points, start; no markers
/// and no cameras.
Recording scene_recording(const SyntheticScene& scene);

/// Returns the fit's parameters, by name.
std::map<std::string, double> scene_truth(const SyntheticScene& scene);

/// Returns camera `number` (from 0) of a row before the cloth. All look at its middle, the first
/// one straight at it. World x is to the right, z up; the cloth hangs around (size / 2, 0, -size /
/// 2) and fills half of the picture.
CameraParameters scene_camera(const SyntheticScene& scene, int number, int width_px, int height_px);

/// Returns seconds from the release to each frame.
std::vector<double> scene_frame_times_s(const SyntheticScene& scene);

/// Returns vertices of the truth's mesh, truth_mesh a side, at times (rising, s) since the release
/// that `seed` draws. They are 3 x vertices, world, m. Hidden effects of motion act; the
/// recording's first frame is time 0 for them, and effects that move supports are prescribed
/// motions. Throws InputError where that cannot be simulated, and StopRequested where
/// `is_cancelled` says so.
std::vector<Eigen::Matrix3Xd> simulate_scene(const SyntheticScene& scene, std::uint64_t seed,
                                             std::span<const double> time_s);

}  // namespace clothfit
