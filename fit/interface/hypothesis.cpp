#include "fit/interface/hypothesis.h"

#include <algorithm>

namespace clothfit {

std::string Hypothesis::title() const {
  std::string which = mode;
  for (const auto& [parameter, number] : picked)
    which += (which.empty() ? "" : ", ") + (parameter == "point" ? "held point" : parameter) + " " +
             std::to_string(number);
  return which.empty() ? effect : effect + " (" + which + ")";
}

std::vector<std::string> Hypothesis::parameters() const {
  std::vector<std::string> names;
  for (const std::string& amplitude : amplitudes) names.push_back(effect + "." + amplitude);
  return names;
}

std::string title(const std::vector<Hypothesis>& hypotheses) {
  std::string text;
  for (const Hypothesis& hypothesis : hypotheses)
    text += (text.empty() ? "" : " + ") + hypothesis.title();
  return text.empty() ? "base" : text;
}

bool share_shape(const Hypothesis& one, const Hypothesis& other) {
  return one.effect == other.effect && std::ranges::any_of(one.shape, [&](const auto& number) {
           return other.shape.contains(number.first);
         });
}

}  // namespace clothfit
