#include "apps/report/fit/summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "apps/report/fit/fit_tables.h"
#include "apps/terminal/number_text.h"

namespace clothfit {
namespace {

struct BestTrivial {
  double rms = 0;
  const char* name = "";
};

BestTrivial best_trivial(const TrivialErrors& trivial) {
  const std::vector<BestTrivial> all = {
      {trivial.first_frame, "that the cloth stays as in its first frame"},
      {trivial.last_velocity, "that it moves on with its last velocity"},
      {trivial.rigid, "that it moves rigidly with its held points"}};
  return *std::min_element(all.begin(), all.end(),
                           [](const auto& a, const auto& b) { return a.rms < b.rms; });
}

/// A held-out error up to this many times the noise counts as "explained to the noise". 10 % more
/// than noise alone in rms is 20 % in chi-square, which hundreds of observations show.
constexpr double kNearNoise = 1.1;

enum class Grade { to_the_noise, useful, useless };

Grade grade(const ObservationErrors& errors) {
  if (!(errors.held_out.rms < best_trivial(errors.trivial).rms)) return Grade::useless;
  const bool near = errors.noise > 0 && errors.held_out.rms <= kNearNoise * errors.noise;
  return near ? Grade::to_the_noise : Grade::useful;
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
    const BestTrivial trivial = best_trivial(errors.trivial);
    text += fmt::format(
        " and {} {} in the {} observations that it never saw. The best trivial guess there, {}, "
        "is {} {} off",
        shown(errors.held_out.rms), unit.name, errors.held_out.count, trivial.name,
        shown(trivial.rms), unit.name);
    if (errors.held_out.rms > 0 && trivial.rms > errors.held_out.rms)
      text += fmt::format(" ({} times as much)", significant(trivial.rms / errors.held_out.rms, 2));
  }
  if (errors.noise > 0) {
    text += fmt::format("; the measurements themselves scatter by {} {}", shown(errors.noise),
                        unit.name);
  }
  return text + ".";
}

/// Says whether a fit is a forecast, which takes every number of the fabric from elsewhere.
bool is_forecast(const FitResult& result) {
  return std::ranges::none_of(result.parameters, [](const ParameterEstimate& parameter) {
    return parameter.name != "areal_density" && parameter.state != ParameterState::fixed;
  });
}

std::string parameter_sentence(const FitResult& result) {
  int fitted = 0;
  std::vector<std::string> undetermined;
  const auto look = [&](const ParameterEstimate& parameter) {
    if (parameter.state == ParameterState::fitted) ++fitted;
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

}  // namespace

FitSummary summarise(const FitReport& report) {
  const FitResult& result = report.result;
  FitSummary summary;

  bool judged = !result.errors.empty();
  Grade worst = Grade::to_the_noise;
  for (const ObservationErrors& errors : result.errors) {
    judged = judged && errors.held_out.count > 0;
    if (judged) worst = std::max(worst, grade(errors));
  }
  if (!judged) {
    summary.verdict = "Not judged: nothing was held out";
  } else if (worst == Grade::to_the_noise) {
    summary.verdict = "The model predicts frames it never saw as well as they were measured";
  } else if (worst == Grade::useful) {
    summary.verdict =
        "The model predicts frames it never saw better than trivial guesses, but not to the noise";
  } else {
    summary.verdict = "Do not use: a trivial guess predicts the held-out frames better";
  }

  summary.paragraph =
      fmt::format("A simulated cloth of {} x {} masses ", result.mesh_columns, result.mesh_rows);
  summary.paragraph +=
      is_forecast(result)
          ? fmt::format(
                "with the parameters of an earlier fit was compared with {} observations of "
                "the recording “{}”; nothing was fitted.",
                result.observations_used, result.recording)
          : fmt::format("was fitted to {} observations of the recording “{}”. {}",
                        result.observations_used, result.recording, parameter_sentence(result));
  for (const ObservationErrors& errors : result.errors)
    summary.paragraph += fmt::format(" {}", error_sentence(errors));
  if (judged && worst == Grade::useful)
    summary.paragraph +=
        " The gap between error and noise is motion that this model does not have, or error of "
        "cameras and markers.";
  return summary;
}

}  // namespace clothfit
