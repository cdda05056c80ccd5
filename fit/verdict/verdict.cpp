#include "fit/verdict/verdict.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace clothfit {
namespace {

/// Says whether a guess predicts held-out frames of some kind of observation as well as the model.
const ObservationErrors* no_better_than_a_guess(const FitResult& result) {
  for (const ObservationErrors& errors : result.errors) {
    const ErrorSummary& held_out = errors.held_out_without.value_or(errors.held_out);
    if (held_out.count == 0) continue;
    // One that cannot be made is NaN, which fmin passes over.
    const double guess = std::fmin(errors.trivial.first_frame,
                                   std::fmin(errors.trivial.last_velocity, errors.trivial.rigid));
    if (held_out.rms >= guess) return &errors;
  }
  return nullptr;
}

template <class Visit>
void for_each_physical(FitResult& result, const Visit& visit) {
  for (ParameterEstimate& parameter : result.parameters) visit(parameter);
  for (EffectEstimate& effect : result.effects)
    for (ParameterEstimate& parameter : effect.parameters) visit(parameter);
}

/// Says whether a fit determined nothing of what it looked for; a forecast looks for nothing.
bool determines_nothing(FitResult& result) {
  int determined = 0, sought = 0;
  for_each_physical(result, [&](const ParameterEstimate& parameter) {
    if (parameter.state == ParameterState::fixed || parameter.name == "areal_density") return;
    ++sought;
    if (parameter.state != ParameterState::undetermined) ++determined;
  });
  return sought > 0 && determined == 0;
}

/// Says whether no sigma was estimated, for the model leaves too much (FitOptions::coarse_beyond).
bool states_no_sigma(FitResult& result) {
  bool any = false, all_zero = true;
  for_each_physical(result, [&](const ParameterEstimate& parameter) {
    const bool claims =
        parameter.state == ParameterState::fitted || parameter.state == ParameterState::ratio;
    any = any || claims;
    all_zero = all_zero && (!claims || parameter.sigma == 0);
  });
  return any && all_zero;
}

void withdraw(FitResult& result) {
  const auto turn = [](ParameterEstimate& parameter) {
    if (parameter.state != ParameterState::fitted && parameter.state != ParameterState::ratio)
      return;
    parameter.state = ParameterState::misfit;
    parameter.reason.clear();
    parameter.interval_90.reset();
    parameter.bootstrap_90.reset();
    parameter.interval_by_profile = false;
  };
  for_each_physical(result, turn);
  for (ParameterEstimate& parameter : result.nuisance) turn(parameter);
}

std::string times(double ratio) {
  return ratio < 10 ? fmt::format("{:.1f} times", ratio) : fmt::format("{:.0f} times", ratio);
}

}  // namespace

ErrorsOverFloor errors_over_floor(const FitResult& result) {
  ErrorsOverFloor worst;
  for (const ObservationErrors& errors : result.errors) {
    if (!(errors.noise > 0)) continue;
    const ErrorSummary& fitted = errors.fitted_without.value_or(errors.fitted);
    const ErrorSummary& held_out = errors.held_out_without.value_or(errors.held_out);
    worst.fitted = std::max(worst.fitted, fitted.rms / errors.fitted_floor());
    if (held_out.count > 0)
      worst.held_out = std::max(worst.held_out, held_out.rms / errors.held_out_floor());
  }
  return worst;
}

void judge(FitResult& result) {
  const ErrorsOverFloor over = errors_over_floor(result);
  const bool held_out = std::ranges::any_of(result.errors, [](const ObservationErrors& one) {
    return one.held_out_without.value_or(one.held_out).count > 0;
  });
  const bool lacks = over.worst() > kVerdict.usable || states_no_sigma(result);
  const auto say = [&](FitVerdict verdict, const std::string& reason) {
    result.verdict = verdict;
    result.verdict_reason = reason;
  };
  const std::string misfit = fmt::format(
      "it is off by {} the floor in the fitted frames{}", times(over.fitted),
      held_out ? fmt::format(" and by {} in those it never saw", times(over.held_out)) : "");
  if (const ObservationErrors* kind = no_better_than_a_guess(result))
    say(FitVerdict::do_not_use,
        fmt::format("a guess that knows no physics predicts the held-out frames of {} better; {}",
                    kind->kind, misfit));
  else if (determines_nothing(result))
    say(FitVerdict::do_not_use, "these data determine no parameter");
  else if (lacks)
    say(FitVerdict::model_lacks, misfit);
  else if (!held_out)
    say(FitVerdict::usable_with_care, "nothing was held out to judge it by; " + misfit);
  else if (over.worst() > kVerdict.good)
    say(FitVerdict::usable_with_care, misfit);
  else if (result.contradicts_pose)
    say(FitVerdict::usable_with_care,
        "gravity ended far from where the camera's pose has it; " + misfit);
  else if (!result.converged)
    say(FitVerdict::usable_with_care,
        "the fit reached its limit of work before it converged; " + misfit);
  else
    say(FitVerdict::good, fmt::format("in frames it never saw it is off by {} the floor, the "
                                      "noise with what mesh and time step make",
                                      times(over.held_out)));
  if (lacks) withdraw(result);
}

}  // namespace clothfit
