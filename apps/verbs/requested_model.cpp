#include "apps/verbs/requested_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/steps/steps.h"
#include "apps/verbs/verb.h"
#include "data/fit_result.h"
#include "data/input_error.h"
#include "data/nearest_name.h"
#include "data/number_text.h"
#include "fit/measurement_effects/registry.h"
#include "fit/problem/cloth_setup.h"
#include "fit/problem/problem.h"
#include "fit/problem/simulation.h"
#include "model/effects/registry.h"
#include "model/fabric/spring_vector.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

constexpr const char* kModelFile = "model.yaml";
constexpr const char* kHowToGive = "--fit FIT.json, --model MODEL.yaml or --set NAME=NUMBER";

/// Parameters that somebody gave.
struct GivenParameters {
  std::optional<SpringSet> set = SpringSet::fabric;  ///< nothing: springs without such parameters
  std::map<std::string, double> springs;             ///< parameters of the set, by name
  std::vector<DeclaredEffect> effects = {};
};

std::vector<std::string> names_of(SpringSet set) {
  std::vector<std::string> names;
  for (const SpringNumber& number : numbers_of(set)) names.push_back(number.name);
  return names;
}

DeclaredEffect& effect_named(const std::string& name, std::vector<DeclaredEffect>& effects) {
  const auto found = std::ranges::find(effects, name, &DeclaredEffect::name);
  if (found != effects.end()) return *found;
  effects.push_back({.name = name, .parameters = {}});
  return effects.back();
}

fs::path fit_file(const fs::path& given) {
  std::error_code error;
  return fs::is_directory(given, error) ? given / "fit.json" : given;
}

GivenParameters parameters_of_fit(const fs::path& fit) {
  const FitResult result = at_density(read_fit_result(fit_file(fit)), std::nullopt);
  GivenParameters given{.set = spring_set_named(result.parameter_set), .springs = {}};
  if (!given.set)
    throw InputError(fit_file(fit).string(),
                     "has the unknown parameter set '" + result.parameter_set + "'",
                     "fabric, louchet5 or louchet18");
  const std::vector<std::string> names = names_of(*given.set);
  for (const ParameterEstimate& parameter : result.parameters)
    if (std::ranges::find(names, parameter.name) != names.end())
      given.springs[parameter.name] = parameter.value;
  for (const EffectEstimate& estimate : result.effects) {
    DeclaredEffect& effect = effect_named(estimate.name, given.effects);
    for (const ParameterEstimate& parameter : estimate.parameters)
      effect.parameters[parameter.name] = {parameter.value};
  }
  return given;
}

/// Sets a parameter. Throws for texts that a model file cannot express; the range of an effect's
/// number is checked when the simulation is made.
void set_parameter(const std::string& text, GivenParameters& given) {
  const auto [name, value] = parse_assignment(text).value();
  const size_t dot = name.find('.');
  if (dot != std::string::npos) {
    const std::string effect = name.substr(0, dot);
    const std::string parameter = name.substr(dot + 1);
    if (measurement_effect_named(effect) != nullptr)
      throw InputError("--set " + text, effect + " is an effect of the measurement",
                       "a parameter of what moves: a simulation is not measured");
    by_parameter(find_effect(effect, "--set " + text).describe(), "--set " + text,
                 {{parameter, {value}}});
    effect_named(effect, given.effects).parameters[parameter] = {value};
    return;
  }
  if (!given.set)
    throw InputError("--set " + text, "the model has its springs type by type, not by parameters",
                     "a model with a fabric, or --fit", "edit the model file");
  const std::vector<std::string> known = names_of(*given.set);
  if (std::ranges::find(known, name) == known.end())
    throw InputError("--set " + text, "there is no parameter '" + name + "'",
                     known_names(name, known),
                     "an effect's is set as --set EFFECT.PARAMETER=NUMBER");
  given.springs[name] = value;
}

void add(const GivenParameters& more, GivenParameters& given) {
  if (!more.springs.empty() && more.set != given.set) {
    given.set = more.set;
    given.springs.clear();
  }
  for (const auto& [name, value] : more.springs) given.springs[name] = value;
  for (const DeclaredEffect& effect : more.effects) {
    DeclaredEffect& known = effect_named(effect.name, given.effects);
    for (const auto& [name, values] : effect.parameters) known.parameters[name] = values;
    if (effect.line > 0) known.line = effect.line;
  }
}

/// Returns the options' parameters, in front of the input's own.
GivenParameters given_parameters(const ModelRequest& request, GivenParameters given = {}) {
  if (!request.fit.empty()) add(parameters_of_fit(request.fit), given);
  if (!request.model.empty()) {
    ModelDescription model = read_model(request.model);
    if (model.springs)
      throw InputError(request.model.string(), "has springs type by type instead of a fabric",
                       "a model file with a fabric", "simulate that model itself");
    for (DeclaredEffect& effect : model.effects) effect.line = 0;  // lines refer to another file
    add({SpringSet::fabric, model.fabric, model.effects}, given);
  }
  for (const std::string& assignment : request.set) set_parameter(assignment, given);
  return given;
}

/// Returns the model file that a path means: the path itself, or the one in that folder.
std::optional<fs::path> model_file(const fs::path& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) {
    const fs::path inside = path / kModelFile;
    return fs::exists(inside, error) ? std::optional(inside) : std::nullopt;
  }
  const bool is_recording = path.filename() == "recording.yaml";
  return fs::exists(path, error) && !is_recording ? std::optional(path) : std::nullopt;
}

ModelDescription model_of_fit(const fs::path& fit) {
  const fs::path file = fit_file(fit);
  read_fit_result(file);  // throws for a file that is no fit
  const fs::path model = file.parent_path() / kModelFile;
  if (!fs::exists(model))
    throw InputError(file.string(), "no model.yaml lies beside it",
                     "the result folder of a fit, with the model that was found",
                     "run `clothfit fit` again, or name the recording: "
                     "clothfit simulate RECORDING --fit " +
                         file.string());
  return read_model(model);
}

/// Returns a recording's parameters with the given ones in front; throws for what is still missing.
FitResult complete_parameters(const Recording& recording, GivenParameters given) {
  const std::string file = (recording.folder / "recording.yaml").string();
  std::string missing;
  FitResult result;
  for (const std::string& name : names_of(given.set.value())) {
    const auto found = given.springs.find(name);
    if (found == given.springs.end())
      missing += (missing.empty() ? "" : ", ") + name;
    else
      result.parameters.push_back({.name = name, .value = found->second});
  }
  result.parameter_set = to_string(*given.set);
  if (!missing.empty())
    throw InputError(file, "a recording has no parameters, and nobody gave " + missing,
                     "a number for each parameter of the fabric", kHowToGive);
  // Declared parameters serve where the options say nothing else.
  GivenParameters all;
  all.effects = recording.declared;
  // The measurement changes nothing in the motion.
  std::erase_if(all.effects, [&](const DeclaredEffect& effect) {
    const MeasurementEffectEntry* entry = measurement_effect_named(effect.name);
    if (entry == nullptr) return false;
    by_parameter(entry->describe(), fmt::format("{}:{}", file, effect.line), effect.parameters);
    return true;
  });
  for (DeclaredEffect& effect : all.effects) {
    const std::string where = fmt::format("{}:{}", file, effect.line);
    const auto numbers =
        by_parameter(find_effect(effect.name, where).describe(), where, effect.parameters);
    effect.parameters.clear();
    for (const auto& [name, number] : numbers) effect.parameters[name] = {number};
  }
  add(given, all);
  for (const DeclaredEffect& effect : all.effects) {
    EffectEstimate estimate{.name = effect.name, .parameters = {}};
    const bool declared = effect.line > 0;
    for (const EffectParameter& parameter :
         find_effect(effect.name, "--fit").describe().parameters) {
      const auto found = effect.parameters.find(parameter.name);
      if (found == effect.parameters.end() && declared && !parameter.picks)
        throw InputError(
            file, effect.line,
            fmt::format("{}.{} is left to a fit, and nobody gave it", effect.name, parameter.name),
            "a number for each parameter of a declared effect", kHowToGive);
      estimate.parameters.push_back(
          {.name = parameter.name,
           .value = found != effect.parameters.end() ? found->second.front() : parameter.neutral});
    }
    result.effects.push_back(std::move(estimate));
  }
  return result;
}

InputError other_mesh() {
  return {"--mesh", "natural lengths, and starts in motion, are those of one mesh",
          "the model's own mesh", "leave --mesh out"};
}

ModelDescription model_of_recording(const ModelRequest& request, const fs::path& steps,
                                    const ProgressCallback& progress) {
  const Recording given = typed_recording(request.input, request.allow_outside);
  FitOptions options;
  options.forecast = complete_parameters(given, given_parameters(request));
  options.spring_set = spring_set_named(options.forecast->parameter_set).value();
  if (!given.tracks3d && given.tracks2d.empty() && given.cameras.empty())
    throw InputError((given.folder / "recording.yaml").string(),
                     "has no tracks, so nothing says where the cloth starts",
                     "tracks3d or tracks2d whose first frame shows the sheet",
                     "write a model file, which says where the sheet lies: docs/formats.md");
  const Recording recording =
      complete_recording(given, ObservationKind::automatic, {}, steps, progress).recording;
  const FitInput input = read_fit_input(recording, ObservationKind::automatic);
  GridSize mesh{recording.cloth.mesh_columns, recording.cloth.mesh_rows};
  if (!request.fit.empty()) {  // a fit's stiffness belongs to the mesh that it was found on
    const FitResult fit = read_fit_result(fit_file(request.fit));
    mesh = {fit.mesh_columns, fit.mesh_rows};
  }
  if (request.mesh && *request.mesh != mesh && options.spring_set != SpringSet::fabric)
    throw other_mesh();
  if (request.mesh) mesh = *request.mesh;
  const FitProblem problem = make_problem(input, options, mesh.columns, mesh.rows);
  return describe_model(problem, recording, problem.space.start());
}

void set_frames(const ModelRequest& request, ModelDescription& model) {
  if (!request.duration_s && !request.frame_rate_hz) return;
  const std::optional<double> rate_hz =
      request.frame_rate_hz ? request.frame_rate_hz : model.frame_rate_hz;
  if (!rate_hz)
    throw InputError("--duration", "the frames of this model are not evenly spaced",
                     "--frame-rate beside it");
  const double duration_s = request.duration_s.value_or(model.frame_time_s.back());
  const auto times = frame_times(*rate_hz, duration_s);
  if (!times)
    throw InputError("--duration",
                     fmt::format("{} s at {} frames per second", duration_s, *rate_hz),
                     fmt::format("1 to {} frame intervals", kMostModelFrames - 1));
  model.frame_rate_hz = rate_hz;
  model.frame_time_s = *times;
}

/// Replaces the model's springs by the parameters.
void set_springs(const GivenParameters& given, ModelDescription& model) {
  if (!given.set) return;
  const std::vector<std::string> names = names_of(*given.set);
  Eigen::VectorXd numbers(static_cast<Eigen::Index>(names.size()));
  for (size_t n = 0; n < names.size(); ++n) {
    const auto found = given.springs.find(names[n]);
    if (found == given.springs.end())
      throw InputError("--fit", "the fit holds no parameter '" + names[n] + "'",
                       "each of the set " + to_string(*given.set));
    numbers[static_cast<Eigen::Index>(n)] = found->second;
  }
  if (*given.set == SpringSet::fabric) {
    if (model.springs) model.strain_limit = StrainLimitKind::off;  // it was the springs' limit
    model.springs.reset();
    model.fabric = given.springs;
    return;
  }
  const Mesh mesh{model.mesh_columns, model.mesh_rows, model.cloth.width_m, model.cloth.height_m};
  const SpringParameters springs = springs_of(*given.set, numbers, mesh);
  require_possible(springs, "--fit");
  model.springs = springs_of(springs);
  model.fabric.clear();
  model.strain_limit = StrainLimitKind::positions;  // as in the fits of these sets
}

void require_possible_fabric(const std::map<std::string, double>& fabric) {
  double stiffest = 0;
  for (const FabricParameterName& parameter : kFabricParameters) {
    const double value = fabric.at(parameter.name);
    if (!(value >= 0) || !std::isfinite(value))
      throw InputError(parameter.name, fmt::format("{} {}", value, parameter.unit), "0 or more",
                       "correct the fit or the --set that gives it");
    if (std::string_view(parameter.unit) == "N/m") stiffest = std::max(stiffest, value);
  }
  if (stiffest == 0)
    throw InputError("--set", "every stiffness is 0",
                     "springs: at least one of tension, shear and flexion above 0");
}

}  // namespace

std::optional<std::pair<std::string, double>> parse_assignment(const std::string& text) {
  const size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) return std::nullopt;
  const std::optional<double> value = parse_number(std::string_view(text).substr(equals + 1));
  if (!value) return std::nullopt;
  return std::pair(text.substr(0, equals), *value);
}

std::string requested_name(const ModelRequest& request) {
  if (request.input.empty() && request.fit.empty())
    throw InputError("clothfit simulate", "there is nothing to simulate",
                     "a recording, a model file, or --fit", "see clothfit simulate --help");
  if (request.input.empty()) return model_of_fit(request.fit).name;
  const std::optional<fs::path> file = model_file(request.input);
  return file ? read_model(*file, outside_files(request.allow_outside)).name
              : typed_recording(request.input, request.allow_outside).name;
}

ModelDescription requested_model(const ModelRequest& request, const fs::path& steps,
                                 const ProgressCallback& progress) {
  ModelDescription model;
  const std::optional<fs::path> file = model_file(request.input);
  if (!request.input.empty() && !file) {
    model = model_of_recording(request, steps, progress);
  } else {
    model =
        file ? read_model(*file, outside_files(request.allow_outside)) : model_of_fit(request.fit);
    GivenParameters own{SpringSet::fabric, model.fabric, model.effects};
    if (model.springs) {
      own.set.reset();
      if (!file && !request.set.empty()) own = parameters_of_fit(request.fit);
      own.effects = model.effects;
    }
    ModelRequest options = request;
    if (!file) options.fit.clear();  // its model holds them already
    const GivenParameters all = given_parameters(options, std::move(own));
    set_springs(all, model);
    model.effects = all.effects;
    const bool of_one_mesh = model.springs || model.start_state;
    if (request.mesh && of_one_mesh &&
        *request.mesh != GridSize{model.mesh_columns, model.mesh_rows})
      throw other_mesh();
    // A step was chosen for the springs and the mesh that it stands beside.
    const bool changed =
        request.mesh || !request.set.empty() || !options.fit.empty() || !request.model.empty();
    if (changed) model.time_step_s.reset();
    if (request.mesh) {
      model.mesh_columns = request.mesh->columns;
      model.mesh_rows = request.mesh->rows;
    }
  }
  if (!model.springs) require_possible_fabric(model.fabric);
  set_frames(request, model);
  return model;
}

}  // namespace clothfit
