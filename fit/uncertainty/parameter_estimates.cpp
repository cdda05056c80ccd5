#include "fit/uncertainty/parameter_estimates.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace clothfit {
namespace {

/// A linear parameter is undetermined when its sigma nears that of a uniform draw from its range.
/// That is 1 / sqrt(12) of the range.
constexpr double kUndeterminedRangeShare = 0.25;

/// Parameters more strongly correlated than this do about the same to the motion.
constexpr double kAlike = 0.95;

ParameterEstimate estimate(const FitParameter& parameter, const std::string& name, double value,
                           double sigma, double roughness) {
  ParameterEstimate result{.name = name, .unit = parameter.unit, .value = value, .sigma = sigma};
  const bool logarithmic = parameter.scale == ParameterScale::logarithmic;
  const double edge = logarithmic ? 1e-3 * value : 1e-6 * (parameter.upper - parameter.lower);
  const double relative = sigma / value;
  if (logarithmic && !(relative < kUndeterminedLogSigma)) {
    result.state = ParameterState::undetermined;
    const bool vanishes = value < parameter.searched_from();
    result.reason =
        vanishes ? fmt::format("it is 0 within its error: at most {:.2g} {} (two sigma)",
                               value + 2 * sigma, parameter.unit)
                 : fmt::format("the motion hardly depends on it (sigma {:.0f} % of the value)",
                               100 * std::min(relative, 1e4));
    if (!vanishes) result.sigma = std::min(sigma, 1e4 * value);
  } else if (!logarithmic && is_physical(parameter.role) &&
             !(sigma < kUndeterminedRangeShare * (parameter.upper - parameter.lower))) {
    result.state = ParameterState::undetermined;
    result.reason = fmt::format("the motion hardly depends on it (sigma {:.0f} % of its range)",
                                100 * std::min(sigma / (parameter.upper - parameter.lower), 1e4));
    result.sigma = std::min(sigma, 1e4 * (parameter.upper - parameter.lower));
  } else if (roughness > kRoughSlope) {
    result.state = ParameterState::undetermined;
    result.reason = fmt::format(
        "the cost is rough here (its slope over 0.01 % is {:.0f} times that over 2 %), as where "
        "cloth folds and unfolds: sigma means nothing",
        roughness);
  } else if (value - parameter.lower < edge || parameter.upper - value < edge) {
    // The lower end of what has no sign is as good as none of it.
    const bool at_neutral = parameter.role == ParameterRole::effect && parameter.lower >= 0 &&
                            value - parameter.lower < edge;
    if (!at_neutral) {
      result.state = ParameterState::undetermined;
      result.reason = fmt::format("it ended at the {} end of its range",
                                  value - parameter.lower < edge ? "lower" : "upper");
    }
  }
  return result;
}

/// Turns what scales with the mass into ratios to it.
void give_ratios(double areal_density, FitResult& result) {
  const auto turn = [&](ParameterEstimate& parameter) {
    const int exponent = mass_exponent(parameter.unit);
    const bool given = parameter.state == ParameterState::fixed;
    if (given || exponent == 0 || parameter.name == "areal_density") return;
    parameter = scaled(parameter, std::pow(areal_density, -exponent));
    parameter.unit += exponent > 0 ? kPerArealDensity : kTimesArealDensity;
    if (parameter.state == ParameterState::fitted) parameter.state = ParameterState::ratio;
  };
  for (ParameterEstimate& parameter : result.parameters) turn(parameter);
  for (EffectEstimate& effect : result.effects)
    for (ParameterEstimate& parameter : effect.parameters) turn(parameter);
}

ParameterEstimate constant(const std::string& name, const std::string& unit, double value,
                           const std::string& reason) {
  return {.name = name,
          .unit = unit,
          .value = value,
          .sigma = 0,
          .state = ParameterState::fixed,
          .reason = reason};
}

/// Returns the parameter that is hardest to tell from the p-th, and their correlation.
std::pair<int, double> nearest_parameter(const Eigen::MatrixXd& correlation, int p) {
  std::pair<int, double> nearest{-1, 0};
  for (int other = 0; other < static_cast<int>(correlation.cols()); ++other)
    if (other != p && std::abs(correlation(p, other)) > std::abs(nearest.second))
      nearest = {other, correlation(p, other)};
  return nearest;
}

/// Says in brackets what a parameter is that is not the cloth's.
const char* what_it_is(ParameterRole role) {
  switch (role) {
    case ParameterRole::placement:
      return " (how the scene was placed)";
    case ParameterRole::measurement:
      return " (how it was measured)";
    case ParameterRole::start:
      return " (where the cloth was at the start)";
    case ParameterRole::drive:
      return " (what the drive's track is off by)";
    case ParameterRole::springs:
    case ParameterRole::effect:
      break;
  }
  return "";
}

/// Says so where a parameter is undetermined because another one does the same. That may be the
/// place of the cloth or the camera, or the scale of gravity.
void explain_by_correlation(const ParameterSpace& space, const Uncertainty& uncertainty, int p,
                            ParameterEstimate& parameter) {
  if (parameter.state != ParameterState::undetermined) return;
  const auto [other, correlation] = nearest_parameter(uncertainty.correlation, p);
  if (other < 0 || !(std::abs(correlation) > kAlike)) return;
  const FitParameter& alike = space.parameters[static_cast<size_t>(other)];
  parameter.reason += fmt::format("; it can hardly be told from {}{} (correlation {:.3f})",
                                  alike.name, what_it_is(alike.role), correlation);
}

/// Withdraws a parameter that another one at an end of its range moves by more than it is sure.
void explain_by_bound(const ParameterSpace& space, const Uncertainty& uncertainty, int p,
                      ParameterEstimate& parameter) {
  if (uncertainty.bound_by < 0 || parameter.state != ParameterState::fitted) return;
  const double shift = std::abs(uncertainty.bound_shift[p]);
  const double own = std::sqrt(std::max(0.0, std::pow(uncertainty.sigma[p], 2) - shift * shift));
  if (!(shift > own)) return;
  parameter.state = ParameterState::undetermined;
  parameter.reason = fmt::format(
      "it trades with {}, which ended at an end of its range, and would move by more than its "
      "standard deviation beyond that",
      space.parameters[static_cast<size_t>(uncertainty.bound_by)].name);
}

/// Adds the intervals of the p-th parameter.
void add_intervals(int p, const Uncertainty& uncertainty, const FurtherLooks& looks,
                   ParameterEstimate& parameter) {
  if (looks.other_mesh.usable) parameter.mesh_shift = looks.other_mesh.shift[p];
  if (parameter.state != ParameterState::fitted) return;
  parameter.interval_90 = {.lower = uncertainty.lower[p], .upper = uncertainty.upper[p]};
  if (uncertainty.bootstrap_lower.size() > 0)
    parameter.bootstrap_90 = {.lower = uncertainty.bootstrap_lower[p],
                              .upper = uncertainty.bootstrap_upper[p]};
  const auto profile = std::ranges::find(looks.profiles, p, &ParameterProfile::parameter);
  if (profile == looks.profiles.end() || !profile->profiled || !profile->profile.preferable())
    return;
  parameter.interval_90 = {.lower = profile->lower, .upper = profile->upper};
  parameter.interval_by_profile = true;
}

}  // namespace

void explain_by_strain_limit(const FitProblem& problem, const Eigen::VectorXd& values,
                             const SpringsOnLimit& count,
                             std::vector<ParameterEstimate>& parameters) {
  Eigen::VectorXd numbers(static_cast<Eigen::Index>(problem.spring_numbers.size()));
  for (size_t n = 0; n < problem.spring_numbers.size(); ++n)
    numbers[static_cast<Eigen::Index>(n)] = problem.spring_numbers[n].value(values);
  const Eigen::MatrixXd springs = springs_by_numbers(problem.spring_set, numbers);
  const std::vector<SpringNumber> names = numbers_of(problem.spring_set);
  for (size_t n = 0; n < names.size(); ++n) {
    if (names[n].quantity != SpringQuantity::stiffness) continue;
    if (problem.spring_numbers[n].parameter < 0) continue;
    long on = 0, all = 0;
    for (size_t type = 0; type < kSpringTypes; ++type) {
      const auto row = static_cast<Eigen::Index>(stiffness_block + type);
      if (springs(row, static_cast<Eigen::Index>(n)) == 0) continue;
      on += count.on[type];
      all += count.all[type];
    }
    if (2 * on <= all) continue;
    const auto found = std::ranges::find(parameters, names[n].name, &ParameterEstimate::name);
    assert(found != parameters.end());
    found->state = ParameterState::undetermined;
    found->interval_90.reset();
    found->bootstrap_90.reset();
    found->interval_by_profile = false;
    found->reason = fmt::format(
        "{:.0f} % of its springs sit on their strain limit in the fitted frames, as long as that "
        "allows however stiff they are",
        100.0 * static_cast<double>(on) / static_cast<double>(all));
  }
}

void fill_parameters(const FitProblem& problem, const FitOptions& options,
                     const Eigen::VectorXd& values, const Uncertainty& uncertainty,
                     const FurtherLooks& looks, FitResult& result) {
  const auto estimate_of = [&](int p, const std::string& name) {
    ParameterEstimate parameter =
        estimate(problem.space.parameters[static_cast<size_t>(p)], name, values[p],
                 uncertainty.sigma[p], uncertainty.roughness[p]);
    explain_by_correlation(problem.space, uncertainty, p, parameter);
    explain_by_bound(problem.space, uncertainty, p, parameter);
    add_intervals(p, uncertainty, looks, parameter);
    return parameter;
  };
  const double area_m2 = problem.cloth.mesh.width_m * problem.cloth.mesh.height_m;
  ParameterEstimate density =
      constant("areal_density", "kg/m2", problem.cloth_mass_kg / area_m2, "weighed");
  if (problem.mass_assumed) {
    density.state = ParameterState::undetermined;
    density.reason =
        "the cloth was not weighed: only ratios to mass are determined, and the model that is "
        "written takes this value";
  }
  result.parameters.push_back(density);

  for (int p = 0; p < problem.space.size(); ++p) {
    const FitParameter& parameter = problem.space.parameters[static_cast<size_t>(p)];
    if (parameter.role == ParameterRole::effect || !is_listed(parameter.role)) continue;
    auto& list = parameter.role == ParameterRole::springs ? result.parameters : result.nuisance;
    list.push_back(estimate_of(p, parameter.name));
  }
  if (options.forecast) {
    for (const ParameterEstimate& known : options.forecast->parameters)
      if (known.name != "areal_density")
        result.parameters.push_back(constant(known.name, known.unit, known.value, "given"));
  }
  for (size_t e = 0; e < problem.effects.size(); ++e) {
    const EffectDescription& description = problem.cloth.effect_descriptions[e];
    EffectEstimate effect{.name = description.name, .parameters = {}};
    for (size_t p = 0; p < description.parameters.size(); ++p) {
      const Binding& binding = problem.effects[e][p];
      const EffectParameter& parameter = description.parameters[p];
      effect.parameters.push_back(binding.parameter >= 0
                                      ? estimate_of(binding.parameter, parameter.name)
                                      : constant(parameter.name, parameter.unit, binding.constant,
                                                 options.forecast ? "given" : "declared"));
    }
    result.effects.push_back(std::move(effect));
  }
  for (const FitProblem::MeasurementTerm& term : problem.measurement)
    for (size_t p = 0; p < term.parameters.size(); ++p)
      if (const Binding& binding = term.parameters[p]; binding.parameter < 0) {
        const EffectParameter& parameter = term.description.parameters[p];
        result.nuisance.push_back(constant(term.description.name + "." + parameter.name,
                                           parameter.unit, binding.constant, "declared"));
      }
  if (problem.mass_assumed) give_ratios(density.value, result);
}

}  // namespace clothfit
