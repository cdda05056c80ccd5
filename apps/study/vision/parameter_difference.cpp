#include "apps/study/vision/parameter_difference.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace clothfit {
namespace {

const ChainNumber* number_named(const std::vector<ChainNumber>& numbers, const std::string& name) {
  const auto found = std::ranges::find(numbers, name, &ChainNumber::name);
  return found == numbers.end() ? nullptr : &*found;
}

void add_fitted(const std::string& prefix, const std::vector<ParameterEstimate>& parameters,
                std::vector<ChainNumber>& numbers) {
  for (const ParameterEstimate& one : parameters)
    if (one.state == ParameterState::fitted || one.state == ParameterState::ratio)
      numbers.push_back(
          {.name = prefix + one.name, .unit = one.unit, .value = one.value, .sigma = one.sigma});
}

}  // namespace

double value_of(const std::vector<ChainNumber>& numbers, const std::string& name) {
  const ChainNumber* const number = number_named(numbers, name);
  return number != nullptr ? number->value : ChainNumber().value;
}

std::vector<ChainNumber> fitted_parameters(const FitResult& result) {
  std::vector<ChainNumber> numbers;
  add_fitted("", result.parameters, numbers);
  for (const EffectEstimate& effect : result.effects)
    add_fitted(effect.name + ".", effect.parameters, numbers);
  return numbers;
}

void compare_parameters(std::vector<ChainNumber>& parameters,
                        const std::vector<ChainNumber>& reference) {
  for (const ChainNumber& other : reference) {
    if (std::isnan(other.sigma)) continue;  // no parameter
    const auto own = std::ranges::find(parameters, other.name, &ChainNumber::name);
    if (own == parameters.end())
      parameters.push_back({.name = other.name,
                            .unit = other.unit,
                            .over_sigma = std::numeric_limits<double>::infinity()});
    else
      own->over_sigma = std::abs(own->value - other.value) / std::hypot(own->sigma, other.sigma);
  }
}

const ChainNumber* furthest(const std::vector<ChainNumber>& numbers) {
  const ChainNumber* most = nullptr;
  for (const ChainNumber& number : numbers)
    if (number.over_sigma >= (most != nullptr ? most->over_sigma : 0)) most = &number;
  return most;
}

}  // namespace clothfit
