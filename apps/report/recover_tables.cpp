#include "apps/report/recover_tables.h"

#include <fmt/format.h>

#include <algorithm>

#include "apps/report/number_text.h"

namespace clothfit {
namespace {

std::string percent(double share, int digits) {
  return std::isfinite(share) ? fmt::format("{:.{}f} %", 100 * share, digits) : "-";
}

}  // namespace

Table recovery_table(const RecoverResult& result) {
  Table table{.header = {"parameter", "trials", "undetermined", "bias", "spread", "rms",
                         "95 % within", "bias / bound", "spread / bound", "95 % covers",
                         "robust 90 % covers", "stated 90 % covers"},
              .rows = {}};
  for (const RecoverySummary& p : result.parameters)
    table.rows.push_back({p.name, std::to_string(p.trials), std::to_string(p.undetermined),
                          percent(p.bias, 3), percent(p.spread, 3), percent(p.rms, 3),
                          percent(p.percentile_95, 3), significant(p.bias_over_bound, 2),
                          significant(p.spread_over_bound, 3), percent(p.coverage_95, 1),
                          percent(p.holds_truth.robust, 1), percent(p.holds_truth.stated, 1)});
  return table;
}

Table recovery_counts(const RecoverResult& result) {
  const auto trials = result.trials.size();
  int rejected = 0;
  for (const RecoverTrial& trial : result.trials) rejected += trial.rejected;
  return {.header = {"trials", "without a fit", "not converged", "beyond 10 bounds",
                     "observations left out", "median s", "longest s"},
          .rows = {{std::to_string(trials), std::to_string(result.failures),
                    std::to_string(result.unconverged), std::to_string(result.wrong),
                    std::to_string(rejected), significant(result.median_seconds, 3),
                    significant(result.longest_seconds, 3)}}};
}

Table recovery_trials_table(const RecoverResult& result) {
  Table table{.header = {"trial", "stop", "parameter", "truth", "estimate", "sigma", "noise_sigma",
                         "robust_sigma", "bound_sigma", "undetermined", "degrees_of_freedom",
                         "lower_90", "upper_90"},
              .rows = {}};
  for (size_t n = 0; n < result.trials.size(); ++n) {
    const RecoverTrial& trial = result.trials[n];
    if (trial.parameters.empty())
      table.rows.push_back(
          {std::to_string(n), trial.message, "", "", "", "", "", "", "", "", "", "", ""});
    for (const RecoveredParameter& p : trial.parameters)
      table.rows.push_back({std::to_string(n), to_string(trial.stop), p.name, exact_text(p.truth),
                            exact_text(p.estimate), exact_text(p.sigma), exact_text(p.noise_sigma),
                            exact_text(p.robust_sigma), exact_text(p.bound_sigma),
                            p.undetermined ? "yes" : "no", exact_text(p.degrees_of_freedom),
                            exact_text(p.interval_90.lower), exact_text(p.interval_90.upper)});
  }
  return table;
}

}  // namespace clothfit
