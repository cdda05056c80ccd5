#include "fit/diagnosis/worth.h"

#include <algorithm>
#include <cmath>

#include "fit/diagnosis/criteria.h"

namespace clothfit {

double least_decrease(Eigen::Index amplitudes) {
  return kCriteria.least_decrease +
         kCriteria.least_decrease_per_amplitude * static_cast<double>(amplitudes - 1);
}

double sure_excess(const FittedModel& model, double threshold) {
  const auto count = static_cast<double>(model.residual_count());
  return std::max(0.0, model.chi_square(threshold) - count - 2 * std::sqrt(2 * count));
}

double worth_naming(const FittedModel& model, double threshold, double explained) {
  const auto count = static_cast<double>(model.residual_count());
  const double all = model.chi_square(threshold);
  const double of_much = std::max(kCriteria.of_all * all, kCriteria.of_noise * count);
  return std::max({kCriteria.noise_known * count,
                   kCriteria.form_known * kCriteria.form_known * explained,
                   std::min(kCriteria.of_excess * sure_excess(model, threshold), of_much)});
}

double price_of_amplitudes(const FittedModel& model) {
  double amplitudes = 0;
  for (const Hypothesis& hypothesis : model.hypotheses)
    amplitudes += static_cast<double>(hypothesis.number_count());
  return amplitudes * std::log(static_cast<double>(model.residual_count()));
}

}  // namespace clothfit
