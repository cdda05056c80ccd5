#include "fit/search/search_parameter.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "data/input_error.h"

namespace clothfit {

double SearchParameter::fraction(double value) const {
  if (!log_scale) return (value - lower) / (upper - lower);
  return std::log(value / lower) / std::log(upper / lower);
}

double SearchParameter::value_at(double fraction) const {
  const double value = log_scale ? lower * std::exp(fraction * std::log(upper / lower))
                                 : lower + fraction * (upper - lower);
  return std::clamp(value, lower, upper);
}

void require_ranges(const std::vector<SearchParameter>& parameters) {
  if (parameters.empty()) throw InputError("search", "no parameter to search", "at least one");
  for (const SearchParameter& parameter : parameters) {
    std::ostringstream range;
    range << "range [" << parameter.lower << ", " << parameter.upper << "]";
    if (!std::isfinite(parameter.lower) || !std::isfinite(parameter.upper) ||
        !(parameter.lower < parameter.upper))
      throw InputError(parameter.name, range.str(), "a finite lower end below a finite upper end");
    if (parameter.log_scale && !(parameter.lower > 0))
      throw InputError(parameter.name, range.str(),
                       "a logarithmic scale needs a lower end above 0");
  }
}

double reflected(double x) {
  x = std::fmod(std::abs(x), 2.0);
  return x > 1 ? 2 - x : x;
}

}  // namespace clothfit
