#include "tests/fit/synthetic_cloth.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numbers>
#include <random>
#include <utility>

#include "calib/camera/projection.h"
#include "model/cloth/cloth.h"
#include "model/effects/registry.h"
#include "model/integrate/simulate.h"
#include "model/topology/surface.h"

namespace clothfit {

CameraParameters synthetic_camera() {
  CameraParameters camera{.name = "front",
                          .model = CameraModel::brown_conrady,
                          .image_width = 960,
                          .image_height = 720,
                          .focal_px = {1000, 1000},
                          .centre_px = {480, 360},
                          .distortion = {-0.1, 0.03, 5e-4, -5e-4}};
  // World x is to the right, z up; the camera looks along +y at the cloth's middle.
  Eigen::Matrix3d rotation;
  rotation << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  camera.camera_from_world =
      CameraPose{.rotation = Eigen::Quaterniond(rotation), .translation_m = {-0.2, -0.2, 1.0}};
  return camera;
}

Eigen::VectorXd start_with(const FitProblem& problem, const Fabric& fabric) {
  Eigen::VectorXd values = problem.space.start();
  for (const auto& [name, value] : named(fabric)) values[problem.space.index(name)] = value;
  return values;
}

namespace {

/// Returns the motion between the frames of a run with velocities. Frames 1 / 480 s apart miss less
/// than a micrometre of it.
SyntheticMotion motion_of(SimulateResult run, double interval_s, int mesh, double size_m) {
  return [run = std::move(run), interval_s, mesh, size_m](double time_s,
                                                          const Eigen::Vector2d& place_m) {
    const double at = std::max(time_s, 0.0) / interval_s;
    const size_t k = std::min(static_cast<size_t>(at), run.position_m.size() - 2);
    const double u = at - static_cast<double>(k);
    const Eigen::Matrix3Xd vertices =
        (1 + u * u * (2 * u - 3)) * run.position_m[k] +
        u * u * (3 - 2 * u) * run.position_m[k + 1] +
        interval_s * u * (1 - u) *
            ((1 - u) * run.velocity_m_per_s[k] - u * run.velocity_m_per_s[k + 1]);
    return Eigen::Vector3d(
        make_surface(mesh, mesh, size_m, size_m, place_m).evaluate(vertices).col(0));
  };
}

}  // namespace

FitInput synthetic_input(const SyntheticCloth& truth) {
  constexpr double kSize = 0.4;
  constexpr double kMass = 0.03;
  FitInput input;
  Recording& recording = input.recording;
  recording.name = "synthetic";
  recording.folder = "synthetic";
  recording.cloth = {.width_m = kSize,
                     .height_m = kSize,
                     .mass_kg = kMass,
                     .mesh_columns = truth.mesh,
                     .mesh_rows = truth.mesh};
  recording.frame_rate_hz = 60;
  recording.start = StartKind::released_flat;
  recording.held = {{.at_m = {0, 0}}, {.at_m = {kSize, 0}}};
  recording.held_out_from_frame = truth.held_out_from;
  Eigen::Matrix2Xd places(2, truth.markers * truth.markers);
  for (int i = 0; i < truth.markers; ++i) {
    for (int j = 0; j < truth.markers; ++j) {
      const int m = i * truth.markers + j;
      const double margin = truth.marker_margin_m, span = kSize - 2 * margin;
      places.col(m) << margin + span * j / (truth.markers - 1),
          margin + span * i / (truth.markers - 1);
      const std::string name = std::string("m") + std::to_string(m);
      recording.markers.markers.push_back({.name = name, .s_m = places(0, m), .t_m = places(1, m)});
      recording.markers.index[name] = m;
    }
  }

  const Mesh mesh{truth.mesh, truth.mesh, kSize, kSize};
  Cloth cloth = Cloth::of(mesh, masses_by_area(mesh, kMass));
  cloth.held = {held_at(mesh, 0, 0), held_at(mesh, kSize, 0)};
  add_effect(cloth, "viscous_damping", "test");
  ParameterSet parameters{.springs = spring_parameters(truth.fabric, mesh),
                          .effects = {{truth.drag_rate_per_s}}};
  if (truth.critical_elongation > 0) {
    cloth.strain_limit.mode = StrainLimitMode::positions;
    parameters.springs.critical_elongation.fill(truth.critical_elongation);
  }
  // The flat sheet has s to the right, t down and, turned, away from the camera.
  const double tilt = 25.0 / 180.0 * std::numbers::pi;
  const Eigen::Vector3d along_t(0, std::sin(tilt), -std::cos(tilt));
  const Eigen::Matrix3Xd flat = flat_positions(mesh);
  parameters.start_position_m = Eigen::Vector3d::UnitX() * flat.row(0) + along_t * flat.row(1);
  Schedule schedule{.frame_time_s = {}, .time_step_s = 1.0 / 60 / 200};
  if (truth.clock_offset_s > 0) schedule.frame_time_s.push_back(0);
  for (int f = 0; f < truth.frames; ++f)
    schedule.frame_time_s.push_back(f / 60.0 + truth.clock_offset_s);
  SyntheticMotion motion;
  if (truth.seen) {
    constexpr double kFineS = 1.0 / 480, kBeyondS = 0.1;
    Schedule fine{.frame_time_s = {}, .time_step_s = schedule.time_step_s, .velocities = true};
    for (int f = 0; f * kFineS < truth.frames / 60.0 + kBeyondS; ++f)
      fine.frame_time_s.push_back(f * kFineS);
    motion = motion_of(simulate(cloth, {&parameters, 1}, fine).front(), kFineS, truth.mesh, kSize);
  }
  SimulateResult run = simulate(cloth, {&parameters, 1}, schedule).front();
  if (truth.clock_offset_s > 0) run.position_m.erase(run.position_m.begin());
  const Eigen::Vector3d middle = parameters.start_position_m.rowwise().mean();

  const Surface surface = make_surface(truth.mesh, truth.mesh, kSize, kSize, places);
  const CameraParameters camera = synthetic_camera();
  recording.cameras = {{.name = camera.name}};
  input.cameras = {camera};
  std::mt19937_64 generator(truth.seed);
  std::normal_distribution<double> normal;
  for (int f = 0; f < truth.frames; ++f) {
    Eigen::Matrix3Xd seen = surface.evaluate(run.position_m[static_cast<size_t>(f)]);
    for (int m = 0; truth.seen && m < seen.cols(); ++m)
      seen.col(m) = truth.seen(motion, f / 60.0, places.col(m));
    for (int m = 0; m < seen.cols(); ++m) {
      const Eigen::Vector3d point = middle + truth.scale * (seen.col(m) - middle);
      Eigen::Vector3d noise;
      for (double& coordinate : noise) coordinate = normal(generator);
      input.tracks3d.push_back({.frame = f,
                                .marker = m,
                                .position_m = point + truth.noise_m * noise,
                                .sigma_m = truth.noise_m});
      Eigen::Vector2d pixel = *project(camera, camera_from_world(camera) * point);
      if (truth.pixel) pixel = truth.pixel(pixel);
      for (double& coordinate : pixel) coordinate += truth.noise_px * normal(generator);
      input.tracks2d[camera.name].push_back(
          {.frame = f, .marker = m, .position_px = pixel, .sigma_px = truth.noise_px});
    }
  }
  return input;
}

}  // namespace clothfit
