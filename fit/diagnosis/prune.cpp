#include "fit/diagnosis/prune.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "fit/diagnosis/beam.h"
#include "fit/diagnosis/catalogue.h"
#include "fit/diagnosis/refit.h"
#include "fit/diagnosis/search_context.h"
#include "fit/diagnosis/worth.h"

namespace clothfit {
namespace {

/// Fits the model without its hypothesis `k`. Others of the same effect keep its shape. Where it
/// leaves far more than is worth a name, it is not fitted to the end.
FittedModel without(const SearchContext& search, const FittedModel& model, size_t k) {
  std::vector<Hypothesis> hypotheses = model.hypotheses;
  const Hypothesis dropped = hypotheses[k];
  hypotheses.erase(hypotheses.begin() + static_cast<std::ptrdiff_t>(k));
  for (Hypothesis& hypothesis : hypotheses) {
    if (!share_shape(hypothesis, dropped)) continue;
    hypothesis = at_shapes_of({dropped}, model.values().front(), {hypothesis}).front();
    hypothesis.fits_shape = hypothesis.fits_shape || dropped.fits_shape;
  }
  FittedModel result = with_hypotheses(search.setup, model, hypotheses, {});
  refine_model(result, search.setup, kNearEnough, search.progress);
  if (!result.usable()) return result;
  const double rise = search.left_by(result) - search.left_by(model);
  if (rise < kNearEnoughFallsBy * search.worth(result))
    refine_model(result, search.setup, {}, search.progress);
  return result;
}

bool made_up_for_another(const BeamEntry& entry, size_t k) {
  const auto own = entry.accepted.begin() + static_cast<std::ptrdiff_t>(k);
  return std::any_of(entry.accepted.begin(), own,
                     [](const AcceptedEffect& earlier) { return earlier.trial.on_credit; });
}

}  // namespace

void prune(const SearchContext& search, BeamEntry& entry) {
  const size_t given = entry.model.hypotheses.size() - entry.accepted.size();
  const size_t kept = entry.basin == BasinOrigin::changed ? 0 : 1;
  for (size_t k = 0; k + kept < entry.accepted.size();) {
    if (made_up_for_another(entry, k)) {
      ++k;
      continue;
    }
    FittedModel fewer = without(search, entry.model, given + k);
    if (!fewer.usable()) {
      ++k;
      continue;
    }
    Trial trial = entry.accepted[k].trial;
    const double rise =
        fewer.chi_square(search.threshold) - entry.model.chi_square(search.threshold);
    const auto amplitudes = static_cast<Eigen::Index>(trial.hypothesis.amplitudes.size());
    const double least = std::max(least_decrease(amplitudes), search.worth(fewer));
    if (rise >= least) {
      ++k;
      continue;
    }
    trial.criteria.clear();
    trial.criteria.push_back(
        {"needed", rise, least, false, "those accepted after it make it needless"});
    entry.refused.push_back(std::move(trial));
    entry.accepted.erase(entry.accepted.begin() + static_cast<std::ptrdiff_t>(k));
    entry.model = std::move(fewer);
    entry.last.clear();
  }
}

}  // namespace clothfit
