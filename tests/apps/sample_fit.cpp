#include "tests/apps/sample_fit.h"

#include <cmath>
#include <limits>

namespace clothfit::test {
namespace {

constexpr int kFrames = 24;
constexpr int kFirstHeldOut = 16;
constexpr int kSide = 9;
constexpr double kSize_m = 0.4;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Recording sample_recording() {
  Recording recording;
  recording.folder = "/nowhere";
  recording.name = "a <b>bold</b> name & more";
  recording.origin = "made up, \"CC0\"";
  recording.cloth.width_m = kSize_m;
  recording.cloth.height_m = kSize_m;
  recording.cloth.mass_kg = 0.0325;
  recording.frame_rate_hz = 60;
  recording.start = StartKind::released_flat;
  recording.held_out_from_frame = kFirstHeldOut;
  for (int i = 0; i < kSide; ++i) {
    for (int j = 0; j < kSide; ++j) {
      Marker marker;
      marker.name = std::to_string(i);
      marker.name += "<";
      marker.name += std::to_string(j);
      marker.s_m = kSize_m * j / (kSide - 1);
      marker.t_m = kSize_m * i / (kSide - 1);
      recording.markers.index[marker.name] = static_cast<int>(recording.markers.markers.size());
      recording.markers.markers.push_back(marker);
    }
  }
  return recording;
}

FitReport::Residuals sample_residuals(const Recording& recording, int coordinates) {
  FitReport::Residuals residuals;
  residuals.kind = coordinates == 2 ? "front" : "tracks3d";
  residuals.unit = coordinates == 2 ? "px" : "m";
  const double scale = coordinates == 2 ? 1.0 : 1e-3;
  for (int frame = 0; frame < kFrames; ++frame) {
    double sum = 0;
    int count = 0;
    for (int index = 0; index < kSide * kSide; ++index) {
      const Marker& marker = recording.markers.markers[static_cast<size_t>(index)];
      const double swing = 0.12 * std::sin(0.15 * frame) * marker.t_m / kSize_m;
      FitReport::Residuals::Row row;
      row.frame = frame;
      row.marker = index;
      row.held_out = frame >= kFirstHeldOut;
      row.sigma = 0.3 * scale;
      if (coordinates == 2) {
        row.observed =
            Eigen::Vector2d(250 + 1100 * marker.s_m, 120 + 1000 * marker.t_m + 300 * swing);
      } else {
        row.observed = Eigen::Vector3d(marker.s_m, swing, 1 - marker.t_m);
      }
      const double size = scale * 0.3 * (1 + 0.05 * frame) * (0.4 + marker.t_m / kSize_m);
      Eigen::VectorXd off(coordinates);
      for (int c = 0; c < coordinates; ++c)
        off[c] = size * std::sin(12.9 * index + 7.1 * frame + 2.3 * c);
      row.predicted = row.observed + off;
      sum += off.squaredNorm();
      count += coordinates;
      residuals.rows.push_back(row);
    }
    const bool held_out = frame >= kFirstHeldOut;
    residuals.rms_by_frame.push_back(std::sqrt(sum / count));
    residuals.first_frame_by_frame.push_back(scale * (0.4 + 2.0 * frame));
    residuals.last_velocity_by_frame.push_back(
        held_out ? scale * (0.6 + 0.5 * std::pow(frame - kFirstHeldOut + 1, 1.6)) : kNan);
    residuals.rigid_by_frame.push_back(scale * (0.4 + 2.1 * frame));
  }
  return residuals;
}

ErrorSummary summary_of(const FitReport::Residuals& residuals, bool held_out) {
  ErrorSummary summary;
  double sum = 0;
  Eigen::Index coordinates = 0;
  for (const FitReport::Residuals::Row& row : residuals.rows) {
    if (row.held_out != held_out) continue;
    sum += (row.predicted - row.observed).squaredNorm();
    coordinates += row.observed.size();
    ++summary.count;
  }
  summary.rms = std::sqrt(sum / static_cast<double>(coordinates));
  summary.rms_distance = std::sqrt(sum / summary.count);
  return summary;
}

}  // namespace

SampleFit sample_fit(int coordinates) {
  SampleFit sample;
  sample.recording = sample_recording();
  FitReport& report = sample.report;
  report.message = "converged after 3 stages";
  report.residuals.push_back(sample_residuals(sample.recording, coordinates));
  const FitReport::Residuals& residuals = report.residuals.front();
  const double scale = coordinates == 2 ? 1.0 : 1e-3;

  FitResult& result = report.result;
  result.recording = sample.recording.name;
  result.version = "0.1.0";
  result.command = "clothfit fit 'a & b' --seed 7";
  result.seed = 7;
  result.seconds = 12.3;
  result.mesh_columns = result.mesh_rows = 17;
  result.parameter_set = "fabric";
  result.integrator = "euler";
  result.substeps = 24;
  result.time_step_s = 1.0 / 60 / 24;
  result.start = "released_flat";
  result.parameters = {
      {"tension_warp", "N/m", 55.1234, 0.61, ParameterState::fitted, ""},
      {"tension_weft", "N/m", 54.2, 0.7, ParameterState::fitted, ""},
      {"shear", "N/m", 11.02, 0.2, ParameterState::fitted, ""},
      {"flexion", "N/m", 2.3e-5, 1.2e-6, ParameterState::fitted, ""},
      {"damping", "N s/m", 0.05, 0.4, ParameterState::undetermined,
       "sigma exceeds the value, p < 1"},
      {"areal_density", "kg/m2", 0.203125, 0, ParameterState::fixed, "the cloth was weighed"}};
  result.effects = {{"viscous_damping", {{"c", "1/s", -0.02, 0.03, ParameterState::fitted, ""}}}};
  result.basins = {{.cost = 1.61, .ended = 2, .parameters = {{"tension_warp", 55.1}, {"a<b", 1}}},
                   {.cost = 2.93, .ended = 1, .parameters = {{"tension_warp", 88.7}, {"a<b", 2}}}};
  ObservationErrors errors;
  errors.kind = residuals.kind;
  errors.unit = residuals.unit;
  errors.fitted = summary_of(residuals, false);
  errors.held_out = summary_of(residuals, true);
  errors.noise = 0.3 * scale;
  errors.trivial = {40 * scale, 9 * scale, 42 * scale};
  result.errors = {errors};
  result.observations_used = errors.fitted.count;
  result.observations_rejected = {{"decision margin < 20 & blurred", 12}, {"moved too fast", 3}};

  report.correlation_names = {"tension_warp", "tension_weft", "shear"};
  report.correlation.resize(3, 3);
  report.correlation << 1, -0.42, 0.91, -0.42, 1, 0.07, 0.91, 0.07, 1;
  for (int generation = 0; generation < 20; ++generation)
    report.search_cost.push_back(0.4 + 60 * std::exp(-0.35 * generation));
  report.stages = {"search: 20 generations of 100, windows of 10 frames, cost 0.46",
                   "refinement: 16 frames, 24 substeps, 31 evaluations, cost 0.21"};
  return sample;
}

}  // namespace clothfit::test
