#include "apps/study/foreign/foreign_truth.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "data/input_error.h"

namespace clothfit {
namespace {

using Json = nlohmann::ordered_json;

/// This table translates kinds of hidden effects in truth.json to the catalogue's names. An effect
/// accepted under one of these names, or alike to one, is right about the hidden one.
const std::vector<HiddenTruth> kKinds{
    {.kind = "air_drag", .answers = {"viscous_damping"}},
    {.kind = "contact/sphere", .answers = {"contact_sphere"}},
    {.kind = "gravity_tilted", .answers = {"gravity_tilt", "world_tilt"}},
    {.kind = "gust", .answers = {"gust", "wind_*"}},
    {.kind = "heavy_hem", .answers = {"nonuniform_mass"}},
    {.kind = "held_corner_moves", .answers = {"support_*"}},
    {.kind = "stiff_patch", .answers = {"nonuniform_stiffness"}},
    {.kind = "wind", .answers = {"wind"}},
};

/// These effects belong to the cloth itself.
const std::vector<std::string> kInside{"anisotropy",     "bending_energy",  "hysteresis",
                                       "natural_size",   "nonuniform_mass", "nonuniform_stiffness",
                                       "relaxation",     "rest_curvature",  "self_contact",
                                       "spring_damping", "stiffening",      "tension_law"};

HiddenTruth hidden_of(const Json& json, const std::string& where) {
  std::string kind = json.at("effect");
  if (json.contains("body")) kind += "/" + json.at("body").get<std::string>();
  const auto known = std::ranges::find(kKinds, kind, &HiddenTruth::kind);
  if (known != kKinds.end()) return *known;
  std::vector<std::string> kinds;
  for (const HiddenTruth& one : kKinds) kinds.push_back(one.kind);
  throw InputError(where, "hides '" + kind + "', a kind that the study does not know",
                   fmt::format("one of {}", fmt::join(kinds, ", ")));
}

/// Says whether springs push as they pull, without hinges: the model's law.
bool is_model_law(const Json& springs) {
  for (const auto& [name, value] : springs.items()) {
    if (name.ends_with("_tension_only") && !value.is_null()) return false;
    const bool none = value.is_null() || (value.is_number() && value.get<double>() == 0);
    if (name == "hinge_bending" && !none) return false;
  }
  return true;
}

/// Returns the floor in `unit`, which truth.json states in mm and px; NaN where there is none.
double floor_of(const Json& truth, const std::string& unit) {
  const Json::json_pointer place("/step_size_floor/" + unit + "/rms_last_30_percent");
  return truth.contains(place) ? truth.at(place).get<double>()
                               : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

std::string to_string(TruthKind kind) {
  switch (kind) {
    case TruthKind::hidden_effects:
      return "hidden effects";
    case TruthKind::nothing_hidden:
      return "nothing hidden";
    case TruthKind::foreign_law:
      return "foreign law";
  }
  return "";
}

bool HiddenTruth::is_answered_by(const std::string& effect) const {
  return std::ranges::any_of(answers, [&](const std::string& answer) {
    return answer.ends_with('*') ? effect.starts_with(answer.substr(0, answer.size() - 1))
                                 : effect == answer;
  });
}

std::string HiddenTruth::title() const {
  return fmt::format("{}", fmt::join(answers, " or "));
}

TruthKind ForeignTruth::kind() const {
  if (!hidden.empty()) return TruthKind::hidden_effects;
  return foreign_law ? TruthKind::foreign_law : TruthKind::nothing_hidden;
}

ForeignTruth parse_foreign_truth(const std::string& text, const std::string& where) {
  ForeignTruth truth;
  try {
    const Json json = Json::parse(text);
    for (const Json& hidden : json.at("hidden_effects"))
      truth.hidden.push_back(hidden_of(hidden, where));
    truth.foreign_law = !is_model_law(json.at("springs"));
    truth.floor_m = 1e-3 * floor_of(json, "mm");
    truth.floor_px = floor_of(json, "px");
  } catch (const Json::exception& error) {
    throw InputError(where, fmt::format("is no truth of a recording: {}", error.what()),
                     "JSON with hidden_effects and springs");
  }
  return truth;
}

bool is_inside_cloth(const std::string& effect) {
  return std::ranges::find(kInside, effect) != kInside.end();
}

}  // namespace clothfit
