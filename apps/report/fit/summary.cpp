#include "apps/report/fit/summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "apps/report/fit/fit_tables.h"
#include "apps/terminal/number_text.h"

namespace clothfit {
namespace {

struct BestTrivial {
  double rms = 0;
  const char* name = "";
};

/// Returns the best of those that can be made; nothing where none can.
std::optional<BestTrivial> best_trivial(const TrivialErrors& trivial) {
  std::vector<BestTrivial> all = {
      {trivial.first_frame, "that the cloth stays as in its first frame"},
      {trivial.last_velocity, "that it moves on with its last velocity"},
      {trivial.rigid, "that it moves rigidly with its held points"}};
  std::erase_if(all, [](const BestTrivial& one) { return !std::isfinite(one.rms); });
  if (all.empty()) return std::nullopt;
  return *std::ranges::min_element(all, {}, &BestTrivial::rms);
}

/// Returns a kind of observation as a sentence has it.
std::string kind_words(const std::string& kind) {
  return kind == "tracks3d" ? "the 3D tracks" : "the pictures of camera " + kind;
}

std::string error_sentence(const ObservationErrors& errors) {
  const ShownUnit unit = shown_unit(errors.unit);
  const auto shown = [&](double value) { return significant(value * unit.factor, 3); };
  std::string text = fmt::format("In {}, it is {} {} rms per coordinate off in the fitted frames",
                                 kind_words(errors.kind), shown(errors.fitted.rms), unit.name);
  if (errors.held_out.count > 0) {
    text += fmt::format(" and {} {} in the {} observations that it never saw",
                        shown(errors.held_out.rms), unit.name, errors.held_out.count);
    if (const auto trivial = best_trivial(errors.trivial)) {
      text += fmt::format(". The best trivial guess there, {}, is {} {} off", trivial->name,
                          shown(trivial->rms), unit.name);
      if (errors.held_out.rms > 0 && trivial->rms > errors.held_out.rms)
        text +=
            fmt::format(" ({} times as much)", significant(trivial->rms / errors.held_out.rms, 2));
    }
  }
  if (errors.noise > 0) {
    text += fmt::format("; the measurements themselves scatter by {} {}", shown(errors.noise),
                        unit.name);
  }
  return text + ".";
}

std::string parameter_sentence(const FitResult& result) {
  int fitted = 0;
  std::vector<std::string> undetermined;
  const auto look = [&](const ParameterEstimate& parameter) {
    if (parameter.state == ParameterState::fitted || parameter.state == ParameterState::ratio)
      ++fitted;
    if (parameter.state == ParameterState::undetermined) undetermined.push_back(parameter.name);
  };
  for (const ParameterEstimate& parameter : result.parameters) look(parameter);
  for (const EffectEstimate& effect : result.effects)
    for (const ParameterEstimate& parameter : effect.parameters) look(parameter);
  std::string text =
      fmt::format("{} {} determined", fitted, fitted == 1 ? "parameter was" : "parameters were");
  if (!undetermined.empty())
    text += fmt::format("; these data do not determine {}", fmt::join(undetermined, ", "));
  return text + ".";
}

/// Says whether a fit is a forecast, which takes every number of the fabric from elsewhere.
bool is_forecast(const FitResult& result) {
  return std::ranges::none_of(result.parameters, [](const ParameterEstimate& parameter) {
    return parameter.name != "areal_density" && parameter.state != ParameterState::fixed;
  });
}

/// The verdict in a sentence, with how it is known.
std::string verdict_sentence(const FitResult& result) {
  const char* grade = "";
  switch (result.verdict) {
    case FitVerdict::good:
      grade = "Good";
      break;
    case FitVerdict::usable_with_care:
      grade = "Usable with care";
      break;
    case FitVerdict::model_lacks:
      grade = is_forecast(result)
                  ? "The model lacks something"
                  : "The model lacks something, and its numbers are not the cloth's";
      break;
    case FitVerdict::do_not_use:
      grade = "Do not use";
      break;
  }
  return result.verdict_reason.empty() ? grade
                                       : fmt::format("{}: {}", grade, result.verdict_reason);
}

/// Names the markers that contradict all others and counts single outliers; empty where there is
/// neither.
std::string contradicting_sentence(const FitResult& result) {
  int outliers = 0;
  for (const ObservationErrors& errors : result.errors) outliers += errors.outliers;
  if (result.contradicting.empty() && outliers == 0) return "";
  std::string text, names;
  constexpr size_t kShown = 6;
  for (size_t k = 0; k < std::min(kShown, result.contradicting.size()); ++k) {
    const ContradictingMarker& marker = result.contradicting[k];
    const ShownUnit unit = shown_unit(marker.kind == "tracks3d" ? "m" : "px");
    names += fmt::format("{}{} ({} {} off in frames {} to {})", k > 0 ? ", " : "", marker.marker,
                         significant(marker.off * unit.factor, 3), unit.name, marker.first_frame,
                         marker.last_frame);
  }
  if (result.contradicting.size() > kShown) names += ", ...";
  if (!names.empty()) text = "Markers that contradict all others: " + names + ". ";
  if (outliers > 0)
    text += fmt::format("{} single observation{} away from a track and back. ", outliers,
                        outliers > 1 ? "s jump" : " jumps");
  text += outliers == 1 && names.empty() ? "Without it" : "Without them";
  bool first = true;
  for (const ObservationErrors& errors : result.errors) {
    if (!errors.fitted_without) continue;
    text += std::exchange(first, false) ? "" : ";";
    const ShownUnit unit = shown_unit(errors.unit);
    text += fmt::format(" it is {} {} off in the fitted frames of {}",
                        significant(errors.fitted_without->rms * unit.factor, 3), unit.name,
                        kind_words(errors.kind));
    if (errors.held_out_without)
      text += fmt::format(" and {} {} in those held out",
                          significant(errors.held_out_without->rms * unit.factor, 3), unit.name);
  }
  return text + ".";
}

}  // namespace

FitSummary summarise(const FitReport& report) {
  const FitResult& result = report.result;
  FitSummary summary;
  summary.verdict = verdict_sentence(result);
  summary.contradicting = contradicting_sentence(result);
  summary.paragraph =
      fmt::format("A simulated cloth of {} x {} masses ", result.mesh_columns, result.mesh_rows);
  summary.paragraph +=
      is_forecast(result)
          ? fmt::format(
                "with the parameters of an earlier fit was compared with {} observations of "
                "the recording “{}”; nothing was fitted.",
                result.observations_used, result.recording)
          : fmt::format("was fitted to {} observations of the recording “{}”. {}",
                        result.observations_used, result.recording,
                        result.usable() ? parameter_sentence(result) : "");
  for (const ObservationErrors& errors : result.errors)
    summary.paragraph += fmt::format(" {}", error_sentence(errors));
  return summary;
}

}  // namespace clothfit
