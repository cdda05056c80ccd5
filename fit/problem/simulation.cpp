#include "fit/problem/simulation.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "calib/camera/rigid3.h"
#include "data/input_error.h"
#include "fit/problem/cloth_setup.h"
#include "fit/problem/drive.h"
#include "fit/problem/parameterised_model.h"
#include "fit/problem/time_steps.h"
#include "model/cloth/stability.h"
#include "model/effects/registry.h"
#include "model/integrate/relax.h"

namespace clothfit {
namespace {

Fabric fabric_of(const std::map<std::string, double>& values) {
  return {.tension_warp_n_per_m = values.at("tension_warp"),
          .tension_weft_n_per_m = values.at("tension_weft"),
          .shear_n_per_m = values.at("shear"),
          .flexion_warp_n_per_m = values.at("flexion_warp"),
          .flexion_weft_n_per_m = values.at("flexion_weft"),
          .damping_warp_s = values.at("damping_warp"),
          .damping_weft_s = values.at("damping_weft")};
}

StrainLimitMode mode_of(StrainLimitKind kind) {
  switch (kind) {
    case StrainLimitKind::positions:
      return StrainLimitMode::positions;
    case StrainLimitKind::rates_first:
      return StrainLimitMode::rates_first;
    case StrainLimitKind::consistent:
      return StrainLimitMode::consistent;
    case StrainLimitKind::off:
      break;
  }
  return StrainLimitMode::off;
}

SpringParameters springs_of(const ModelSprings& springs) {
  return {.natural_length_m = springs.natural_length_m,
          .stiffness_n_per_m = springs.stiffness_n_per_m,
          .damping_ns_per_m = springs.damping_ns_per_m,
          .critical_elongation = springs.critical_elongation.value_or(SpringParameters::kNoLimit)};
}

/// Returns the pose of a flat sheet from three of its corners.
SheetPose pose_of(const Mesh& mesh, const Eigen::Matrix3Xd& position_m) {
  const Eigen::Vector3d corner = position_m.col(mesh.vertex(0, 0));
  const Eigen::Vector3d along_s =
      (position_m.col(mesh.vertex(0, mesh.columns - 1)) - corner).normalized();
  const Eigen::Vector3d along_t =
      (position_m.col(mesh.vertex(mesh.rows - 1, 0)) - corner).normalized();
  Eigen::Matrix3d axes;
  axes << along_s, along_t, along_s.cross(along_t);
  return {.position_m = corner, .orientation = Eigen::Quaterniond(axes).normalized()};
}

/// Samples a held point's motion with its correction, at the frames and at the correction's knots.
/// The smoothing spline of a tracked point and a correction are together a natural cubic spline.
/// The spline through its values at its knots restores it.
HeldPath sample(const FitProblem& problem, const ParameterSet& set, size_t held) {
  HeldPath path{.time_s = corrected_times(problem.drive_correction, problem.frame_time_s),
                .position_m = {}};
  for (const double t : path.time_s)
    path.position_m.push_back(shifted(problem.cloth.held[held].motion(t), set, held, t));
  return path;
}

/// Throws for a parameter on the side of its neutral value where fits do not look. It has no
/// meaning there: a drag below 0 would drive the cloth.
void require_possible(const std::string& effect, const EffectParameter& parameter, double value,
                      const std::string& where) {
  if (parameter.lower < parameter.neutral || value >= parameter.neutral) return;
  throw InputError(where, fmt::format("{}.{} = {}", effect, parameter.name, value),
                   fmt::format("{} or more ({})", parameter.neutral, parameter.unit));
}

/// Adds stiffness, and damping where none is given, to the numbers of a contact.
void add_default_contact(const ModelDescription& model, const std::string& effect,
                         std::map<std::string, double>& numbers,
                         std::vector<std::string>& assumed) {
  constexpr double kSinksIn_m = 1e-4;
  constexpr double kOfCritical = 1.0 / 3;
  const double density = *model.cloth.mass_kg / (model.cloth.width_m * model.cloth.height_m);
  const double gravity = std::max(model.gravity_m_per_s2.norm(), 1.0);
  const double stiffness = density * gravity / kSinksIn_m;
  numbers["stiffness"] = stiffness;
  numbers.emplace("damping", kOfCritical * 2 * std::sqrt(stiffness * density));
  assumed.push_back(
      fmt::format("{} has no stiffness: {:.3g} Pa/m is taken, with a damping of {:.3g} Pa s/m",
                  effect, stiffness, numbers.at("damping")));
}

}  // namespace

std::map<std::string, double> named(const Fabric& fabric) {
  return {{"tension_warp", fabric.tension_warp_n_per_m},
          {"tension_weft", fabric.tension_weft_n_per_m},
          {"shear", fabric.shear_n_per_m},
          {"flexion_warp", fabric.flexion_warp_n_per_m},
          {"flexion_weft", fabric.flexion_weft_n_per_m},
          {"damping_warp", fabric.damping_warp_s},
          {"damping_weft", fabric.damping_weft_s}};
}

ModelSprings springs_of(const SpringParameters& springs) {
  ModelSprings result{.natural_length_m = springs.natural_length_m,
                      .stiffness_n_per_m = springs.stiffness_n_per_m,
                      .damping_ns_per_m = springs.damping_ns_per_m};
  if (std::ranges::all_of(springs.critical_elongation, [](double x) { return std::isfinite(x); }))
    result.critical_elongation = springs.critical_elongation;
  return result;
}

Simulation make_simulation(const ModelDescription& model) {
  Simulation simulation;
  const Mesh mesh{model.mesh_columns, model.mesh_rows, model.cloth.width_m, model.cloth.height_m};
  Cloth& cloth = simulation.cloth;
  cloth = make_cloth(model.cloth, mesh, model.cloth.mass_kg.value());
  cloth.strain_limit.mode = mode_of(model.strain_limit);
  cloth.obstacle = make_obstacle(model.obstacle);
  for (const ModelHeldPoint& held : model.held) {
    const bool has_path = held.point.motion == HeldMotion::path;
    hold(held.point, has_path ? &held.path : nullptr, mesh, model.where(0), cloth.held);
  }

  ParameterSet& set = simulation.parameters;
  if (model.springs) {
    set.springs = springs_of(*model.springs);
  } else {
    simulation.fabric = fabric_of(model.fabric);
    set.springs = spring_parameters(*simulation.fabric, mesh);
    if (model.strain_limit != StrainLimitKind::off)
      set.springs.critical_elongation.fill(model.critical_elongation);
  }
  set.gravity_m_per_s2 = model.gravity_m_per_s2;
  for (const DeclaredEffect& effect : model.effects) {
    const std::string where = model.where(effect.line);
    add_effect(cloth, effect.name, where);
    const EffectDescription& description = cloth.effect_descriptions.back();
    const std::map<std::string, double> given = by_parameter(description, where, effect.parameters);
    std::map<std::string, double> all = given;
    if (effect.name.starts_with("contact_") && !given.contains("stiffness"))
      add_default_contact(model, effect.name, all, simulation.assumed);
    std::vector<double> numbers;
    for (const EffectParameter& parameter : description.parameters) {
      const auto value = all.find(parameter.name);
      if (value != all.end()) require_possible(effect.name, parameter, value->second, where);
      numbers.push_back(value != all.end() ? value->second : parameter.neutral);
    }
    set.effects.push_back(std::move(numbers));
  }
  if (model.start_state) {
    set.start_position_m = model.start_state->position_m;
    set.start_velocity_m_per_s = model.start_state->velocity_m_per_s;
  } else {
    const Rigid3 world_from_sheet{model.sheet.orientation, model.sheet.position_m};
    const Eigen::Matrix3Xd flat = flat_positions(mesh);
    set.start_position_m.resize(3, flat.cols());
    for (Eigen::Index v = 0; v < flat.cols(); ++v)
      set.start_position_m.col(v) = world_from_sheet * Eigen::Vector3d(flat.col(v));
  }
  simulation.start = model.start;
  simulation.frame_time_s = model.frame_time_s;
  return simulation;
}

ModelDescription describe_model(const FitProblem& problem, const Recording& recording,
                                const Eigen::VectorXd& values) {
  const ParameterSet set = parameter_set(problem, values);
  const Mesh& mesh = problem.cloth.mesh;
  ModelDescription model;
  model.name = recording.name;
  model.cloth = recording.cloth;
  model.cloth.mass_kg = problem.cloth_mass_kg;
  model.mesh_columns = mesh.columns;
  model.mesh_rows = mesh.rows;
  if (problem.spring_set == SpringSet::fabric) {
    model.fabric = named(fabric_of(problem, values));
  } else {
    model.springs = springs_of(set.springs);
    model.strain_limit = StrainLimitKind::positions;
  }
  model.gravity_m_per_s2 = set.gravity_m_per_s2;
  model.obstacle = recording.obstacle;

  size_t next = 0;  // an edge stands for a vertex each in problem.cloth.held
  for (const HeldPoint& point : recording.held) {
    ModelHeldPoint held{.point = point, .path = {}};
    held.point.file.reset();
    if (point.motion == HeldMotion::path) held.path = read_held_path(*point.file);
    if (point.motion == HeldMotion::tracked) held.path = sample(problem, set, next);
    if (point.motion != HeldMotion::fixed) held.point.motion = HeldMotion::path;
    model.held.push_back(std::move(held));
    const bool along_s = point.edge == ClothEdge::top || point.edge == ClothEdge::bottom;
    next += point.edge ? static_cast<size_t>(along_s ? mesh.columns : mesh.rows) : 1;
  }
  for (size_t e = 0; e < set.effects.size(); ++e) {
    const EffectDescription& description = problem.cloth.effect_descriptions[e];
    DeclaredEffect effect{.name = description.name, .parameters = {}};
    for (size_t p = 0; p < description.parameters.size(); ++p)
      effect.parameters[description.parameters[p].name] = {set.effects[e][p]};
    model.effects.push_back(std::move(effect));
  }
  model.start = problem.start;
  if (problem.start == StartKind::unknown) {
    model.start_state = ModelStartState{.position_m = set.start_position_m,
                                        .velocity_m_per_s = set.start_velocity_m_per_s};
  } else {
    model.sheet = pose_of(mesh, set.start_position_m);
  }
  model.frame_time_s = problem.frame_time_s;
  model.frame_rate_hz = recording.frame_rate_hz;
  return model;
}

double default_time_step_s(const Simulation& simulation) {
  const double longest_s = simulation.frame_time_s.back() - simulation.frame_time_s.front();
  const double stable_s = stable_time_step_s(simulation.cloth, simulation.parameters);
  return std::min(stable_s / kStabilityMargin, longest_s);
}

ParameterSet started(const Simulation& simulation, double time_step_s, const StopCheck& stop) {
  ParameterSet set = simulation.parameters;
  if (simulation.start == StartKind::at_rest)
    start_at_rest(simulation.cloth, {&set, 1}, set.gravity_m_per_s2.norm(),
                  simulation.frame_time_s.front(),
                  time_steps_of_run(simulation.cloth, set, time_step_s).rest_s, stop);
  return set;
}

SimulateResult run(const Simulation& simulation, double time_step_s,
                   const ProgressCallback& progress, const StopCheck& stop) {
  const ParameterSet set = started(simulation, time_step_s, stop);
  const Schedule schedule{.frame_time_s = simulation.frame_time_s, .time_step_s = time_step_s};
  const auto after_frame = [&](int frame) {
    return !progress || progress({.stage = "simulate",
                                  .done = static_cast<double>(frame),
                                  .total = static_cast<double>(schedule.frame_time_s.size() - 1),
                                  .unit = "frames",
                                  .note = ""});
  };
  return std::move(
      simulate(simulation.cloth, {&set, 1}, schedule, Precision::exact, after_frame, stop).front());
}

}  // namespace clothfit
