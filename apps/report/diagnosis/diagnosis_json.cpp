#include "apps/report/diagnosis/diagnosis_json.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "apps/report/diagnosis/diagnosis_law.h"
#include "apps/report/diagnosis/diagnosis_tables.h"
#include "apps/terminal/json_file.h"
#include "data/finding_json.h"
#include "data/program_version.h"
#include "fit/problem/effect_words.h"
#include "fit/problem/effects_of.h"

namespace clothfit {
namespace {

using nlohmann::ordered_json;

ordered_json term_json(const Hypothesis& term) {
  ordered_json json{{"effect", term.effect}, {"law", term.mode}};
  if (!term.shape.empty()) json["shape"] = term.shape;
  for (const auto& [name, number] : term.picked) json["shape"][name] = number;
  return json;
}

ordered_json criteria_json(const DiagnosisCriteria& criteria) {
  ordered_json json = ordered_json::array();
  for (const CriterionDescription& one : describe(criteria))
    json.push_back({{"name", one.name},
                    {"value", one.value},
                    {"decides", one.decides},
                    {"raising", one.raising},
                    {"chosen", one.chosen}});
  return json;
}

std::vector<std::string> titles(const std::vector<Hypothesis>& terms) {
  std::vector<std::string> all;
  for (const Hypothesis& term : terms) all.push_back(term.title());
  return all;
}

ordered_json trial_json(const Trial& trial) {
  ordered_json json = term_json(trial.hypothesis);
  json["foreseen_fall"] = trial.predicted_decrease;
  json["fall"] = trial.decrease;
  json["cross_validated"] = trial.cross_validated;
  json["cross_validated_before"] = trial.without_it;
  json["cross_validated_trivial"] = trial.best_trivial;
  json["clear_of_neutral"] = trial.clear_of_neutral;
  json["criteria"] = ordered_json::array();
  for (const Criterion& criterion : trial.criteria)
    json["criteria"].push_back({{"name", criterion.name},
                                {"measured", criterion.measured},
                                {"threshold", criterion.threshold},
                                {"passed", criterion.passed}});
  json["refused"] = trial.refusal();
  if (trial.on_credit) json["with_later_ones"] = true;
  return json;
}

/// Lists the values that the last fit has for a term's parameters.
ordered_json found_json(const Hypothesis& term, const FitReport& found) {
  ordered_json json = ordered_json::array();
  const auto add = [&](const std::string& name) {
    const auto value = found.values.find(term.effect + "." + name);
    if (value == found.values.end()) return;
    double sigma = 0;
    for (const EffectEstimate& effect : found.result.effects)
      if (effect.name == term.effect)
        for (const ParameterEstimate& parameter : effect.parameters)
          if (parameter.name == name) sigma = parameter.sigma;
    for (const ParameterEstimate& parameter : found.result.nuisance)
      if (parameter.name == value->first) sigma = parameter.sigma;
    json.push_back({{"name", name}, {"value", value->second}, {"sigma", sigma}});
  };
  for (const std::string& amplitude : term.amplitudes) add(amplitude);
  if (term.fits_shape)
    for (const auto& [name, value] : term.shape) add(name);
  return json;
}

ordered_json separation_json(const Separation& separation) {
  ordered_json recordings = ordered_json::array();
  for (const SeparatingRecording& recording : separation.recordings)
    recordings.push_back({{"what", recording.what}, {"sigmas", recording.sigmas}});
  return {{"from", separation.from.title()}, {"now", separation.now}, {"recordings", recordings}};
}

ordered_json adequacy_json(const Adequacy& of) {
  return {{"adequate", of.adequate},
          {"chi_square_per_dof", of.chi_square_per_dof},
          {"noise_chi_square_per_dof", of.noise_chi_square_per_dof},
          {"time_correlation", of.time_correlation},
          {"neighbour_correlation", of.neighbour_correlation},
          {"discretisation_square", of.discretisation_square},
          {"discretisation_found", of.discretisation_found},
          {"smooth_share", of.smooth_share},
          {"smooth_score", of.smooth_score}};
}

}  // namespace

void write_diagnosis(const Diagnosis& diagnosis, const std::string& command,
                     const std::filesystem::path& file) {
  const auto names = [&](bool held_out) {
    ordered_json list = ordered_json::array();
    for (const DiagnosedRecording& recording : diagnosis.recordings)
      if (recording.held_out == held_out) list.push_back(recording.before.result.recording);
    return list;
  };
  ordered_json json{{"format", "clothfit-diagnosis/1"},
                    {"version", program_version()},
                    {"command", command},
                    {"recordings", names(false)},
                    {"held_out_recordings", names(true)},
                    {"verdict", to_string(diagnosis.verdict)},
                    {"complete", diagnosis.complete},
                    {"seconds", diagnosis.seconds}};
  json["warnings"] = ordered_json::array();
  for (const DiagnosedRecording& recording : diagnosis.recordings)
    for (const Finding& warning : recording.after.result.warnings) {
      ordered_json one{{"recording", recording.after.result.recording}};
      one.update(to_json(warning));
      json["warnings"].push_back(std::move(one));
    }
  json["phases"] = ordered_json::array();
  for (const PhaseTime& phase : diagnosis.phases)
    json["phases"].push_back({{"name", phase.name}, {"seconds", phase.seconds}});
  if (!diagnosis.complete) json["not_tried"] = titles(not_tried(diagnosis));
  if (const auto& seen = diagnosis.seen_elsewhere)
    json["seen_elsewhere"] = {{"rms_m", seen->rms_m},
                              {"cross_validated", seen->cross_validated},
                              {"cross_validated_before", seen->without_it}};
  json["accepted"] = ordered_json::array();
  for (size_t n = 0; n < diagnosis.accepted.size(); ++n) {
    const AcceptedEffect& accepted = diagnosis.accepted[n];
    ordered_json one = trial_json(accepted.trial);
    one.erase("refused");
    std::vector<std::string> alike{accepted.trial.hypothesis.effect};
    for (const Hypothesis& term : accepted.alike)
      if (std::ranges::find(alike, term.effect) == alike.end()) alike.push_back(term.effect);
    one["class"] = alike;
    one["parameters"] = found_json(accepted.trial.hypothesis, diagnosis.found());
    if (const std::string words = words_of(accepted.trial.hypothesis, diagnosis.found());
        !words.empty())
      one["in_words"] = words;
    if (const std::string remedy = describe_effect(accepted.trial.hypothesis.effect).remedy;
        !remedy.empty())
      one["remedy"] = remedy;
    one["instead"] = ordered_json::array();
    for (const Trial& trial : accepted.refused) one["instead"].push_back(trial_json(trial));
    one["separation"] = ordered_json::array();
    for (const Separation& separation : diagnosis.separation_of(n))
      one["separation"].push_back(separation_json(separation));
    json["accepted"].push_back(std::move(one));
  }
  json["refused"] = ordered_json::array();
  for (const Trial& trial : diagnosis.refused) json["refused"].push_back(trial_json(trial));
  json["traces"] = titles(traces(diagnosis));
  json["errors"] = ordered_json::array();
  // Frames that were not held out, or not fitted, have no error.
  const auto known = [](const ErrorSummary& error, double rms) {
    return error.count > 0 ? ordered_json(rms) : ordered_json(nullptr);
  };
  for (const auto& [recording, before, after] : errors_before_after(diagnosis)) {
    json["errors"].push_back(
        {{"recording", recording->before.result.recording},
         {"kind", before->kind},
         {"unit", before->unit},
         {"noise", before->noise},
         {"fitted_before", known(before->fitted, before->fitted.rms)},
         {"fitted_after", known(after->fitted, after->fitted.rms)},
         {"held_out_before", known(before->held_out, before->held_out.rms)},
         {"held_out_after", known(after->held_out, after->held_out.rms)},
         {"fitted_before_distance", known(before->fitted, before->fitted.rms_distance)},
         {"fitted_after_distance", known(after->fitted, after->fitted.rms_distance)},
         {"held_out_before_distance", known(before->held_out, before->held_out.rms_distance)},
         {"held_out_after_distance", known(after->held_out, after->held_out.rms_distance)}});
  }
  json["adequacy"] = {{"before", adequacy_json(diagnosis.before)},
                      {"after", adequacy_json(diagnosis.after)}};
  json["analysed_mesh"] = {{"columns", diagnosis.columns}, {"rows", diagnosis.rows}};
  json["score_frames"] = diagnosis.score_frames;
  json["candidates"] = ordered_json::array();
  for (const Score& score : diagnosis.scores) {
    ordered_json one = term_json(score.hypothesis);
    one["share"] = score.share;
    one["predicted_fall"] = score.decrease;
    one["parameters"] = ordered_json::array();
    for (Eigen::Index k = 0; k < score.amplitude.size(); ++k)
      one["parameters"].push_back({{"name", score.amplitude_name(k)},
                                   {"beyond_neutral", score.amplitude[k]},
                                   {"sigma", score.sigma[k]}});
    json["candidates"].push_back(std::move(one));
  }
  json["detection_limits"] = ordered_json::array();
  for (const DetectionLimit& limit : diagnosis.limits)
    for (Eigen::Index k = 0; k < limit.limit.size(); ++k) {
      ordered_json one = term_json(limit.hypothesis);
      one["parameter"] = limit.parameter[static_cast<size_t>(k)];
      one["amplitude"] = limit.limit[k];
      one["unit"] = limit.unit[static_cast<size_t>(k)];
      json["detection_limits"].push_back(std::move(one));
    }
  json["planted"] = ordered_json::array();
  for (const PlantOutcome& outcome : diagnosis.plants) {
    ordered_json one = term_json(outcome.plant.hypothesis);
    one["parameter"] = outcome.plant.parameter;
    one["beyond_neutral"] = outcome.plant.beyond_neutral;
    one["named"] = outcome.named();
    one["found"] = titles(outcome.found);
    json["planted"].push_back(std::move(one));
  }
  json["reinjected"] = nullptr;
  if (diagnosis.reinjected && diagnosis.reinjected->ran)
    json["reinjected"] = {{"found", titles(diagnosis.reinjected->found)}};
  json["criteria"] = criteria_json(diagnosis.criteria);
  json["residual_force"] = residual_force_json(diagnosis.residual_force);
  json["proposed_law"] = proposed_law_json(diagnosis);
  write_json(json, file);
}

}  // namespace clothfit
