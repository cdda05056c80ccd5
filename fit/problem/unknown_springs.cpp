#include <algorithm>
#include <array>
#include <cmath>

#include "data/input_error.h"
#include "fit/problem/unknown_group.h"
#include "model/fabric/fabric_conversion.h"

/// The springs' numbers: stiffnesses, retardation times, and what else their set has.
namespace clothfit {
namespace {

/// A range of the search.
struct Range {
  double lower = 0, upper = 0;
};

/// Derives the range from the cloth's load: a spring beside a held corner bears about half the
/// weight F. Tension stiffness lies between F / a (twice as long) and 100 F / a (1 % longer), for
/// the recording's own spacing a. Shear and flexion reach far below. So do all where a strain limit
/// carries the rest.
Range range_of(const SpringNumber& number, SpringSet set, double unit_n_per_m, double flat_m) {
  switch (number.quantity) {
    case SpringQuantity::retardation_time:
      return {1e-5, 2e-2};
    case SpringQuantity::natural_length:
      return {0.8 * flat_m, 1.25 * flat_m};
    case SpringQuantity::critical_elongation:
      return {0.01, 1};
    case SpringQuantity::stiffness:
      break;
  }
  if (set != SpringSet::fabric) return {0.02 * unit_n_per_m, 100 * unit_n_per_m};
  if (number.type <= structural_s) return {unit_n_per_m, 100 * unit_n_per_m};
  if (number.type <= shear_up) return {0.02 * unit_n_per_m, 50 * unit_n_per_m};
  return {0.01 * unit_n_per_m, 25 * unit_n_per_m};
}

/// Says whether a number may vanish. Limp cloth has hardly any flexion or shear.
bool may_vanish(const SpringNumber& number, SpringSet set) {
  return set == SpringSet::fabric && number.type > structural_s &&
         number.quantity == SpringQuantity::stiffness;
}

class SpringUnknowns final : public UnknownGroup {
 public:
  void declare(const ProblemSource& source, FitProblem& problem) const override {
    const FitOptions& options = source.options;
    const ClothDescription& cloth = source.input.recording.cloth;
    const double spacing_m =
        0.5 * (cloth.width_m / (cloth.mesh_columns - 1) + cloth.height_m / (cloth.mesh_rows - 1));
    const double gravity = std::max(problem.gravity_m_per_s2.norm(), 1.0);
    const double unit_n_per_m = 0.5 * problem.cloth_mass_kg * gravity / spacing_m;
    const std::array<double, kSpringTypes> flat_m = flat_lengths(problem.cloth.mesh);

    problem.spring_set = options.spring_set;
    if (problem.spring_set != SpringSet::fabric)
      problem.cloth.strain_limit.mode = StrainLimitMode::positions;
    for (const SpringNumber& number : numbers_of(problem.spring_set)) {
      Binding binding;
      if (options.forecast) {
        const auto& known = options.forecast->parameters;
        const auto found = std::ranges::find(known, number.name, &ParameterEstimate::name);
        if (found == known.end())
          throw InputError("FitOptions::forecast",
                           "the fit holds no parameter '" + number.name + "'",
                           "a fit.json of the parameter set " + to_string(problem.spring_set));
        binding.constant = found->value;
      } else {
        const Range range = range_of(number, problem.spring_set, unit_n_per_m,
                                     flat_m[static_cast<size_t>(number.type)]);
        // At a thousandth of the range's lower end it does nothing to the motion.
        constexpr double kNothing = 1e-3;
        const bool vanishes = options.to_nothing && may_vanish(number, problem.spring_set);
        binding.parameter = problem.space.size();
        problem.space.parameters.push_back(
            {.name = number.name,
             .unit = number.unit,
             .role = ParameterRole::springs,
             .scale = ParameterScale::logarithmic,
             .lower = vanishes ? kNothing * range.lower : range.lower,
             .upper = range.upper,
             .search_lower = range.lower,
             .start = std::sqrt(range.lower * range.upper)});
      }
      problem.spring_numbers.push_back(binding);
    }
  }

  void apply(const FitProblem& problem, const Eigen::VectorXd& values,
             ParameterSet& set) const override {
    set.springs =
        springs_of(problem.spring_set, spring_numbers(problem, values), problem.cloth.mesh);
  }

  void differentiate(const FitProblem& problem, const Eigen::VectorXd& values,
                     const Eigen::VectorXd& slope, std::vector<Direction>& along) const override {
    const Eigen::MatrixXd springs =
        springs_by_numbers(problem.spring_set, spring_numbers(problem, values));
    for (size_t n = 0; n < problem.spring_numbers.size(); ++n) {
      const Binding& binding = problem.spring_numbers[n];
      if (binding.parameter < 0) continue;
      const SpringParameters change = springs_of(
          SpringVector(slope[binding.parameter] * springs.col(static_cast<Eigen::Index>(n))));
      Direction& direction = along[static_cast<size_t>(binding.parameter)];
      direction.natural_length_m = change.natural_length_m;
      direction.stiffness_n_per_m = change.stiffness_n_per_m;
      direction.damping_ns_per_m = change.damping_ns_per_m;
      direction.critical_elongation = change.critical_elongation;
    }
  }
};

}  // namespace

Eigen::VectorXd spring_numbers(const FitProblem& problem, const Eigen::VectorXd& values) {
  Eigen::VectorXd numbers(static_cast<Eigen::Index>(problem.spring_numbers.size()));
  for (size_t n = 0; n < problem.spring_numbers.size(); ++n)
    numbers[static_cast<Eigen::Index>(n)] = problem.spring_numbers[n].value(values);
  return numbers;
}

const UnknownGroup& spring_unknowns() {
  static const SpringUnknowns group;
  return group;
}

}  // namespace clothfit
