#include "fit/diagnosis/limits.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "fit/diagnosis/clearance.h"
#include "fit/diagnosis/criteria.h"
#include "fit/problem/effects_of.h"

namespace clothfit {
namespace {

const EffectParameter& parameter_named(const EffectDescription& effect, const std::string& name) {
  return *std::ranges::find(effect.parameters, name, &EffectParameter::name);
}

/// Returns the limits of a hypothesis. From `least` standard deviations on an amplitude would be
/// accepted.
DetectionLimit limit_of(const Score& score, double least) {
  DetectionLimit limit{.hypothesis = score.hypothesis,
                       .parameter = score.hypothesis.amplitudes,
                       .unit = {},
                       .limit = {},
                       .found = {},
                       .decrease = score.decrease};
  const auto each = static_cast<Eigen::Index>(score.hypothesis.amplitudes.size());
  limit.limit = least * score.sigma.head(each);
  limit.found = score.amplitude.head(each);
  for (Eigen::Index k = each; k < score.sigma.size(); ++k) {
    if (!(least * score.sigma[k] < limit.limit[k % each])) continue;
    limit.limit[k % each] = least * score.sigma[k];
    limit.found[k % each] = score.amplitude[k];
  }
  const EffectDescription effect = describe_effect(score.hypothesis.effect);
  for (const std::string& name : limit.parameter)
    limit.unit.push_back(parameter_named(effect, name).unit);
  return limit;
}

}  // namespace

std::vector<DetectionLimit> detection_limits(const FittedModel& model, const Adequacy& structure,
                                             const std::vector<Score>& scores, double worth) {
  const double clear =
      kCriteria.clear_of_neutral * std::sqrt(std::max(1.0, structure.chi_square_per_dof));
  const double least = typical_roughness(model) * std::max(clear, std::sqrt(worth));
  std::vector<DetectionLimit> limits;
  for (const Score& score : scores) limits.push_back(limit_of(score, least));
  return limits;
}

std::vector<Plant> plants_of(const std::vector<DetectionLimit>& limits) {
  struct Choice {
    Plant plant;
    double share = 0;  ///< of a typical amplitude
  };
  std::vector<Choice> choices;
  for (const DetectionLimit& limit : limits) {
    const EffectDescription effect = describe_effect(limit.hypothesis.effect);
    for (Eigen::Index k = 0; k < limit.limit.size(); ++k) {
      const EffectParameter& parameter =
          parameter_named(effect, limit.parameter[static_cast<size_t>(k)]);
      double beyond = kCriteria.planted_above_limit * limit.limit[k];
      if (parameter.neutral + beyond > parameter.upper) beyond = -beyond;
      if (!std::isfinite(beyond) || parameter.neutral + beyond < parameter.lower ||
          parameter.neutral + beyond > parameter.upper)
        continue;
      const Choice choice{.plant = {.hypothesis = limit.hypothesis,
                                    .parameter = parameter.name,
                                    .beyond_neutral = beyond},
                          .share = std::abs(beyond) / parameter.typical};
      const auto same = std::ranges::find_if(choices, [&](const Choice& known) {
        return known.plant.hypothesis.effect == limit.hypothesis.effect;
      });
      if (same == choices.end())
        choices.push_back(choice);
      else if (choice.share < same->share)
        *same = choice;
    }
  }
  std::ranges::stable_sort(choices, {}, &Choice::share);
  std::vector<Plant> plants;
  for (Choice& choice : choices) plants.push_back(std::move(choice.plant));
  return plants;
}

}  // namespace clothfit
