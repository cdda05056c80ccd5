#include "fit/problem/problem.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "calib/camera/projection.h"
#include "data/input_error.h"
#include "data/nearest_name.h"
#include "fit/measurement_effects/applicability.h"
#include "fit/measurement_effects/registry.h"
#include "fit/observe/sheet_placement.h"
#include "fit/problem/cloth_setup.h"
#include "fit/problem/memory_limits.h"
#include "fit/problem/unknown_group.h"

namespace clothfit {
namespace {

/// The assumed density, that of a light woven fabric, serves for a cloth that was not weighed.
constexpr double kAssumedDensityKgPerM2 = 0.1;

/// Sheets of cloth at rest are placed by this many pooled frames: single ones are often bad
/// detections.
constexpr int kRestFrames = 5;

/// Returns the number of frames up to the last observed one. It is limited, for a slip of the
/// keyboard in a frame number must not ask for a simulation of years.
int frame_count(const FitInput& input) {
  constexpr int kMostFrames = 1'000'000;
  int last = -1;
  for (const Position3d& row : input.tracks3d) last = std::max(last, row.frame);
  for (const auto& [camera, tracks] : input.tracks2d)
    for (const Position2d& row : tracks) last = std::max(last, row.frame);
  if (last >= kMostFrames)
    throw InputError(recording_file(input.recording),
                     "the tracks name frame " + std::to_string(last),
                     "at most " + std::to_string(kMostFrames) + " frames",
                     "look for a slip in the frame column");
  return last + 1;
}

bool use_3d(const FitInput& input, const FitOptions& options) {
  if (options.observations == ObservationKind::automatic) return !input.tracks3d.empty();
  return options.observations == ObservationKind::tracks3d;
}

void add_observations(const FitInput& input, const FitOptions& options, FitProblem& problem) {
  const Recording& recording = input.recording;
  const auto markers = static_cast<int>(recording.markers.markers.size());
  const ObservedFrames frames{.time_s = problem.frame_time_s,
                              .first_held_out = problem.first_held_out};
  if (use_3d(input, options)) {
    problem.observations.push_back(observations_3d(input.tracks3d, frames, markers,
                                                   problem.driving_markers, problem.rejected));
  } else {
    for (const CameraParameters& camera : input.cameras) {
      const auto tracks = input.tracks2d.find(camera.name);
      if (tracks == input.tracks2d.end()) continue;
      if (!camera.camera_from_world)
        throw InputError("camera " + camera.name, "has no camera_from_world",
                         "a fit needs to know where each camera stands",
                         "give the recording reference points, or the pose in the camera file");
      problem.observations.push_back(observations_2d(tracks->second, camera, frames, markers,
                                                     problem.driving_markers, problem.rejected));
    }
  }
  std::erase_if(problem.observations, [](const ObservationSet& set) { return set.rows.empty(); });
  if (problem.observations.empty())
    throw InputError(recording_file(recording), "there is nothing to fit",
                     "tracks3d or tracks2d with at least one good row",
                     "look at the status column of the tracks");
}

void add_marker_offsets(const FitOptions& options, FitProblem& problem) {
  if (options.marker_offset_sigma_m == 0) return;
  if (problem.observations.front().dimension != 3)
    throw InputError("FitOptions::marker_offset_sigma_m", "the fit looks at pixels",
                     "3D tracks: an offset is a constant in space",
                     "leave it out, or take FitOptions::observations = tracks3d");
  problem.marker_offset_sigma_m = options.marker_offset_sigma_m;
}

void add_masses(const Recording& recording, const Mesh& mesh, FitProblem& problem) {
  const ClothDescription& cloth = recording.cloth;
  problem.mass_assumed = !cloth.mass_kg.has_value();
  problem.cloth_mass_kg =
      cloth.mass_kg.value_or(kAssumedDensityKgPerM2 * cloth.width_m * cloth.height_m);
  problem.cloth = make_cloth(cloth, mesh, problem.cloth_mass_kg);
}

/// Adds knowledge of parameters from elsewhere.
void add_given_priors(const FitOptions& options, FitProblem& problem) {
  std::vector<std::string> known;
  for (const FitParameter& parameter : problem.space.parameters)
    if (is_listed(parameter.role)) known.push_back(parameter.name);
  std::vector<std::string> told;
  for (const ParameterPrior& prior : options.priors) {
    const std::string where = "FitOptions::priors = " + prior.name;
    const int p = problem.space.index(prior.name);
    if (p < 0)
      throw InputError(where, "the fit has no such parameter", known_names(prior.name, known));
    FitParameter& parameter = problem.space.parameters[static_cast<size_t>(p)];
    if (!(prior.mean >= parameter.lower && prior.mean <= parameter.upper))
      throw InputError(where, fmt::format("a mean of {:g}", prior.mean),
                       fmt::format("{:g} to {:g} ({}), where the fit looks", parameter.lower,
                                   parameter.upper, parameter.unit));
    if (std::ranges::find(told, prior.name) != told.end())
      throw InputError(where, "is given twice", "one mean and standard deviation a parameter");
    told.push_back(prior.name);
    // The search leaves it out, and from a neutral value no derivative may lead away.
    if (parameter.role == ParameterRole::measurement) parameter.start = prior.mean;
    problem.priors.push_back(
        {.indices = {p},
         .mean = Eigen::VectorXd::Constant(1, prior.mean),
         .sqrt_information = Eigen::MatrixXd::Constant(1, 1, 1 / prior.sigma)});
  }
}

bool declares_readout(const FitProblem& problem) {
  return std::ranges::any_of(problem.observations, [](const ObservationSet& set) {
    return set.camera && set.camera->readout_time_s > 0;
  });
}

Rigid3 place_sheet_of(const Recording& recording, FitProblem& problem) {
  const Eigen::Matrix2Xd& places = problem.marker_place_m;
  const int frames = recording.start == StartKind::at_rest ? kRestFrames : 1;
  const auto world_from_sheet = place_flat_sheet(problem.observations, places, frames);
  if (!world_from_sheet)
    throw InputError(recording_file(recording),
                     frames == 1 ? "frame 0 shows too few markers to place the sheet"
                                 : "the first frames show too few markers to place the sheet",
                     "at least four markers that do not lie on a line",
                     "cut the recording so that it begins with a frame that shows them");
  const Eigen::Matrix3Xd flat = flat_positions(problem.cloth.mesh);
  problem.placed_sheet_m.resize(3, flat.cols());
  for (Eigen::Index v = 0; v < flat.cols(); ++v)
    problem.placed_sheet_m.col(v) = *world_from_sheet * Eigen::Vector3d(flat.col(v));
  return *world_from_sheet;
}

/// Returns how many vertices along one axis a place has weights at: one where it lies on a vertex.
double weights_along(double place_m, double length_m, int count) {
  constexpr double kAround = 46, kOnVertex = 1e-9;
  const double place = place_m / length_m * (count - 1);
  return std::abs(place - std::round(place)) < kOnVertex ? 1 : std::min<double>(kAround, count);
}

/// Throws where the markers' weights on the mesh do not fit into memory.
void require_weights(const Recording& recording, const Mesh& mesh) {
  constexpr double kBytesOfWeight = 16;
  double weights = 0;
  for (const Marker& marker : recording.markers.markers)
    weights += weights_along(marker.s_m, mesh.width_m, mesh.columns) *
               weights_along(marker.t_m, mesh.height_m, mesh.rows);
  // They stand twice, sorted and not, while they are made ready.
  require_memory(2 * kBytesOfWeight * weights, recording_file(recording),
                 fmt::format("the places of {} markers on {} x {} nodes",
                             recording.markers.markers.size(), mesh.columns, mesh.rows),
                 "fewer markers or a coarser mesh (FitOptions::mesh_columns)");
}

}  // namespace

std::optional<std::string> why_readout_is_not_used(const FitProblem& problem) {
  if (!declares_readout(problem)) return std::nullopt;
  const auto effect = measurement_effect_named("rolling_shutter")->make();
  const auto why = why_inapplicable(*effect, measurement_setting(problem));
  return why ? std::optional(why->problem) : std::nullopt;
}

FitProblem make_problem(const FitInput& input, const FitOptions& options, int mesh_columns,
                        int mesh_rows) {
  const Recording& recording = input.recording;
  FitProblem problem;
  problem.stop = options.is_cancelled;
  problem.start = recording.start;
  problem.gravity_m_per_s2 = recording.gravity_m_per_s2;
  const int frames = frame_count(input);
  for (int f = 0; f < frames; ++f) problem.frame_time_s.push_back(recording.frame_time_s(f));
  problem.first_held_out = std::min(recording.held_out_from_frame.value_or(frames), frames);
  if (problem.first_held_out < 2 && !options.forecast)
    throw InputError(recording_file(recording),
                     std::to_string(problem.first_held_out) + " frames are left to fit",
                     "at least two frames before held_out.from_frame");

  const Mesh mesh{mesh_columns, mesh_rows, recording.cloth.width_m, recording.cloth.height_m};
  add_masses(recording, mesh, problem);
  problem.cloth.obstacle = make_obstacle(recording.obstacle);
  Drive drive =
      make_drive(recording, mesh, input.tracks3d.empty() ? input.held_tracks : input.tracks3d,
                 problem.frame_time_s);
  problem.cloth.held = std::move(drive.held);
  problem.driving_markers = std::move(drive.driving_markers);
  add_observations(input, options, problem);
  add_marker_offsets(options, problem);
  // A diagnosis compares models, for which derivatives to half a per cent do.
  if (!options.hypotheses.empty()) problem.derivatives_kept_s = kEmergingInterval_s;
  problem.fast_derivatives = !options.hypotheses.empty() || problem.start == StartKind::unknown;
  problem.marker_place_m = marker_places(recording.markers);
  require_weights(recording, mesh);
  problem.vertex_weights = vertex_weights(
      make_surface(mesh.columns, mesh.rows, mesh.width_m, mesh.height_m, problem.marker_place_m));
  const Rigid3 world_from_sheet = place_sheet_of(recording, problem);
  const ProblemSource source{
      .input = input, .options = options, .drive = drive, .world_from_sheet = world_from_sheet};
  for (const UnknownGroup* group : unknown_groups()) group->declare(source, problem);
  add_given_priors(options, problem);
  problem.reads_in_rows = declares_readout(problem) && !why_readout_is_not_used(problem);
  return problem;
}

}  // namespace clothfit
