#include "apps/report/diagnosis/diagnosis_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/terminal/number_text.h"
#include "fit/problem/effect_words.h"
#include "fit/problem/effects_of.h"

namespace clothfit {
namespace {

/// A reader is shown this many of all scored modes.
constexpr size_t kShown = 12;

std::string shape_text(const Hypothesis& term) {
  std::string text;
  for (const auto& [name, value] : term.shape)
    text += (text.empty() ? "" : ", ") + name + " " + significant(value, 3);
  for (const auto& [name, number] : term.picked)
    text += (text.empty() ? "" : ", ") + name + " " + std::to_string(number);
  return text;
}

bool has_no_unit(const std::string& unit) {
  return unit.empty() || unit == "1" || unit == "ratio";
}

std::string sigmas_text(double sigmas) {
  return fmt::format("{:.{}f}", sigmas, sigmas < 9.95 ? 1 : 0);
}

/// Writes "q_x 0.05, q_y ..., and 2 more" with as many digits as sigma allows.
std::string amounts_text(const Score& score) {
  constexpr Eigen::Index kMostAmounts = 4;  // what a line of a terminal holds
  std::string text;
  for (Eigen::Index k = 0; k < std::min(kMostAmounts, score.amplitude.size()); ++k)
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", score.amplitude_name(k),
                        value_text(score.amplitude[k], score.sigma[k]));
  if (score.amplitude.size() > kMostAmounts)
    text += fmt::format(", and {} more", score.amplitude.size() - kMostAmounts);
  return text;
}

/// Returns a parameter's name in its effect; those of the measurement are named EFFECT.PARAMETER.
std::string amplitude_name(const Hypothesis& term, const ParameterEstimate& parameter) {
  const std::string prefix = term.effect + ".";
  return parameter.name.starts_with(prefix) ? parameter.name.substr(prefix.size()) : parameter.name;
}

/// Returns what a fit found of a term: its amplitudes, and its shape where that was fitted.
std::vector<ParameterEstimate> estimates_of(const Hypothesis& term, const FitResult& result) {
  std::vector<ParameterEstimate> estimates;
  const auto add = [&](const ParameterEstimate& parameter) {
    const std::string name = amplitude_name(term, parameter);
    if (std::ranges::find(term.amplitudes, name) != term.amplitudes.end() ||
        (term.fits_shape && term.shape.contains(name)))
      estimates.push_back(parameter);
  };
  for (const EffectEstimate& effect : result.effects)
    if (effect.name == term.effect) std::ranges::for_each(effect.parameters, add);
  for (const ParameterEstimate& parameter : result.nuisance)
    if (parameter.name.starts_with(term.effect + ".")) add(parameter);
  return estimates;
}

}  // namespace

Table candidate_table(const Diagnosis& diagnosis) {
  Table table{{"effect", "mode", "shape", "share", "decrease", "parameter", "amplitude", "sigma"},
              {}};
  for (const Score& score : diagnosis.scores)
    for (Eigen::Index k = 0; k < score.amplitude.size(); ++k)
      table.rows.push_back({score.hypothesis.effect, score.hypothesis.mode,
                            shape_text(score.hypothesis), exact_text(score.share),
                            exact_text(score.decrease), score.amplitude_name(k),
                            exact_text(score.amplitude[k]), exact_text(score.sigma[k])});
  return table;
}

Table short_candidate_table(const Diagnosis& diagnosis) {
  Table table{{"mode", "explains", "decrease of chi-square", "amplitudes beyond neutral", "at"},
              {}};
  for (size_t n = 0; n < std::min(kShown, diagnosis.scores.size()); ++n) {
    const Score& score = diagnosis.scores[n];
    table.rows.push_back({score.hypothesis.title(), fmt::format("{:.0f} %", 100 * score.share),
                          significant(score.decrease, 3), amounts_text(score),
                          shape_text(score.hypothesis)});
  }
  return table;
}

Table trial_table(const Diagnosis& diagnosis) {
  Table table{{"round", "mode", "predicted decrease", "decrease", "left out", "without it",
               "corrected without physics", "clear of neutral", "outcome"},
              {}};
  const auto add = [&](size_t round, const Trial& trial) {
    table.rows.push_back(
        {std::to_string(round), trial.hypothesis.title(), significant(trial.predicted_decrease, 3),
         significant(trial.decrease, 3), significant(trial.cross_validated, 4),
         significant(trial.without_it, 4), significant(trial.best_trivial, 4),
         std::isfinite(trial.clear_of_neutral) ? fmt::format("{:.1f} sigma", trial.clear_of_neutral)
                                               : "-",
         trial.passed() ? "could be accepted" : trial.refusal()});
  };
  size_t round = 1;
  for (const AcceptedEffect& accepted : diagnosis.accepted) {
    add(round, accepted.trial);
    table.rows.back().back() = "accepted";
    for (const Trial& trial : accepted.refused) add(round, trial);
    ++round;
  }
  for (const Trial& trial : diagnosis.refused) add(round, trial);
  return table;
}

std::vector<Hypothesis> traces(const Diagnosis& diagnosis) {
  std::vector<Hypothesis> found;
  for (const Trial& trial : diagnosis.refused)
    if (trial.is_trace()) found.push_back(trial.hypothesis);
  return found;
}

std::vector<Hypothesis> not_tried(const Diagnosis& diagnosis) {
  const auto is_of = [](const Score& score, const std::vector<Trial>& trials) {
    return std::ranges::any_of(
        trials, [&](const Trial& trial) { return trial.hypothesis.same_mode(score.hypothesis); });
  };
  std::vector<Hypothesis> left;
  for (const Score& score : diagnosis.scores) {
    const bool tried = is_of(score, diagnosis.refused) ||
                       std::ranges::any_of(diagnosis.accepted, [&](const AcceptedEffect& accepted) {
                         return accepted.trial.hypothesis.same_mode(score.hypothesis) ||
                                is_of(score, accepted.refused);
                       });
    if (!tried) left.push_back(score.hypothesis);
  }
  return left;
}

Table limit_table(const Diagnosis& diagnosis) {
  Table table{{"mode", "parameter", "would have been seen from", "unit", "score's estimate", "at"},
              {}};
  for (const DetectionLimit& limit : diagnosis.limits)
    for (Eigen::Index k = 0; k < limit.limit.size(); ++k)
      table.rows.push_back({limit.hypothesis.title(), limit.parameter[static_cast<size_t>(k)],
                            significant(limit.limit[k], 3), limit.unit[static_cast<size_t>(k)],
                            significant(limit.found[k], 3), shape_text(limit.hypothesis)});
  return table;
}

std::string outcome_text(const PlantOutcome& outcome) {
  if (!outcome.ran) return outcome.why_not;
  if (outcome.found.empty()) return "not found";
  if (!outcome.named()) return outcome.found.front().title() + " instead";
  return outcome.found.size() > 1 ? "named, with others that do the same here" : "named";
}

Table plant_table(const Diagnosis& diagnosis) {
  Table table{{"mode", "parameter", "planted, beyond neutral", "unit", "outcome", "at"}, {}};
  for (const PlantOutcome& outcome : diagnosis.plants) {
    const Plant& plant = outcome.plant;
    const EffectDescription effect = describe_effect(plant.hypothesis.effect);
    const auto parameter =
        std::ranges::find(effect.parameters, plant.parameter, &EffectParameter::name);
    table.rows.push_back({plant.hypothesis.title(), plant.parameter,
                          significant(plant.beyond_neutral, 3), parameter->unit,
                          outcome_text(outcome), shape_text(plant.hypothesis)});
  }
  return table;
}

Table separation_table(std::span<const Separation> separations) {
  constexpr double kSomething = 1;  // sigmas; the best one is shown even so
  Table table{{"mode", "now, sigma", "in a recording", "then, sigma"}, {}};
  for (const Separation& separation : separations)
    for (const SeparatingRecording& recording : separation.recordings)
      if (recording.sigmas > kSomething || &recording == &separation.recordings.front())
        table.rows.push_back({separation.from.title(), sigmas_text(separation.now), recording.what,
                              sigmas_text(recording.sigmas)});
  return table;
}

std::string separation_text(const Hypothesis& accepted, std::span<const Separation> separations) {
  constexpr double kTold = 5;
  std::string text;
  for (const Separation& separation : separations) {
    text += fmt::format("{}{} ({} sigma", text.empty() ? "" : ", ", separation.from.title(),
                        sigmas_text(separation.now));
    if (!separation.recordings.empty()) {
      const SeparatingRecording& best = separation.recordings.front();
      text +=
          best.sigmas < kTold
              ? fmt::format("; at most {} in recordings that were tried", sigmas_text(best.sigmas))
              : fmt::format("; {} sigma with: {}", sigmas_text(best.sigmas), best.what);
    }
    text += ")";
  }
  return accepted.title() + " cannot be told from " + text;
}

std::vector<ErrorsBeforeAfter> errors_before_after(const Diagnosis& diagnosis) {
  std::vector<ErrorsBeforeAfter> result;
  for (const DiagnosedRecording& recording : diagnosis.recordings)
    for (const ObservationErrors& before : recording.before.result.errors) {
      const std::vector<ObservationErrors>& found = recording.after.result.errors;
      const auto after = std::ranges::find(found, before.kind, &ObservationErrors::kind);
      if (after != found.end())
        result.push_back({.recording = &recording, .before = &before, .after = &*after});
    }
  return result;
}

Table before_after_table(const Diagnosis& diagnosis) {
  Table table{{"observations", "fitted, before", "fitted, after", "held out, before",
               "held out, after", "noise", "stays as in frame 0", "moves on", "moves rigidly"},
              {}};
  const bool several = diagnosis.recordings.size() > 1;
  if (several) table.header.insert(table.header.begin(), "recording");
  for (const auto& [recording, before, after] : errors_before_after(diagnosis)) {
    const double factor = shown_unit(before->unit).factor;
    const bool judged = before->held_out.count > 0;
    const auto shown = [&](double value) { return significant(value * factor, 3); };
    const auto held = [&](double value) { return judged ? shown(value) : std::string("-"); };
    table.rows.push_back({kind_title(before->kind, before->unit), shown(before->fitted.rms),
                          shown(after->fitted.rms), held(before->held_out.rms),
                          held(after->held_out.rms), shown(before->noise),
                          held(before->trivial.first_frame), held(before->trivial.last_velocity),
                          held(before->trivial.rigid)});
    std::vector<std::string>& row = table.rows.back();
    if (recording->held_out) row[1] = row[2] = "-";
    if (several)
      row.insert(row.begin(),
                 recording->before.result.recording + (recording->held_out ? " (held out)" : ""));
  }
  return table;
}

Table adequacy_table(const Diagnosis& diagnosis) {
  Table table{{"test", "before", "after", "of noise"}, {}};
  const Adequacy &before = diagnosis.before, &after = diagnosis.after;
  const auto add = [&](const std::string& name, double one, double other,
                       const std::string& noise) {
    table.rows.push_back({name, significant(one, 3), significant(other, 3), noise});
  };
  add("chi-square per degree of freedom", before.chi_square_per_dof, after.chi_square_per_dof, "1");
  add("the same, mesh and time step taken as exact", before.noise_chi_square_per_dof,
      after.noise_chi_square_per_dof, "1");
  add("what mesh and time step are thought to err by, mean square; a tenth of it may be left",
      before.discretisation_square, after.discretisation_square, "");
  add("correlation with the next frame", before.time_correlation, after.time_correlation, "0");
  add("correlation with the neighbouring marker", before.neighbour_correlation,
      after.neighbour_correlation, "0");
  add("share of smooth patterns", before.smooth_share, after.smooth_share, "0");
  return table;
}

std::string seen_elsewhere_text(const SeenElsewhere& seen) {
  return fmt::format("a constant for each, {} mm in the mean (rms of a coordinate)",
                     significant(1e3 * seen.rms_m, 3));
}

std::string certainty_text(const Hypothesis& term, const FitResult& result) {
  // Amplitude and shape trade: what they make together is known otherwise than either.
  if (term.fits_shape) return "";
  double values = 0, variances = 0;
  for (const ParameterEstimate& parameter : estimates_of(term, result)) {
    if (std::ranges::find(term.amplitudes, amplitude_name(term, parameter)) ==
        term.amplitudes.end())
      continue;
    values += parameter.value * parameter.value;
    variances += parameter.sigma * parameter.sigma;
  }
  if (!(values > 0 && variances > 0)) return "";
  return fmt::format(" ± {} % (one standard deviation)",
                     significant(100 * std::sqrt(variances / values), 2));
}

std::string remedy_text(const Hypothesis& term) {
  const std::string remedy = describe_effect(term.effect).remedy;
  return remedy.empty() ? remedy : "Remedy: " + remedy + ".";
}

std::string found_text(const Hypothesis& term, const FitResult& result) {
  std::string text;
  for (const ParameterEstimate& parameter : estimates_of(term, result))
    text +=
        fmt::format("{}{} = {} ± {}{}", text.empty() ? "" : ", ", parameter.name,
                    value_text(parameter.value, parameter.sigma), significant(parameter.sigma, 2),
                    has_no_unit(parameter.unit) ? "" : " " + parameter.unit);
  if (term.fits_shape || term.shape.empty()) return text;
  std::string known;
  for (const auto& [name, value] : term.shape)
    known += (known.empty() ? "" : ", ") + name + " " + significant(value, 3);
  return text + " (at " + known + ")";
}

std::string accepted_text(const Hypothesis& term, const FitReport& found) {
  const std::string words = words_of(term, found), values = found_text(term, found.result);
  return term.title() + ": " + (words.empty() ? values : words + "\n  " + values);
}

}  // namespace clothfit
