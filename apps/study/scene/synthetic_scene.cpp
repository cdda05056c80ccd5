#include "apps/study/scene/synthetic_scene.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "apps/study/scene/runge_kutta_run.h"
#include "data/input_error.h"
#include "fit/jobs/draws.h"
#include "fit/jobs/stop_token.h"
#include "fit/measurement_effects/registry.h"
#include "fit/problem/memory_limits.h"
#include "fit/problem/simulation.h"
#include "fit/problem/time_steps.h"
#include "fit/problem/work_limits.h"
#include "model/cloth/cloth.h"
#include "model/cloth/stability.h"
#include "model/effects/registry.h"
#include "model/integrate/simulate.h"

namespace clothfit {
namespace {

constexpr double kDistanceM = 1.0;  ///< distance of the cameras

/// Returns the flat sheet before it is let go. It is turned out of the vertical about its upper
/// edge by 15 to 35 degrees to either side. That edge is turned by up to 8 degrees out of the level
/// and of the cameras' plane.
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

/// Returns how far a hidden effect has moved the supports at a time (s, the recording's); nothing
/// where it leaves them alone. The effects' equations stand here a second time, because the truth
/// has to come from other code than the model's.
std::function<Eigen::Vector3d(double)> support_shift_m(const HiddenEffect& effect) {
  const std::vector<double>& p = effect.values;
  if (effect.name == "support_drift")
    return
        [p](double time_s) { return Eigen::Vector3d(time_s * Eigen::Vector3d(p[0], p[1], p[2])); };
  if (effect.name == "support_motion")
    return [p](double time_s) {
      const auto sine = [](double turns) { return std::sin(2 * std::numbers::pi * turns); };
      return Eigen::Vector3d((sine(p[3] * time_s + p[4]) - sine(p[4])) *
                             Eigen::Vector3d(p[0], p[1], p[2]));
    };
  return {};
}

/// Returns the number of the held point that an effect moves by itself; 0 where it moves all. The
/// last parameter says so, after those of support_shift_m().
size_t moved_alone(const HiddenEffect& effect) {
  const size_t point = effect.name == "support_drift" ? 3 : 5;
  return effect.values.size() > point ? static_cast<size_t>(effect.values[point]) : 0;
}

/// The cloth and its numbers, released, with its hidden effects of motion.
struct Truth {
  Cloth cloth;
  ParameterSet set;
};

Truth make_truth(const SyntheticScene& scene, std::uint64_t seed) {
  const Mesh mesh{scene.truth_mesh, scene.truth_mesh, scene.size_m, scene.size_m};
  Truth truth{.cloth = Cloth::of(mesh, masses_by_area(mesh, scene.mass_kg)),
              .set = {.springs = spring_parameters(scene.fabric, mesh),
                      .effects = {{scene.drag_per_s}},
                      .start_position_m = released(mesh, seed)}};
  truth.cloth.held = {held_at(mesh, 0, 0), held_at(mesh, scene.size_m, 0)};
  add_effect(truth.cloth, "viscous_damping", "synthetic");
  for (const HiddenEffect& hidden : scene.hidden) {
    if (measurement_effect_named(hidden.name) != nullptr) continue;
    const auto shift_m = support_shift_m(hidden);
    if (!shift_m) {
      add_effect(truth.cloth, hidden.name, "hidden effect");
      truth.set.effects.push_back(hidden.values);
      continue;
    }
    // The cloth is released where the supports are by then, all moved alike.
    const Eigen::Vector3d first_m = shift_m(-scene.before_s);
    const size_t one = moved_alone(hidden);
    for (size_t h = 0; h < truth.cloth.held.size(); ++h) {
      if (one > 0 && h + 1 != one) continue;
      HeldVertexWeights& held = truth.cloth.held[h];
      Eigen::Vector3d at_rest_m = Eigen::Vector3d::Zero();
      for (const auto& [vertex, weight] : held.weights)
        at_rest_m += weight * truth.set.start_position_m.col(vertex);
      held.motion = [at_rest_m, shift_m, before = held.motion](double time_s) {
        return Eigen::Vector3d((before ? before(time_s) : at_rest_m) + shift_m(time_s));
      };
    }
    if (one == 0) truth.set.start_position_m.colwise() += first_m;
  }
  return truth;
}

/// Fits leave room to the largest stable step, and so does this.
double time_step_s(const SyntheticScene& scene, const Truth& truth) {
  return stable_time_step_s(truth.cloth, truth.set) / (kStabilityMargin * scene.truth_steps);
}

void require_affordable(const SyntheticScene& scene, const Truth& truth, const Schedule& schedule) {
  RunWork work = work_of_run(truth.cloth, schedule.frame_time_s, schedule.time_step_s, false, 0);
  constexpr double kStages = 4;
  if (scene.integrator == TruthIntegrator::runge_kutta) work.springs *= kStages;
  require_affordable_run(work, "--truth-steps",
                         "fewer --truth-steps, a coarser --truth-mesh, or fewer --seconds");
}

constexpr int kMostSide = 256;  ///< as the finest square mesh of a recording
constexpr int kMostSceneFrames = 100'000;

}  // namespace

std::string to_string(TruthIntegrator integrator) {
  return integrator == TruthIntegrator::runge_kutta ? "Runge-Kutta" : "Euler";
}

void SyntheticScene::validate() const {
  const auto require = [](bool good, const char* option, const char* expected) {
    if (!good) throw InputError(option, "is out of range", expected);
  };
  require(size_m > 0 && size_m <= 1e3, "--size", "metres, more than 0");
  require(mass_kg > 0 && mass_kg <= 1e6, "--mass", "kilograms, more than 0");
  require(drag_per_s >= 0 && drag_per_s <= 1e6, "--drag", "1/s, 0 to 1e6");
  require(truth_mesh >= 3 && truth_mesh <= kMostSide, "--truth-mesh", "3 to 256 vertices a side");
  require(truth_steps >= 1 && truth_steps <= kFinestStep, "--truth-steps", "1 to 1000");
  require(markers >= 2 && markers <= kMostSide, "--markers", "2 to 256 a side");
  require(frames >= 10 && frames <= kMostSceneFrames, "--seconds",
          "10 to 100000 frames at this --rate");
  require(held_out_from == 0 || (held_out_from >= 8 && held_out_from < frames), "--fitted",
          "a frame from 8 to before the last");
  require(frame_rate_hz > 0 && frame_rate_hz <= 1e6, "--rate",
          "frames per second, more than 0, at most 1e6");
  require(before_s >= 0 && before_s <= 1e4, "--before", "seconds, 0 to 10000");
  require(cameras >= 1 && cameras <= 4, "--cameras", "1 to 4");
  require(noise_m > 0 && noise_m <= 1e3, "--noise-mm", "millimetres, more than 0, at most 1e6");
  require(noise_px > 0 && noise_px <= 1e4, "--noise-px", "pixels, more than 0, at most 1e4");
  require(missing >= 0 && missing <= 0.9, "--missing", "a share, 0 to 0.9");
  require(outliers >= 0 && outliers <= 0.5, "--outliers", "a share, 0 to 0.5");
  // A row of the tracks and what a fit makes of it; a frame of the truth.
  constexpr double kBytesOfRow = 200, kBytesOfVertex = 24;
  const double vertices = static_cast<double>(truth_mesh) * truth_mesh,
               rows = static_cast<double>(markers) * markers * cameras;
  require_memory(frames * (rows * kBytesOfRow + vertices * kBytesOfVertex), "--markers",
                 fmt::format("{} frames of {} x {} markers", frames, markers, markers),
                 "fewer --markers, a coarser --truth-mesh, or fewer --seconds");
  // The work is the same for every release.
  const Truth truth = make_truth(*this, 1);
  require_affordable(*this, truth,
                     {.frame_time_s = {-before_s, (frames - 1) / frame_rate_hz},
                      .time_step_s = time_step_s(*this, truth)});
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
  if (scene.held_out_from > 0) recording.held_out_from_frame = scene.held_out_from;
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
  const Truth truth = make_truth(scene, seed);
  Schedule schedule;
  const bool begins_later = time_s.front() > 0;
  if (begins_later) schedule.frame_time_s.push_back(-scene.before_s);
  for (const double since_release_s : time_s)
    schedule.frame_time_s.push_back(since_release_s - scene.before_s);

  schedule.time_step_s = time_step_s(scene, truth);
  require_affordable(scene, truth, schedule);
  std::vector<Eigen::Matrix3Xd> position_m;
  const StopCheck stop = throwing_check(scene.is_cancelled);
  // Only a step itself can shift supports otherwise than by a prescribed motion.
  const bool shifts_supports =
      std::ranges::any_of(truth.cloth.effects, [](const auto& e) { return e->shifts_supports(); });
  if (scene.integrator == TruthIntegrator::runge_kutta && !shifts_supports) {
    position_m = run_runge_kutta(truth.cloth, truth.set, schedule, stop);
  } else {
    SimulateResult run = std::move(
        simulate(truth.cloth, {&truth.set, 1}, schedule, Precision::exact, {}, stop).front());
    if (run.usable()) position_m = std::move(run.position_m);
  }
  if (position_m.empty())
    throw InputError("recover", "the scene's cloth cannot be simulated", "a calmer motion",
                     "shorten it with --seconds, or raise the stiffness");
  if (begins_later) position_m.erase(position_m.begin());
  return position_m;
}

}  // namespace clothfit
