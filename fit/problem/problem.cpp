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
#include "fit/problem/effects_of.h"
#include "model/effects/registry.h"

namespace clothfit {
namespace {

/// The assumed density, that of a light woven fabric, serves for a cloth that was not weighed.
constexpr double kAssumedDensityKgPerM2 = 0.1;

/// Sheets of cloth at rest are placed by this many pooled frames: single ones are often bad
/// detections.
constexpr int kRestFrames = 5;

std::string recording_file(const Recording& recording) {
  return (recording.folder / "recording.yaml").string();
}

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
    throw InputError("--marker-offsets", "the fit looks at pixels",
                     "3D tracks: an offset is a constant in space",
                     "leave it out, or fit 3D tracks (--observations tracks3d)");
  problem.marker_offset_sigma_m = options.marker_offset_sigma_m;
}

void add_masses(const Recording& recording, const Mesh& mesh, FitProblem& problem) {
  const ClothDescription& cloth = recording.cloth;
  problem.mass_assumed = !cloth.mass_kg.has_value();
  problem.cloth_mass_kg =
      cloth.mass_kg.value_or(kAssumedDensityKgPerM2 * cloth.width_m * cloth.height_m);
  problem.cloth = make_cloth(cloth, mesh, problem.cloth_mass_kg);
}

/// A range of the search.
struct Range {
  double lower = 0, upper = 0;
};

/// Derives the range from the cloth's load: a spring beside a held corner bears about half the
/// weight F. Tension stiffness lies between F / a (twice as long) and 100 F / a (1 % longer), for
/// the recording's own spacing a. Shear and flexion reach far below. So do all where a strain limit
/// carries the rest.
Range range_of(const SpringNumber& number, SpringSet set, double unit_n_per_m, double flat_m) {
  switch (number.quantity) {
    case SpringQuantity::retardation_time:
      return {1e-5, 2e-2};
    case SpringQuantity::natural_length:
      return {0.8 * flat_m, 1.25 * flat_m};
    case SpringQuantity::critical_elongation:
      return {0.01, 1};
    case SpringQuantity::stiffness:
      break;
  }
  if (set != SpringSet::fabric) return {0.02 * unit_n_per_m, 100 * unit_n_per_m};
  if (number.type <= structural_s) return {unit_n_per_m, 100 * unit_n_per_m};
  if (number.type <= shear_up) return {0.02 * unit_n_per_m, 50 * unit_n_per_m};
  return {0.01 * unit_n_per_m, 25 * unit_n_per_m};
}

void add_springs(const Recording& recording, const FitOptions& options, FitProblem& problem) {
  const ClothDescription& cloth = recording.cloth;
  const double spacing_m =
      0.5 * (cloth.width_m / (cloth.mesh_columns - 1) + cloth.height_m / (cloth.mesh_rows - 1));
  const double gravity = std::max(problem.gravity_m_per_s2.norm(), 1.0);
  const double unit_n_per_m = 0.5 * problem.cloth_mass_kg * gravity / spacing_m;
  const std::array<double, kSpringTypes> flat_m = flat_lengths(problem.cloth.mesh);

  problem.spring_set = options.spring_set;
  if (problem.spring_set != SpringSet::fabric)
    problem.cloth.strain_limit.mode = StrainLimitMode::positions;
  for (const SpringNumber& number : numbers_of(problem.spring_set)) {
    Binding binding;
    if (options.forecast) {
      const auto& known = options.forecast->parameters;
      const auto found = std::ranges::find(known, number.name, &ParameterEstimate::name);
      if (found == known.end())
        throw InputError("--forecast", "the fit holds no parameter '" + number.name + "'",
                         "a fit.json of the parameter set " + to_string(problem.spring_set));
      binding.constant = found->value;
    } else {
      const Range range = range_of(number, problem.spring_set, unit_n_per_m,
                                   flat_m[static_cast<size_t>(number.type)]);
      binding.parameter = problem.space.size();
      problem.space.parameters.push_back({.name = number.name,
                                          .unit = number.unit,
                                          .role = ParameterRole::springs,
                                          .scale = ParameterScale::logarithmic,
                                          .lower = range.lower,
                                          .upper = range.upper,
                                          .start = std::sqrt(range.lower * range.upper)});
    }
    problem.spring_numbers.push_back(binding);
  }
}

/// Adds an effect of the measurement. Its parameters are bound to `given` values, else to the fit.
void add_measurement_effect(const MeasurementEffectEntry& entry, const std::string& where,
                            const std::map<std::string, std::vector<double>>& given,
                            const FitOptions& options, FitProblem& problem) {
  FitProblem::MeasurementTerm term{
      .effect = entry.make(), .description = entry.describe(), .parameters = {}};
  if (const auto why = why_inapplicable(*term.effect, measurement_setting(problem)))
    throw InputError(where, term.description.name + ", and " + why->problem, why->expected);
  const std::map<std::string, double> values = by_parameter(term.description, where, given);
  for (const EffectParameter& parameter : term.description.parameters) {
    const auto value = values.find(parameter.name);
    if (value != values.end() || options.forecast) {
      // The measurement of another recording says nothing of this one.
      const double known = value != values.end() ? value->second : parameter.neutral;
      term.parameters.push_back({.parameter = -1, .constant = known});
      continue;
    }
    term.parameters.push_back({.parameter = problem.space.size(), .constant = 0});
    problem.space.parameters.push_back({.name = term.description.name + "." + parameter.name,
                                        .unit = parameter.unit,
                                        .role = ParameterRole::measurement,
                                        .scale = parameter.scale,
                                        .lower = parameter.lower,
                                        .upper = parameter.upper,
                                        .start = parameter.neutral,
                                        .typical = parameter.typical});
  }
  problem.measurement.push_back(std::move(term));
  const auto fitted =
      std::ranges::count(problem.space.parameters, ParameterRole::measurement, &FitParameter::role);
  if (fitted > kMeasurementParameters)
    throw InputError(where, fmt::format("{} parameters of the measurement would be fitted", fitted),
                     fmt::format("{} at most at once", kMeasurementParameters),
                     "declare values of some, or leave effects out");
}

/// Adds an effect to the cloth. Its parameters are bound to `given` values, else to the fit.
void add_effect(const std::string& name, const std::string& where,
                const std::map<std::string, std::vector<double>>& given, const FitOptions& options,
                FitProblem& problem) {
  require_effect(name, where);
  if (const MeasurementEffectEntry* entry = measurement_effect_named(name)) {
    if (options.forecast && where == "--effect")
      throw InputError("--effect " + name, "asked for in a forecast, which fits nothing",
                       "a value that the recording declares", "leave it out");
    return add_measurement_effect(*entry, where, given, options, problem);
  }
  add_effect(problem.cloth, name, where);
  const EffectDescription& description = problem.cloth.effect_descriptions.back();
  const std::map<std::string, double> values = by_parameter(description, where, given);
  std::vector<Binding> bindings;
  for (const EffectParameter& parameter : description.parameters) {
    Binding binding;
    const auto value = values.find(parameter.name);
    if (value != values.end()) {
      binding.constant = value->second;
    } else if (options.forecast) {
      throw InputError("--forecast", "the fit holds no value for " + name + "." + parameter.name,
                       "a forecast fits nothing", "fit with --effect " + name + " first");
    } else {
      binding.parameter = problem.space.size();
      problem.space.parameters.push_back({.name = name + "." + parameter.name,
                                          .unit = parameter.unit,
                                          .role = ParameterRole::effect,
                                          .scale = parameter.scale,
                                          .lower = parameter.lower,
                                          .upper = parameter.upper,
                                          .start = parameter.neutral + parameter.typical,
                                          .typical = parameter.typical});
    }
    bindings.push_back(binding);
  }
  problem.effects.push_back(std::move(bindings));
}

void add_effects(const Recording& recording, const FitOptions& options, FitProblem& problem) {
  std::vector<std::string> present;
  const auto absent = [&](const std::string& name) {
    return std::ranges::find(present, name) == present.end();
  };
  if (options.forecast) {
    for (const EffectEstimate& effect : options.forecast->effects) {
      std::map<std::string, std::vector<double>> given;
      for (const ParameterEstimate& parameter : effect.parameters)
        given[parameter.name] = {parameter.value};
      add_effect(effect.name, "--forecast", given, options, problem);
      present.push_back(effect.name);
    }
  }
  for (const DeclaredEffect& effect : effects_of(recording, options.hypotheses)) {
    if (!absent(effect.name)) continue;
    const std::string line = effect.line > 0 ? ":" + std::to_string(effect.line) : "";
    add_effect(effect.name, recording_file(recording) + line, effect.parameters, options, problem);
    present.push_back(effect.name);
  }
  for (const std::string& name : options.effects) {
    if (!absent(name)) continue;
    add_effect(name, "--effect", {}, options, problem);
    present.push_back(name);
  }
  add_derivative_weights(problem);
}

/// Adds two level directions and, where a camera's pose was estimated, gravity's direction as an
/// unknown. Its prior follows from that estimate. Only gravity's direction in the camera's axes
/// matters to a cloth that is placed by what the camera sees. All else of the pose moves the scene
/// as a whole. With true camera_from_world = exp(w) * estimate, gravity seen through the estimate
/// is turned by R' w in the world (R the estimated rotation).
void add_gravity_direction(FitProblem& problem) {
  const Eigen::Vector3d down = problem.gravity_m_per_s2.stableNormalized();
  const Eigen::Vector3d away =
      std::abs(down.x()) < 0.9 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
  problem.level_axes.col(0) = (away - away.dot(down) * down).normalized();
  problem.level_axes.col(1) = problem.level_axes.col(0).cross(down);

  const ObservationSet& first = problem.observations.front();
  if (!first.camera || !first.camera->camera_from_world->covariance) return;
  const Eigen::Matrix3d rotation = first.camera->camera_from_world->rotation.toRotationMatrix();
  const Eigen::Matrix<double, 2, 3> level = problem.level_axes.transpose() * rotation.transpose();
  const Eigen::Matrix2d covariance =
      level * first.camera->camera_from_world->covariance->topLeftCorner<3, 3>() *
      level.transpose();
  GaussianPrior prior{.indices = {}, .mean = Eigen::Vector2d::Zero(), .sqrt_information = {}};
  prior.sqrt_information = covariance.inverse().llt().matrixU();
  constexpr double kTypicalTilt = 1e-3;
  for (const char* name : {"world_tilt_a", "world_tilt_b"}) {
    prior.indices.push_back(problem.space.size());
    problem.tilt.push_back({.parameter = problem.space.size(), .constant = 0});
    problem.space.parameters.push_back({.name = name,
                                        .unit = "rad",
                                        .role = ParameterRole::placement,
                                        .scale = ParameterScale::linear,
                                        .lower = -0.2,
                                        .upper = 0.2,
                                        .start = 0,
                                        .typical = kTypicalTilt});
  }
  problem.priors.push_back(std::move(prior));
}

/// Fits a small turn of the placed sheet about its middle and a shift along. The sheet is as
/// uncertain as the first frame's markers are noisy, and its error would pass for physics. The
/// first frame's own residuals determine them.
void add_sheet_motion(FitProblem& problem) {
  if (problem.start != StartKind::released_flat) return;
  const auto add = [&](const char* name, const char* unit, double range) {
    problem.sheet_motion.push_back({.parameter = problem.space.size(), .constant = 0});
    problem.space.parameters.push_back({.name = name,
                                        .unit = unit,
                                        .role = ParameterRole::placement,
                                        .scale = ParameterScale::linear,
                                        .lower = -range,
                                        .upper = range,
                                        .start = 0,
                                        .typical = 1e-3});
  };
  for (const char* name : {"sheet_turn_x", "sheet_turn_y", "sheet_turn_z"}) add(name, "rad", 0.1);
  for (const char* name : {"sheet_shift_x", "sheet_shift_y", "sheet_shift_z"}) add(name, "m", 0.05);
}

/// Adds knowledge of parameters from elsewhere.
void add_given_priors(const FitOptions& options, FitProblem& problem) {
  std::vector<std::string> known;
  for (const FitParameter& parameter : problem.space.parameters)
    if (is_listed(parameter.role)) known.push_back(parameter.name);
  std::vector<std::string> told;
  for (const ParameterPrior& prior : options.priors) {
    const std::string where = "--prior " + prior.name;
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

void add_drive_correction(const std::vector<TrackedPoint>& tracked, const Recording& recording,
                          const FitOptions& options, FitProblem& problem) {
  if (options.drive_knots == 0) return;
  if (tracked.empty())
    throw InputError("--drive-knots",
                     "no held point of " + recording_file(recording) + " is tracked",
                     "a held point with motion: tracked",
                     "leave it out: fixed points and known paths have no noise");
  const auto last = static_cast<size_t>(problem.first_held_out - 1);
  problem.drive_correction =
      make_drive_correction(tracked, problem.frame_time_s.front(), problem.frame_time_s[last],
                            options.drive_knots, recording.markers, problem.space, problem.priors);
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

}  // namespace

void add_derivative_weights(FitProblem& problem) {
  const auto shifts_place = [](const FitProblem::MeasurementTerm& term) {
    return term.effect->shifts_place();
  };
  if (!problem.derivative_weights.empty()) return;
  if (std::ranges::none_of(problem.measurement, shifts_place)) return;
  const Mesh& mesh = problem.cloth.mesh;
  for (const SurfaceQuantity derivative : kSurfaceDerivatives)
    problem.derivative_weights.push_back(vertex_weights(
        make_surface(mesh.columns, mesh.rows, mesh.width_m, mesh.height_m, problem.marker_place_m,
                     SurfaceInterpolation::bicubic, derivative)));
}

FitProblem make_problem(const FitInput& input, const FitOptions& options, int mesh_columns,
                        int mesh_rows) {
  const Recording& recording = input.recording;
  FitProblem problem;
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
  problem.marker_place_m = marker_places(recording.markers);
  problem.vertex_weights = vertex_weights(
      make_surface(mesh.columns, mesh.rows, mesh.width_m, mesh.height_m, problem.marker_place_m));
  const Rigid3 world_from_sheet = place_sheet_of(recording, problem);
  add_springs(recording, options, problem);
  add_effects(recording, options, problem);
  if (!options.forecast) {
    add_gravity_direction(problem);
    add_sheet_motion(problem);
  }
  if (problem.start == StartKind::unknown) {
    if (options.forecast)
      throw InputError("--forecast", "the recording begins with the cloth in motion",
                       "a start that is known without a fit",
                       "fit the recording, or cut it so that it begins with the cloth at rest");
    problem.start_state = make_start_state(
        problem.observations, problem.marker_place_m, problem.frame_time_s, problem.first_held_out,
        mesh, world_from_sheet, {.nodes = options.start_nodes}, problem.space, problem.priors);
  }
  if (!options.forecast) add_drive_correction(drive.tracked, recording, options, problem);
  add_given_priors(options, problem);
  return problem;
}

MeasurementSetting measurement_setting(const FitProblem& problem) {
  return {.observations = problem.observations,
          .tracks_held_points = !problem.driving_markers.empty(),
          .limits_strain = problem.cloth.strain_limit.mode != StrainLimitMode::off};
}

}  // namespace clothfit
