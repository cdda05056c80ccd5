#include "apps/study/foreign/foreign_row.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace clothfit {
namespace {

using Json = nlohmann::ordered_json;

Json number_json(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

double number_of(const Json& json) {
  return json.is_null() ? std::numeric_limits<double>::quiet_NaN() : json.get<double>();
}

DiagnosisVerdict verdict_of(int number) {
  if (number < 0 || number > static_cast<int>(DiagnosisVerdict::not_reached))
    throw std::out_of_range("no such verdict");
  return static_cast<DiagnosisVerdict>(number);
}

}  // namespace

double ForeignRow::error_over_floor() const {
  if (!judged()) return std::numeric_limits<double>::quiet_NaN();
  const double floor = diagnosis.unit == "m" ? truth->floor_m : truth->floor_px;
  return diagnosis.held_out_rms / std::hypot(diagnosis.noise, floor);
}

std::string payload_of(const ForeignDiagnosis& diagnosis) {
  Json json{{"reason", diagnosis.reason},
            {"verdict", static_cast<int>(diagnosis.verdict)},
            {"complete", diagnosis.complete},
            {"named", Json::array()},
            {"unit", diagnosis.unit},
            {"held_out_rms", number_json(diagnosis.held_out_rms)},
            {"noise", number_json(diagnosis.noise)},
            {"seconds", diagnosis.seconds}};
  for (const NamedEffect& named : diagnosis.named)
    json["named"].push_back(
        {{"effect", named.effect}, {"title", named.title}, {"alike", named.alike}});
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

ForeignDiagnosis foreign_diagnosis_of(const std::string& payload) {
  const Json json = Json::parse(payload);
  ForeignDiagnosis diagnosis{.reason = json.at("reason"),
                             .verdict = verdict_of(json.at("verdict").get<int>()),
                             .complete = json.at("complete"),
                             .named = {},
                             .unit = json.at("unit"),
                             .held_out_rms = number_of(json.at("held_out_rms")),
                             .noise = number_of(json.at("noise")),
                             .seconds = json.at("seconds")};
  for (const Json& named : json.at("named"))
    diagnosis.named.push_back({.effect = named.at("effect"),
                               .title = named.at("title"),
                               .alike = named.at("alike").get<std::vector<std::string>>()});
  return diagnosis;
}

}  // namespace clothfit
