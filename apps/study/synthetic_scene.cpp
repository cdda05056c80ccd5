#include "apps/study/synthetic_scene.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "data/input_error.h"
#include "fit/draws.h"
#include "fit/simulation.h"
#include "model/cloth.h"
#include "model/simulate.h"
#include "model/stability.h"

namespace clothfit {
namespace {

constexpr double kDistanceM = 1.0;  ///< of the cameras

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

Recording scene_recording(const SyntheticScene& scene) {
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
  return recording;
}

std::map<std::string, double> scene_truth(const SyntheticScene& scene) {
  std::map<std::string, double> truth = named(scene.fabric);
  truth["viscous_damping.rate"] = scene.drag_per_s;
  return truth;
}

CameraParameters scene_camera(const SyntheticScene& scene, int number, int width_px,
                              int height_px) {
  constexpr double kApart = 0.5;  // rad
  const double angle = kApart * ((number + 1) / 2) * (number % 2 == 0 ? 1 : -1);
  const Eigen::Vector3d middle(0.5 * scene.size_m, 0, -0.5 * scene.size_m);
  const Eigen::Vector3d away(std::sin(angle), -std::cos(angle), 0);
  const Eigen::Vector3d place = middle + kDistanceM * away;
  Eigen::Matrix3d camera_from_world;
  const Eigen::Vector3d right(std::cos(angle), std::sin(angle), 0);
  camera_from_world << right.transpose(), -Eigen::RowVector3d::UnitZ(), -away.transpose();
  const double focal_px = 1000 * 0.4 / scene.size_m * std::min(width_px / 960.0, height_px / 720.0);
  return {.name = "camera" + std::to_string(number + 1),
          .model = CameraModel::brown_conrady,
          .image_width = width_px,
          .image_height = height_px,
          .focal_px = {focal_px, focal_px},
          .centre_px = {0.5 * (width_px - 1), 0.5 * (height_px - 1)},
          .distortion = {-0.1, 0.03, 5e-4, -5e-4},
          .camera_from_world = CameraPose{.rotation = Eigen::Quaterniond(camera_from_world),
                                          .translation_m = -camera_from_world * place}};
}

std::vector<double> scene_frame_times_s(const SyntheticScene& scene) {
  std::vector<double> time_s;
  for (int f = 0; f < scene.frames; ++f) time_s.push_back(scene.before_s + f / scene.frame_rate_hz);
  return time_s;
}

std::vector<Eigen::Matrix3Xd> simulate_scene(const SyntheticScene& scene, std::uint64_t seed,
                                             std::span<const double> time_s) {
  const Mesh mesh{scene.truth_mesh, scene.truth_mesh, scene.size_m, scene.size_m};
  Cloth cloth = Cloth::of(mesh, masses_by_area(mesh, scene.mass_kg));
  cloth.held = {held_at(mesh, 0, 0), held_at(mesh, scene.size_m, 0)};
  cloth.add_effect("viscous_damping", "synthetic");
  const ParameterSet set{.springs = spring_parameters(scene.fabric, mesh),
                         .effects = {{scene.drag_per_s}},
                         .start_position_m = released(mesh, seed)};
  // As fits leave room to the largest stable step
  Schedule schedule{.time_step_s = stable_time_step_s(cloth, set) / (1.5 * scene.truth_steps)};
  const bool begins_later = time_s.front() > 0;
  if (begins_later) schedule.frame_time_s.push_back(0);
  schedule.frame_time_s.insert(schedule.frame_time_s.end(), time_s.begin(), time_s.end());
  SimulateResult run = std::move(simulate(cloth, {&set, 1}, schedule).front());
  if (!run.usable())
    throw InputError("recover", "the scene's cloth cannot be simulated", "a calmer motion",
                     "shorten it with --seconds, or raise the stiffness");
  if (begins_later) run.position_m.erase(run.position_m.begin());
  return run.position_m;
}

}  // namespace clothfit
