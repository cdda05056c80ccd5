#include "apps/study/trials/undeclared_json.h"

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "apps/study/trials/json_number.h"

namespace clothfit {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(const HiddenInTrial& hidden) {
  Json json{{"effect", hidden.mode.effect}, {"law", hidden.mode.mode},
            {"shape", hidden.shape},        {"sigmas", hidden.sigmas},
            {"right", hidden.right},        {"named", hidden.named},
            {"found", Json::array()},       {"ratio", json_number(hidden.amplitude_ratio)}};
  for (const FoundAmplitude& found : hidden.found)
    json["found"].push_back({found.name, json_number(found.truth), json_number(found.estimate),
                             json_number(found.sigma)});
  return json;
}

HiddenInTrial hidden_of(const Json& json) {
  HiddenInTrial hidden{.mode = {json.at("effect"), json.at("law")},
                       .shape = json.at("shape").get<std::map<std::string, double>>(),
                       .sigmas = json.at("sigmas"),
                       .right = json.at("right").get<std::vector<std::string>>(),
                       .named = json.at("named"),
                       .found = {},
                       .amplitude_ratio = number_of_json(json.at("ratio"))};
  for (const Json& found : json.at("found"))
    hidden.found.push_back({.name = found.at(0),
                            .truth = number_of_json(found.at(1)),
                            .estimate = number_of_json(found.at(2)),
                            .sigma = number_of_json(found.at(3))});
  return hidden;
}

}  // namespace

std::string payload_of(const UndeclaredTrial& trial) {
  Json json{{"refused", trial.refused},
            {"hidden", Json::array()},
            {"mimicked", json_number(trial.mimicked)},
            {"stop", static_cast<int>(trial.stop)},
            {"message", trial.message},
            {"verdict", static_cast<int>(trial.verdict)},
            {"accepted", trial.accepted},
            {"accepted_effects", trial.accepted_effects}};
  for (const HiddenInTrial& hidden : trial.hidden) json["hidden"].push_back(json_of(hidden));
  for (const double error : {trial.before, trial.after, trial.with_truth, trial.noise,
                             trial.before_fitted, trial.after_fitted, trial.with_law})
    json["errors"].push_back(json_number(error));
  json["seconds"] = {trial.drawing_seconds, trial.seconds};
  return json.dump();
}

UndeclaredTrial undeclared_trial_of(const std::string& payload) {
  const Json json = Json::parse(payload);
  const Json& errors = json.at("errors");
  UndeclaredTrial trial{
      .refused = json.at("refused"),
      .hidden = {},
      .mimicked = number_of_json(json.at("mimicked")),
      .stop = choice_of_json(json.at("stop"), FitStop::diverged),
      .message = json.at("message"),
      .verdict = choice_of_json(json.at("verdict"), DiagnosisVerdict::not_reached),
      .accepted = json.at("accepted").get<std::vector<std::string>>(),
      .accepted_effects = json.at("accepted_effects").get<std::vector<std::string>>(),
      .before = number_of_json(errors.at(0)),
      .after = number_of_json(errors.at(1)),
      .with_truth = number_of_json(errors.at(2)),
      .noise = number_of_json(errors.at(3)),
      .with_law = number_of_json(errors.at(6)),
      .before_fitted = number_of_json(errors.at(4)),
      .after_fitted = number_of_json(errors.at(5)),
      .drawing_seconds = json.at("seconds").at(0),
      .seconds = json.at("seconds").at(1)};
  for (const Json& hidden : json.at("hidden")) trial.hidden.push_back(hidden_of(hidden));
  return trial;
}

}  // namespace clothfit
