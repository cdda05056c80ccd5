#include "apps/study/synthetic_recording.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "calib/projection.h"
#include "data/input_error.h"
#include "fit/draws.h"
#include "model/cloth.h"
#include "model/simulate.h"
#include "model/stability.h"
#include "model/surface.h"

namespace clothfit {
namespace {

/// Series of draws: a thing drawn anew does not change the others.
enum Series : int { kRelease, kNoise3d, kLosses, kHand, kNoise2d };

constexpr double kDistanceM = 1.0;  ///< of the cameras

/// Cameras in a row before the cloth, all looking at its middle; the first one straight at it.
/// World x to the right, z up; the cloth hangs around (size / 2, 0, -size / 2).
CameraParameters camera_of(const SyntheticScene& scene, int number) {
  constexpr double kApart = 0.5;  // rad
  const double angle = kApart * ((number + 1) / 2) * (number % 2 == 0 ? 1 : -1);
  const Eigen::Vector3d middle(0.5 * scene.size_m, 0, -0.5 * scene.size_m);
  const Eigen::Vector3d away(std::sin(angle), -std::cos(angle), 0);
  const Eigen::Vector3d place = middle + kDistanceM * away;
  Eigen::Matrix3d camera_from_world;
  const Eigen::Vector3d right(std::cos(angle), std::sin(angle), 0);
  camera_from_world << right.transpose(), -Eigen::RowVector3d::UnitZ(), -away.transpose();
  const double focal_px = 1000 * 0.4 / scene.size_m;  // the cloth fills half of the picture
  return {.name = "camera" + std::to_string(number + 1),
          .model = CameraModel::brown_conrady,
          .image_width = 960,
          .image_height = 720,
          .focal_px = {focal_px, focal_px},
          .centre_px = {479.5, 359.5},
          .distortion = {-0.1, 0.03, 5e-4, -5e-4},
          .camera_from_world = CameraPose{.rotation = Eigen::Quaterniond(camera_from_world),
                                          .translation_m = -camera_from_world * place}};
}

Recording recording_of(const SyntheticScene& scene) {
  Recording recording;
  recording.name = "synthetic";
  recording.folder = "synthetic";
  recording.cloth = {.width_m = scene.size_m,
                     .height_m = scene.size_m,
                     .mass_kg = scene.mass_kg,
                     .mesh_columns = scene.truth_mesh,
                     .mesh_rows = scene.truth_mesh};
  recording.frame_rate_hz = scene.frame_rate_hz;
  recording.start = scene.before_s > 0 ? StartKind::unknown : StartKind::released_flat;
  recording.held = {{.at_m = {0, 0}}, {.at_m = {scene.size_m, 0}}};
  for (int i = 0; i < scene.markers; ++i) {
    for (int j = 0; j < scene.markers; ++j) {
      const std::string name = std::to_string(i) + "_" + std::to_string(j);
      recording.markers.index[name] = i * scene.markers + j;
      recording.markers.markers.push_back({.name = name,
                                           .s_m = scene.size_m * j / (scene.markers - 1),
                                           .t_m = scene.size_m * i / (scene.markers - 1)});
    }
  }
  return recording;
}

/// The flat sheet before it is let go: turned out of the vertical about its upper edge by 15 to 35
/// degrees to either side, and that edge by up to 8 degrees out of the level and of the cameras'
/// plane.
Eigen::Matrix3Xd released(const Mesh& mesh, std::uint64_t seed) {
  Draws draws(seed, kRelease, 0);
  constexpr double kDegree = std::numbers::pi / 180;
  const double side = draws.uniform() < 0.5 ? -1 : 1;
  const double tilt = side * (15 + 20 * draws.uniform()) * kDegree;
  const double roll = (2 * draws.uniform() - 1) * 8 * kDegree;
  const double yaw = (2 * draws.uniform() - 1) * 8 * kDegree;
  const Eigen::Matrix3d turn = (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
                                Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitY()) *
                                Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitX()))
                                   .toRotationMatrix();
  const Eigen::Matrix3Xd flat = flat_positions(mesh);
  return turn * (Eigen::Vector3d::UnitX() * flat.row(0) - Eigen::Vector3d::UnitZ() * flat.row(1));
}

/// Positions of the markers in every frame of the recording, 3 x markers each.
std::vector<Eigen::Matrix3Xd> true_positions(const SyntheticScene& scene,
                                             const Recording& recording, std::uint64_t seed) {
  const Mesh mesh{scene.truth_mesh, scene.truth_mesh, scene.size_m, scene.size_m};
  Cloth cloth = Cloth::of(mesh, masses_by_area(mesh, scene.mass_kg));
  cloth.held = {held_at(mesh, 0, 0), held_at(mesh, scene.size_m, 0)};
  cloth.add_effect("viscous_damping", "synthetic");
  const ParameterSet set{.springs = spring_parameters(scene.fabric, mesh),
                         .effects = {{scene.drag_per_s}},
                         .start_position_m = released(mesh, seed)};
  // As fits leave room to the largest stable step
  Schedule schedule{.time_step_s = stable_time_step_s(cloth, set) / (1.5 * scene.truth_steps)};
  if (scene.before_s > 0) schedule.frame_time_s.push_back(0);
  for (int f = 0; f < scene.frames; ++f)
    schedule.frame_time_s.push_back(scene.before_s + f / scene.frame_rate_hz);
  SimulateResult run = std::move(simulate(cloth, {&set, 1}, schedule).front());
  if (!run.usable())
    throw InputError("recover", "the scene's cloth cannot be simulated", "a calmer motion",
                     "shorten it with --seconds, or raise the stiffness");
  if (scene.before_s > 0) run.position_m.erase(run.position_m.begin());

  Eigen::Matrix2Xd places(2, static_cast<Eigen::Index>(recording.markers.markers.size()));
  for (Eigen::Index m = 0; m < places.cols(); ++m)
    places.col(m) << recording.markers.markers[static_cast<size_t>(m)].s_m,
        recording.markers.markers[static_cast<size_t>(m)].t_m;
  const Surface surface =
      make_surface(mesh.columns, mesh.rows, mesh.width_m, mesh.height_m, places);
  std::vector<Eigen::Matrix3Xd> markers;
  for (const Eigen::Matrix3Xd& position_m : run.position_m)
    markers.push_back(surface.evaluate(position_m));
  return markers;
}

/// Which observations of one observer are lost, and which are gross outliers.
class Spoiled {
 public:
  Spoiled(const SyntheticScene& scene, std::uint64_t seed, int observer)
      : scene_(scene), losses_(seed, kLosses, observer), hand_(seed, kHand, 0) {
    // The hand comes to a place of its own in each recording, the same for all observers.
    hand_s_ = hand_.uniform();
    hand_t_ = hand_.uniform();
    hand_from_ = hand_.uniform() * (scene.frames - scene.frames / 3);
  }

  /// Draws for one observation, in a fixed order.
  void draw() {
    lost_ = losses_.uniform() < scene_.missing;
    outlier_ = losses_.uniform() < scene_.outliers;
  }
  bool is_lost(int frame, const Marker& marker) const {
    if (lost_) return true;
    if (!scene_.hand || frame == 0) return false;
    if (frame < hand_from_ || frame >= hand_from_ + scene_.frames / 3) return false;
    const auto covered = [&](double at_m, double corner) {
      const double from_m = 0.5 * scene_.size_m * corner;
      return at_m >= from_m && at_m <= from_m + 0.5 * scene_.size_m;
    };
    return covered(marker.s_m, hand_s_) && covered(marker.t_m, hand_t_);
  }
  /// How far off an outlier is in one coordinate, 0 for the others.
  double error(double most) {
    const double share = 2 * losses_.uniform() - 1;
    return outlier_ ? most * share : 0;
  }

 private:
  const SyntheticScene& scene_;
  Draws losses_, hand_;
  double hand_s_ = 0, hand_t_ = 0, hand_from_ = 0;
  bool lost_ = false, outlier_ = false;
};

}  // namespace

void SyntheticScene::validate() const {
  const auto require = [](bool good, const char* option, const char* expected) {
    if (!good) throw InputError(option, "is out of range", expected);
  };
  require(size_m > 0, "--size", "metres, more than 0");
  require(mass_kg > 0, "--mass", "kilograms, more than 0");
  require(drag_per_s >= 0, "--drag", "1/s, 0 or more");
  require(truth_mesh >= 3, "--truth-mesh", "at least 3 vertices a side");
  require(truth_steps >= 1, "--truth-steps", "1 or more");
  require(markers >= 2, "--markers", "at least 2 a side");
  require(frames >= 10, "--seconds", "at least 10 frames");
  require(frame_rate_hz > 0, "--rate", "frames per second, more than 0");
  require(before_s >= 0, "--before", "seconds, 0 or more");
  require(cameras >= 1 && cameras <= 4, "--cameras", "1 to 4");
  require(noise_m > 0, "--noise-mm", "millimetres, more than 0");
  require(noise_px > 0, "--noise-px", "pixels, more than 0");
  require(missing >= 0 && missing <= 0.9, "--missing", "a share, 0 to 0.9");
  require(outliers >= 0 && outliers <= 0.5, "--outliers", "a share, 0 to 0.5");
}

SyntheticRecording make_synthetic_recording(const SyntheticScene& scene, std::uint64_t seed) {
  constexpr double kOutlierM = 0.1, kOutlierPx = 60;
  const double noise_share = scene.noisy ? 1 : 0;
  SyntheticRecording result;
  FitInput& input = result.input;
  input.recording = recording_of(scene);
  const std::vector<Eigen::Matrix3Xd> markers = true_positions(scene, input.recording, seed);
  const std::vector<Marker>& places = input.recording.markers.markers;
  const auto marker_count = static_cast<int>(places.size());

  Spoiled spoiled(scene, seed, 0);
  Draws noise(seed, kNoise3d, 0);
  for (int f = 0; f < scene.frames; ++f) {
    for (int m = 0; m < marker_count; ++m) {
      spoiled.draw();
      Eigen::Vector3d place = markers[static_cast<size_t>(f)].col(m);
      for (double& coordinate : place)
        coordinate += noise_share * scene.noise_m * noise.normal() + spoiled.error(kOutlierM);
      if (spoiled.is_lost(f, places[static_cast<size_t>(m)])) continue;
      input.tracks3d.push_back(
          {.frame = f, .marker = m, .position_m = place, .sigma_m = scene.noise_m});
    }
  }
  for (int c = 0; c < scene.cameras; ++c) {
    const CameraParameters camera = camera_of(scene, c);
    input.recording.cameras.push_back({.name = camera.name});
    input.cameras.push_back(camera);
    Spoiled lost(scene, seed, 1 + c);
    Draws pixels(seed, kNoise2d, c);
    Tracks2d& tracks = input.tracks2d[camera.name];
    for (int f = 0; f < scene.frames; ++f) {
      for (int m = 0; m < marker_count; ++m) {
        lost.draw();
        Eigen::Vector2d error;
        for (double& coordinate : error)
          coordinate = noise_share * scene.noise_px * pixels.normal() + lost.error(kOutlierPx);
        const auto pixel =
            project(camera, camera_from_world(camera) *
                                Eigen::Vector3d(markers[static_cast<size_t>(f)].col(m)));
        if (!pixel || lost.is_lost(f, places[static_cast<size_t>(m)])) continue;
        tracks.push_back(
            {.frame = f, .marker = m, .position_px = *pixel + error, .sigma_px = scene.noise_px});
      }
    }
  }
  const Fabric& fabric = scene.fabric;
  result.truth = {{"tension_warp", fabric.tension_warp_n_per_m},
                  {"tension_weft", fabric.tension_weft_n_per_m},
                  {"shear", fabric.shear_n_per_m},
                  {"flexion_warp", fabric.flexion_warp_n_per_m},
                  {"flexion_weft", fabric.flexion_weft_n_per_m},
                  {"damping_warp", fabric.damping_warp_s},
                  {"damping_weft", fabric.damping_weft_s},
                  {"viscous_damping.rate", scene.drag_per_s}};
  return result;
}

}  // namespace clothfit
