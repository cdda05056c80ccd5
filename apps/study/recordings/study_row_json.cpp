#include "apps/study/recordings/study_row_json.h"

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

namespace clothfit {
namespace {

/// Calls visit(name, member) for every text, then for every number of a row.
template <class Row, class VisitText, class VisitNumber>
void for_each_member(Row& row, const VisitText& text, const VisitNumber& number) {
  text("recording", row.recording);
  text("folder", row.folder);
  text("model", row.model);
  text("stop", row.stop);
  text("reason", row.reason);
  text("kind", row.kind);
  text("unit", row.unit);
  number("fitted_rms", row.fitted_rms);
  number("held_out_rms", row.held_out_rms);
  number("whole_rms", row.whole_rms);
  number("first_frame_rms", row.first_frame_rms);
  number("last_velocity_rms", row.last_velocity_rms);
  number("rigid_rms", row.rigid_rms);
  number("whole_rigid_rms", row.whole_rigid_rms);
  number("noise", row.noise);
  number("weighted_rms", row.weighted_rms);
  number("weighted_rigid_rms", row.weighted_rigid_rms);
  number("published_rms", row.published_rms);
  number("centred_held_out_rms", row.centred_held_out_rms);
  number("centred_rigid_rms", row.centred_rigid_rms);
  number("centred_weighted_rms", row.centred_weighted_rms);
  number("seconds", row.seconds);
}

StudyRow from_json(const nlohmann::ordered_json& json) {
  StudyRow row;
  row.fitted = json.at("fitted");
  for_each_member(
      row, [&](const char* name, std::string& text) { text = json.at(name); },
      [&](const char* name, double& number) {
        const auto& value = json.at(name);
        number = value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>();
      });
  for (const auto& [name, value] : json.at("parameters").items()) row.parameters[name] = value;
  return row;
}

}  // namespace

nlohmann::ordered_json to_json(const StudyRow& row) {
  nlohmann::ordered_json json;
  json["fitted"] = row.fitted;
  for_each_member(
      row, [&](const char* name, const std::string& text) { json[name] = text; },
      [&](const char* name, double number) {
        json[name] = std::isfinite(number) ? nlohmann::ordered_json(number) : nullptr;
      });
  json["parameters"] = row.parameters;
  return json;
}

std::string rows_to_text(const std::vector<StudyRow>& rows) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (const StudyRow& row : rows) json.push_back(to_json(row));
  return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

std::vector<StudyRow> rows_from_text(const std::string& text) {
  std::vector<StudyRow> rows;
  for (const auto& json : nlohmann::ordered_json::parse(text)) rows.push_back(from_json(json));
  return rows;
}

}  // namespace clothfit
