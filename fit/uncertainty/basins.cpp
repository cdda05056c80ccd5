#include "fit/uncertainty/basins.h"

#include <algorithm>
#include <cmath>

#include "fit/uncertainty/parameter_estimates.h"

namespace clothfit {
namespace {

constexpr double kDifferentBasins = 0.05;
constexpr double kDifferentSigmas = 3;

}  // namespace

std::vector<Basin> basins_of(const ParameterSpace& space, std::vector<Candidate> candidates,
                             const Eigen::VectorXd& values, const Uncertainty& uncertainty) {
  const Eigen::VectorXd sigma =
      uncertainty.sigma.cwiseQuotient(space.value_by_coordinate(values)).cwiseAbs();
  const auto differ = [&](const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
    for (int p = 0; p < space.size(); ++p) {
      const FitParameter& parameter = space.parameters[static_cast<size_t>(p)];
      if (!is_physical(parameter.role)) continue;
      const bool logarithmic = parameter.scale == ParameterScale::logarithmic;
      if (logarithmic && !(sigma[p] < kUndeterminedLogSigma)) continue;
      const double share = logarithmic ? 1 : std::max(std::abs(a[p]), std::abs(b[p]));
      const double least = std::max(kDifferentBasins * share, kDifferentSigmas * sigma[p]);
      if (std::abs(a[p] - b[p]) > least) return true;
    }
    return false;
  };
  std::ranges::stable_sort(candidates, {}, &Candidate::cost);
  std::vector<Basin> basins;
  std::vector<Eigen::VectorXd> places;
  for (const Candidate& candidate : candidates) {
    const Eigen::VectorXd place = space.coordinates(candidate.values);
    size_t n = 0;
    while (n < basins.size() && differ(place, places[n])) ++n;
    if (n < basins.size()) {
      basins[n].ended += candidate.runs;
      continue;
    }
    Basin basin{.cost = candidate.cost,
                .ended = candidate.runs,
                .refined = candidate.refined,
                .parameters = {}};
    for (int p = 0; p < space.size(); ++p) {
      const FitParameter& parameter = space.parameters[static_cast<size_t>(p)];
      if (is_physical(parameter.role))
        basin.parameters.push_back({.name = parameter.name, .value = candidate.values[p]});
    }
    basins.push_back(std::move(basin));
    places.push_back(place);
  }
  return basins;
}

}  // namespace clothfit
