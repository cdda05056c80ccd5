#include "data/fit_result.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <tuple>
#include <utility>

#include "data/finding_json.h"
#include "data/input_error.h"
#include "data/json_value.h"
#include "data/number_limits.h"
#include "data/read_json.h"
#include "data/reading.h"
#include "data/recording.h"
#include "data/text_file.h"

namespace clothfit {
namespace {

using Json = nlohmann::ordered_json;  // keys stay in the order of docs/formats.md

constexpr const char* kFormat = "clothfit-fit/1";
constexpr const char* kArealDensity = "areal_density";
constexpr const char* kExpectedFile = "a file of format clothfit-fit/1";
constexpr const char* kRemedy = "run `clothfit fit` again";

double finite(double value) {
  assert(std::isfinite(value));
  return value;
}

Json or_null(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

Json to_json(const ParameterEstimate& parameter) {
  Json json = {{"name", parameter.name},
               {"unit", parameter.unit},
               {"value", finite(parameter.value)},
               {"sigma", finite(parameter.sigma)},
               {"state", to_string(parameter.state)},
               {"reason", parameter.reason}};
  if (const auto& interval = parameter.interval_90)
    json["interval_90"] = {finite(interval->lower), finite(interval->upper)};
  if (parameter.interval_by_profile) json["interval_by_profile"] = true;
  if (const auto& interval = parameter.bootstrap_90)
    json["bootstrap_90"] = {finite(interval->lower), finite(interval->upper)};
  if (parameter.mesh_shift) json["mesh_shift"] = finite(*parameter.mesh_shift);
  return json;
}

Json to_json(const std::vector<ParameterEstimate>& parameters) {
  Json list = Json::array();
  for (const ParameterEstimate& parameter : parameters) list.push_back(to_json(parameter));
  return list;
}

Json to_json(const ErrorSummary& error) {
  return {{"rms", finite(error.rms)},
          {"rms_distance", finite(error.rms_distance)},
          {"count", error.count}};
}

Json to_json(const ObservationErrors& errors) {
  Json json = {{"kind", errors.kind},
               {"unit", errors.unit},
               {"fitted", to_json(errors.fitted)},
               {"held_out", to_json(errors.held_out)},
               {"noise", finite(errors.noise)},
               {"discretisation", finite(errors.discretisation)},
               {"discretisation_found", finite(errors.discretisation_found)},
               {"trivial",
                {{"first_frame", or_null(errors.trivial.first_frame)},
                 {"last_velocity", or_null(errors.trivial.last_velocity)},
                 {"rigid", or_null(errors.trivial.rigid)}}}};
  if (errors.outliers > 0) json["outliers"] = errors.outliers;
  if (errors.fitted_without) json["fitted_without"] = to_json(*errors.fitted_without);
  if (errors.held_out_without) json["held_out_without"] = to_json(*errors.held_out_without);
  return json;
}

Json to_json(const ContradictingMarker& marker) {
  return {{"marker", marker.marker},
          {"kind", marker.kind},
          {"frames", {marker.first_frame, marker.last_frame}},
          {"off", finite(marker.off)}};
}

Json to_json(const CloudErrors::Summary& clouds) {
  return {{"chamfer_m2", finite(clouds.chamfer_m2)}, {"frames", clouds.frames}};
}

Json to_json(const Basin& basin) {
  Json parameters = Json::object();
  for (const auto& [name, value] : basin.parameters) parameters[name] = finite(value);
  return {{"cost", finite(basin.cost)},
          {"ended", basin.ended},
          {"refined", basin.refined},
          {"parameters", parameters}};
}

/// Numbers of a fit beyond these are damaged, or slips in an exponent.
constexpr double kLargestNumber = 1e15;
/// Ends of intervals lie some sigmas beside a value.
constexpr double kFarthestEnd = 10 * kLargestNumber;
/// The masses per area (kg/m2) that a recording's limits of mass and size leave possible. Ratios
/// are multiplied or divided by it.
constexpr double kLightest_kg_per_m2 = 1e-12, kHeaviest_kg_per_m2 = 1e12;
constexpr int kMostSubsteps = 10'000'000;
constexpr double kLongestStep_s = 1e6;

std::pair<int, int> read_json_mesh(const JsonValue& json) {
  const int columns = json.at("columns").count(), rows = json.at("rows").count();
  if (!is_possible_mesh(columns, rows))
    json.refuse(fmt::format("is {} x {}", columns, rows),
                fmt::format("2 x 2 vertices at least, {} in all at most", kMostMeshVertices));
  return {columns, rows};
}

/// Reads an interval; nothing where there is no such key.
std::optional<Interval> read_interval(const JsonValue& json, const std::string& key) {
  if (!json.has(key)) return std::nullopt;
  const JsonValue list = json.at(key);
  const std::vector<JsonValue> ends = list.items();
  if (ends.size() != 2) list.refuse("is no interval", "two numbers");
  const Interval interval{.lower = ends[0].number_from(-kFarthestEnd, kFarthestEnd),
                          .upper = ends[1].number_from(-kFarthestEnd, kFarthestEnd)};
  if (interval.lower > interval.upper) list.refuse("is no interval", "the lower end first");
  return interval;
}

ParameterEstimate read_parameter(const JsonValue& json) {
  ParameterEstimate parameter;
  parameter.name = json.at("name").text();
  parameter.unit = json.at("unit").text();
  const bool density = parameter.name == kArealDensity;
  parameter.value = json.at("value").number_from(density ? kLightest_kg_per_m2 : -kLargestNumber,
                                                 density ? kHeaviest_kg_per_m2 : kLargestNumber);
  parameter.sigma = json.at("sigma").number_from(0, kLargestNumber);
  const JsonValue state = json.at("state");
  const std::string word = state.text();
  const std::vector<ParameterState> states = {ParameterState::fitted, ParameterState::fixed,
                                              ParameterState::undetermined, ParameterState::ratio,
                                              ParameterState::misfit};
  const auto found = std::find_if(states.begin(), states.end(),
                                  [&](ParameterState s) { return to_string(s) == word; });
  if (found == states.end())
    state.refuse("is `" + word + "`",
                 "`fitted`, `fixed`, `undetermined`, `ratio` or `model does not fit`");
  parameter.state = *found;
  parameter.reason = json.text_or_empty("reason");
  parameter.interval_90 = read_interval(json, "interval_90");
  parameter.interval_by_profile =
      json.has("interval_by_profile") && json.at("interval_by_profile").truth();
  parameter.bootstrap_90 = read_interval(json, "bootstrap_90");
  if (json.has("mesh_shift"))
    parameter.mesh_shift = json.at("mesh_shift").number_from(-kLargestNumber, kLargestNumber);
  return parameter;
}

std::vector<ParameterEstimate> read_parameters(const JsonValue& json) {
  std::vector<ParameterEstimate> parameters;
  for (const JsonValue& item : json.items()) parameters.push_back(read_parameter(item));
  return parameters;
}

ErrorSummary read_error(const JsonValue& json) {
  return {json.at("rms").number_from(0, kLargestNumber),
          json.at("rms_distance").number_from(0, kLargestNumber), json.at("count").count()};
}

ObservationErrors read_errors(const JsonValue& json) {
  ObservationErrors errors;
  errors.kind = json.text_or_empty("kind");
  errors.unit = json.at("unit").text();
  errors.fitted = read_error(json.at("fitted"));
  errors.held_out = read_error(json.at("held_out"));
  errors.noise = json.at("noise").number_from(0, kLargestNumber);
  if (json.has("discretisation"))
    errors.discretisation = json.at("discretisation").number_from(0, kLargestNumber);
  if (json.has("discretisation_found"))
    errors.discretisation_found = json.at("discretisation_found").number_from(0, kLargestNumber);
  if (json.has("outliers")) errors.outliers = json.at("outliers").count();
  if (json.has("fitted_without")) errors.fitted_without = read_error(json.at("fitted_without"));
  if (json.has("held_out_without"))
    errors.held_out_without = read_error(json.at("held_out_without"));
  const JsonValue trivial = json.at("trivial");
  errors.trivial.first_frame = trivial.at("first_frame").number_or_nan();
  errors.trivial.last_velocity = trivial.at("last_velocity").number_or_nan();
  errors.trivial.rigid = trivial.at("rigid").number_or_nan();
  return errors;
}

CloudErrors::Summary read_cloud_errors(const JsonValue& json) {
  return {.chamfer_m2 = json.at("chamfer_m2").number_from(0, kLargestNumber),
          .frames = json.at("frames").count()};
}

Eigen::Vector3d read_vector(const JsonValue& json) {
  const std::vector<JsonValue> numbers = json.items();
  if (numbers.size() != 3) json.refuse("is no vector", "three numbers");
  Eigen::Vector3d vector_m;
  for (size_t axis = 0; axis < 3; ++axis)
    vector_m[static_cast<Eigen::Index>(axis)] =
        numbers[axis].number_from(-kFarthest_m, kFarthest_m);
  return vector_m;
}

Basin read_basin(const JsonValue& json) {
  Basin basin;
  basin.cost = json.at("cost").number();
  basin.ended = json.at("ended").count();
  basin.refined = json.at("refined").truth();
  const JsonValue parameters = json.at("parameters");
  for (const std::string& name : parameters.keys())
    basin.parameters.push_back({.name = name, .value = parameters.at(name).number()});
  return basin;
}

FitVerdict read_verdict(const JsonValue& json) {
  for (const FitVerdict verdict : {FitVerdict::good, FitVerdict::usable_with_care,
                                   FitVerdict::model_lacks, FitVerdict::do_not_use})
    if (json.text() == to_string(verdict)) return verdict;
  json.refuse("is no verdict", "good, usable_with_care, model_lacks or do_not_use");
}

ContradictingMarker read_contradicting(const JsonValue& json) {
  const JsonValue list = json.at("frames");
  const std::vector<JsonValue> frames = list.items();
  if (frames.size() != 2) list.refuse("is no stretch of frames", "the first and the last");
  return {.marker = json.at("marker").text(),
          .kind = json.at("kind").text(),
          .first_frame = frames[0].count(),
          .last_frame = frames[1].count(),
          .off = json.at("off").number()};
}

Finding read_warning(const JsonValue& json) {
  return {.check = json.at("check").text(),
          .state = FindingState::warning,
          .found = json.at("found").text(),
          .where = json.text_or_empty("where"),
          .expected = json.text_or_empty("expected"),
          .remedy = json.text_or_empty("remedy")};
}

}  // namespace

std::string to_string(ParameterState state) {
  switch (state) {
    case ParameterState::fitted:
      return "fitted";
    case ParameterState::fixed:
      return "fixed";
    case ParameterState::undetermined:
      return "undetermined";
    case ParameterState::ratio:
      return "ratio";
    case ParameterState::misfit:
      return "model does not fit";
  }
  assert(false && "every state has a word");
  return {};
}

std::string to_string(FitVerdict verdict) {
  switch (verdict) {
    case FitVerdict::good:
      return "good";
    case FitVerdict::usable_with_care:
      return "usable_with_care";
    case FitVerdict::model_lacks:
      return "model_lacks";
    case FitVerdict::do_not_use:
      return "do_not_use";
  }
  assert(false && "every verdict has a word");
  return {};
}

int mass_exponent(const std::string& unit) {
  const auto starts = [&](const char* text) { return unit.starts_with(text); };
  if (starts("N") || starts("Pa") || starts("kg")) return 1;
  const bool is_compliance =
      unit.find("/N") != std::string::npos || unit.find("/(N") != std::string::npos;
  return is_compliance ? -1 : 0;
}

ParameterEstimate scaled(ParameterEstimate parameter, double factor) {
  const auto scale = [&](std::optional<Interval>& interval) {
    if (interval) interval = {.lower = factor * interval->lower, .upper = factor * interval->upper};
  };
  parameter.value *= factor;
  parameter.sigma *= factor;
  scale(parameter.interval_90);
  scale(parameter.bootstrap_90);
  if (parameter.mesh_shift) *parameter.mesh_shift *= factor;
  return parameter;
}

FitResult at_density(FitResult result, std::optional<double> areal_density) {
  const auto assumed =
      std::ranges::find(result.parameters, kArealDensity, &ParameterEstimate::name);
  if (assumed == result.parameters.end()) return result;
  const double density = areal_density.value_or(assumed->value);
  const auto turn = [&](ParameterEstimate& parameter) {
    for (const auto& [mark, factor] : {std::pair(std::string(kPerArealDensity), density),
                                       std::pair(std::string(kTimesArealDensity), 1 / density)}) {
      if (!parameter.unit.ends_with(mark)) continue;
      parameter = scaled(parameter, factor);
      parameter.unit.erase(parameter.unit.size() - mark.size());
    }
  };
  for (ParameterEstimate& parameter : result.parameters) turn(parameter);
  for (EffectEstimate& effect : result.effects)
    for (ParameterEstimate& parameter : effect.parameters) turn(parameter);
  return result;
}

void write_fit_result(const FitResult& result, const std::filesystem::path& file) {
  Json effects = Json::array();
  for (const EffectEstimate& effect : result.effects)
    effects.push_back({{"name", effect.name}, {"parameters", to_json(effect.parameters)}});
  Json errors = Json::array();
  for (const ObservationErrors& kind : result.errors) errors.push_back(to_json(kind));
  if (errors.size() == 1) errors = Json(errors.front());
  Json basins = Json::array();
  for (const Basin& basin : result.basins) basins.push_back(to_json(basin));
  Json offsets = Json::object();
  for (const MarkerOffset& offset : result.marker_offsets)
    offsets[offset.marker] = {finite(offset.offset_m.x()), finite(offset.offset_m.y()),
                              finite(offset.offset_m.z())};
  Json rejected = Json::object();
  for (const auto& [reason, count] : result.observations_rejected) rejected[reason] = count;

  Json contradicting = Json::array();
  for (const ContradictingMarker& marker : result.contradicting)
    contradicting.push_back(to_json(marker));
  Json warnings = Json::array();
  for (const Finding& warning : result.warnings) warnings.push_back(to_json(warning));

  Json json = {{"format", kFormat},
               {"verdict", to_string(result.verdict)},
               {"verdict_reason", result.verdict_reason},
               {"next_command", result.next_command},
               {"usable", result.usable()},
               {"converged", result.converged},
               {"contradicts_pose", result.contradicts_pose},
               {"warnings", warnings},
               {"contradicting_markers", contradicting},
               {"recording", result.recording},
               {"version", result.version},
               {"command", result.command},
               {"seed", result.seed},
               {"seconds", finite(result.seconds)},
               {"model",
                {{"mesh", {{"columns", result.mesh_columns}, {"rows", result.mesh_rows}}},
                 {"parameter_set", result.parameter_set},
                 {"integrator", result.integrator},
                 {"substeps", result.substeps},
                 {"time_step_s", finite(result.time_step_s)},
                 {"start", result.start}}},
               {"parameters", to_json(result.parameters)},
               {"effects", effects},
               {"nuisance", to_json(result.nuisance)},
               {"basins", basins},
               {"errors", errors},
               {"observations", {{"used", result.observations_used}, {"rejected", rejected}}}};
  if (!result.marker_offsets.empty())
    json["marker_offsets"] = {{"sigma_m", finite(result.marker_offset_sigma_m)},
                              {"offset_m", offsets}};
  if (result.clouds)
    json["clouds"] = {{"fitted", to_json(result.clouds->fitted)},
                      {"held_out", to_json(result.clouds->held_out)},
                      {"all", to_json(result.clouds->all)}};
  // A recording's name may hold bytes that are no UTF-8; JSON may not.
  write_text(json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n", file);
}

namespace {

FitResult parsed_fit_result(const std::filesystem::path& file) {
  const nlohmann::json parsed = read_json(file, kExpectedFile, kRemedy);
  const std::string name = file.string();
  const JsonFile named{name, kExpectedFile, kRemedy};
  const JsonValue json(parsed, named, "");
  const JsonValue format = json.at("format");
  if (format.text() != kFormat)
    format.refuse("is `" + format.text() + "`", std::string("`") + kFormat + "`");

  FitResult result;
  result.recording = json.at("recording").text();
  result.version = json.at("version").text();
  result.command = json.at("command").text();
  result.seed = json.at("seed").seed();
  result.seconds = json.at("seconds").number_from(0, kLargestNumber);
  const JsonValue model = json.at("model");
  std::tie(result.mesh_columns, result.mesh_rows) = read_json_mesh(model.at("mesh"));
  result.parameter_set = model.at("parameter_set").text();
  result.integrator = model.at("integrator").text();
  result.substeps = model.at("substeps").count_from(0, kMostSubsteps);
  if (model.has("time_step_s"))
    result.time_step_s = model.at("time_step_s").number_from(0, kLongestStep_s);
  result.start = model.at("start").text();
  result.parameters = read_parameters(json.at("parameters"));
  for (const JsonValue& effect : json.at("effects").items())
    result.effects.push_back({effect.at("name").text(), read_parameters(effect.at("parameters"))});
  if (json.has("nuisance")) result.nuisance = read_parameters(json.at("nuisance"));
  if (json.has("marker_offsets")) {
    const JsonValue offsets = json.at("marker_offsets");
    result.marker_offset_sigma_m = offsets.at("sigma_m").number_from(0, kLargestNumber);
    const JsonValue by_marker = offsets.at("offset_m");
    for (const std::string& marker : by_marker.keys())
      result.marker_offsets.push_back({marker, read_vector(by_marker.at(marker))});
  }
  if (json.has("basins"))
    for (const JsonValue& basin : json.at("basins").items())
      result.basins.push_back(read_basin(basin));
  if (json.has("verdict")) result.verdict = read_verdict(json.at("verdict"));
  result.verdict_reason = json.text_or_empty("verdict_reason");
  result.next_command = json.text_or_empty("next_command");
  if (json.has("converged")) result.converged = json.at("converged").truth();
  if (json.has("contradicts_pose")) result.contradicts_pose = json.at("contradicts_pose").truth();
  if (json.has("contradicting_markers"))
    for (const JsonValue& marker : json.at("contradicting_markers").items())
      result.contradicting.push_back(read_contradicting(marker));
  if (json.has("warnings"))
    for (const JsonValue& warning : json.at("warnings").items())
      result.warnings.push_back(read_warning(warning));
  const JsonValue errors = json.at("errors");
  if (errors.is_list())
    for (const JsonValue& kind : errors.items()) result.errors.push_back(read_errors(kind));
  else
    result.errors.push_back(read_errors(errors));
  if (json.has("clouds")) {
    const JsonValue clouds = json.at("clouds");
    result.clouds = CloudErrors{.fitted = read_cloud_errors(clouds.at("fitted")),
                                .held_out = read_cloud_errors(clouds.at("held_out")),
                                .all = read_cloud_errors(clouds.at("all"))};
  }
  const JsonValue observations = json.at("observations");
  result.observations_used = observations.at("used").count();
  const JsonValue rejected = observations.at("rejected");
  for (const std::string& reason : rejected.keys())
    result.observations_rejected[reason] = rejected.at(reason).count();
  return result;
}

}  // namespace

FitResult read_fit_result(const std::filesystem::path& file) {
  return reading(file, [&] { return parsed_fit_result(file); });
}

}  // namespace clothfit
