#include "apps/report/diagnosis/diagnosis_law.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "apps/report/page/html.h"
#include "apps/report/page/svg.h"
#include "apps/terminal/number_text.h"
#include "fit/problem/effects_of.h"

namespace clothfit {
namespace {

using nlohmann::ordered_json;

const Marker& marker_of(const ResidualForce::OfMarker& of, const Recording& recording) {
  return recording.markers.markers[static_cast<size_t>(of.marker)];
}

std::vector<ResidualForce::Regression> most_telling_first(const ResidualForce& force) {
  std::vector<ResidualForce::Regression> sorted = force.regressions;
  std::ranges::stable_sort(sorted, std::greater<>(), [](const ResidualForce::Regression& on) {
    return std::abs(on.correlation);
  });
  return sorted;
}

/// Errors without and with the proposed law, where frames are held out. Both models have the
/// accepted effects. There is an entry for each recording and kind of observation.
struct ErrorsWithLaw {
  const DiagnosedRecording* recording = nullptr;
  const ObservationErrors* before = nullptr;
  const ObservationErrors* after = nullptr;
};

std::vector<ErrorsWithLaw> errors_with_law(const Diagnosis& diagnosis) {
  std::vector<ErrorsWithLaw> result;
  if (!diagnosis.law.found()) return result;
  for (const DiagnosedRecording& recording : diagnosis.recordings)
    for (const ObservationErrors& before : recording.after.result.errors)
      for (const ObservationErrors& after : recording.with_law.result.errors)
        if (before.kind == after.kind && before.held_out.count > 0)
          result.push_back({.recording = &recording, .before = &before, .after = &after});
  return result;
}

}  // namespace

Table regression_table(const ResidualForce& force) {
  Table table{{"residual force on", "correlation", "slope", "sigma", "unit"}, {}};
  for (const ResidualForce::Regression& on : most_telling_first(force))
    table.rows.push_back({on.on, fmt::format("{:.2f}", on.correlation),
                          value_text(on.slope, on.sigma), significant(on.sigma, 2), on.unit});
  return table;
}

Table residual_force_table(const ResidualForce& force, const Recording& recording) {
  Table table{{"marker", "s_m", "t_m", "mean_x", "mean_y", "mean_z", "rms_x", "rms_y", "rms_z"},
              {}};
  for (const ResidualForce::OfMarker& of : force.markers) {
    const Marker& marker = marker_of(of, recording);
    table.rows.push_back({marker.name, exact_text(marker.s_m), exact_text(marker.t_m)});
    for (const Eigen::Vector3d& vector : {of.mean_m_per_s2, of.rms_m_per_s2})
      for (const double coordinate : vector) table.rows.back().push_back(exact_text(coordinate));
  }
  return table;
}

Table law_table(const ProposedLaw& law) {
  Table table{{"coefficient", "value", "sigma", "unit", "of", ""}, {}};
  for (const LawCoefficient& one : law.coefficients)
    table.rows.push_back({one.effect + "." + one.parameter, value_text(one.value, one.sigma),
                          significant(one.sigma, 2), one.unit, one.term,
                          one.at_bound ? "at the end of its range" : ""});
  return table;
}

Table law_error_table(const Diagnosis& diagnosis) {
  Table table{{"observations", "held out, without the law", "with it", "noise"}, {}};
  const bool several = diagnosis.recordings.size() > 1;
  if (several) table.header.insert(table.header.begin(), "recording");
  for (const auto& [recording, before, after] : errors_with_law(diagnosis)) {
    const double factor = shown_unit(before->unit).factor;
    table.rows.push_back(
        {kind_title(before->kind, before->unit), significant(before->held_out.rms * factor, 3),
         significant(after->held_out.rms * factor, 3), significant(before->noise * factor, 3)});
    if (several)
      table.rows.back().insert(table.rows.back().begin(), recording->before.result.recording);
  }
  return table;
}

Table term_table(const ProposedLaw& law) {
  constexpr size_t kShown = 12;
  Table table{{"term", "explains", "fall of chi-square", "coefficients"}, {}};
  for (size_t n = 0; n < std::min(kShown, law.scores.size()); ++n) {
    const Score& score = law.scores[n];
    std::string amounts;
    for (Eigen::Index k = 0; k < score.amplitude.size(); ++k)
      amounts += (k > 0 ? ", " : "") + value_text(score.amplitude[k], score.sigma[k]) + " ± " +
                 significant(score.sigma[k], 2);
    table.rows.push_back({score.hypothesis.title(), fmt::format("{:.0f} %", 100 * score.share),
                          significant(score.decrease, 3), amounts});
  }
  return table;
}

Table law_trial_table(const ProposedLaw& law) {
  Table table{{"term", "predicted decrease", "left out", "without it", "outcome"}, {}};
  for (const TermTrial& trial : law.trials)
    table.rows.push_back({trial.hypothesis.title(), significant(trial.predicted_decrease, 3),
                          significant(trial.cross_validated, 4), significant(trial.without_it, 4),
                          trial.refused.empty() ? "kept" : trial.refused});
  return table;
}

std::string residual_force_map_svg(const ResidualForce& force, const Recording& recording) {
  if (force.markers.empty()) return "";
  ClothMaps maps{.title = "Residual force over the cloth",
                 .description = "",
                 .width_m = recording.cloth.width_m,
                 .height_m = recording.cloth.height_m,
                 .value_label = "m/s²",
                 .maps = {}};
  const auto add = [&](const std::string& title, const auto& length) {
    ClothMap map{.title = title, .values = {}};
    for (const ResidualForce::OfMarker& of : force.markers) {
      const Marker& marker = marker_of(of, recording);
      map.values.push_back({marker.s_m, marker.t_m, length(of),
                            fmt::format("{}: {} m/s²", marker.name, significant(length(of), 3))});
    }
    const auto worst = std::ranges::max_element(map.values, {}, &ClothValue::value);
    maps.description +=
        fmt::format("{}: largest at s = {} m, t = {} m ({}). ", title, significant(worst->s, 3),
                    significant(worst->t, 3), worst->label);
    maps.maps.push_back(std::move(map));
  };
  add("mean", [](const ResidualForce::OfMarker& of) { return of.mean_m_per_s2.norm(); });
  add("rms", [](const ResidualForce::OfMarker& of) { return of.rms_m_per_s2.norm(); });
  return cloth_maps(maps);
}

std::string residual_force_html(const ResidualForce& force, const Recording& recording) {
  if (!force.why_none.empty())
    return paragraph("There is no residual force: " + force.why_none + ".");
  if (force.markers.empty()) return "";
  return figure(residual_force_map_svg(force, recording),
                "Force per mass that the tracks ask for beyond the model's: the acceleration of "
                "what the model leaves, each marker's smoothed. The cloth's own answer is in it.") +
         html_table(regression_table(force),
                    "What the residual force goes with. Slopes on numbers are lengths of vectors, "
                    "their correlations multiple ones. Errors may depend on each other over the "
                    "frames of a marker.");
}

std::string proposed_law_html(const Diagnosis& diagnosis) {
  const ProposedLaw& law = diagnosis.law;
  if (!law.found()) {
    if (law.trials.empty()) return "";
    return paragraph("No empirical law predicts frames that were left out better.") +
           html_table(term_table(law), "What each term would explain by itself.") +
           html_table(law_trial_table(law), "Terms that were fitted.");
  }
  return fmt::format("<pre>{}</pre>\n", escape_xml(law.formula)) +
         paragraph(fmt::format(
             "An empirical law for the residual: a is a force per mass, p one per area, v the "
             "velocity, n the "
             "surface's normal, v_t the velocity in the surface, s / w and t / h the place on the "
             "cloth, T the tension of a spring and e its elongation. It says what the missing "
             "force looks like, not what causes it. Blocks of time that were left out in turn are "
             "predicted with a chi-square of {} per number, {} without it.",
             significant(law.after.mean, 4), significant(law.before.mean, 4))) +
         html_table(law_table(law), "Its coefficients.") +
         html_table(law_error_table(diagnosis),
                    "Root mean square of one coordinate's residual on "
                    "frames that no decision has seen.") +
         html_table(term_table(law),
                    "What each term would explain by itself, where something is first missing: by "
                    "the derivatives of the model where it does nothing yet, all else free.") +
         html_table(law_trial_table(law), "Terms that were fitted.") +
         paragraph(
             "law/fit.json and law/model.yaml beside this page hold the model with this law, for "
             "clothfit fit --forecast and clothfit simulate. To fit the coefficients again, to "
             "this or another recording, declare:") +
         fmt::format("<pre>{}</pre>\n", escape_xml(declaration_text(law)));
}

std::string declaration_text(const ProposedLaw& law) {
  if (!law.found()) return "";
  std::string text = "declared:\n";
  std::vector<std::string> effects;
  for (const LawCoefficient& one : law.coefficients)
    if (std::ranges::find(effects, one.effect) == effects.end()) effects.push_back(one.effect);
  for (const std::string& effect : effects) {
    std::string zeros;
    for (const EffectParameter& parameter : describe_effect(effect).parameters) {
      const bool is_free = std::ranges::any_of(law.coefficients, [&](const LawCoefficient& one) {
        return one.effect == effect && one.parameter == parameter.name;
      });
      if (!is_free) zeros += (zeros.empty() ? "" : ", ") + parameter.name + ": 0";
    }
    text += fmt::format("  - {{effect: {}, parameters: {{{}}}}}\n", effect, zeros);
  }
  return text;
}

ordered_json proposed_law_json(const Diagnosis& diagnosis) {
  const ProposedLaw& law = diagnosis.law;
  if (!law.found()) return nullptr;
  ordered_json json{{"formula", ordered_json::array()}};
  for (size_t begin = 0; begin < law.formula.size();) {
    const size_t end = std::min(law.formula.find('\n', begin), law.formula.size());
    json["formula"].push_back(law.formula.substr(begin, end - begin));
    begin = end + 1;
  }
  json["coefficients"] = ordered_json::array();
  for (const LawCoefficient& one : law.coefficients)
    json["coefficients"].push_back({{"effect", one.effect},
                                    {"parameter", one.parameter},
                                    {"unit", one.unit},
                                    {"of", one.term},
                                    {"value", one.value},
                                    {"sigma", one.sigma},
                                    {"at_bound", one.at_bound}});
  json["cross_validated"] = law.after.mean;
  json["cross_validated_before"] = law.before.mean;
  json["held_out"] = ordered_json::array();
  for (const auto& [recording, before, after] : errors_with_law(diagnosis))
    json["held_out"].push_back({{"recording", recording->before.result.recording},
                                {"kind", before->kind},
                                {"unit", before->unit},
                                {"noise", before->noise},
                                {"before", before->held_out.rms},
                                {"after", after->held_out.rms}});
  json["trials"] = ordered_json::array();
  for (const TermTrial& trial : law.trials)
    json["trials"].push_back({{"effect", trial.hypothesis.effect},
                              {"law", trial.hypothesis.mode},
                              {"foreseen_fall", trial.predicted_decrease},
                              {"cross_validated", trial.cross_validated},
                              {"cross_validated_before", trial.without_it},
                              {"refused", trial.refused}});
  return json;
}

ordered_json residual_force_json(const ResidualForce& force) {
  if (force.markers.empty()) return nullptr;
  ordered_json json{{"regressions", ordered_json::array()}};
  for (const ResidualForce::Regression& on : most_telling_first(force))
    json["regressions"].push_back({{"on", on.on},
                                   {"unit", on.unit},
                                   {"correlation", on.correlation},
                                   {"slope", on.slope},
                                   {"sigma", on.sigma}});
  return json;
}

}  // namespace clothfit
