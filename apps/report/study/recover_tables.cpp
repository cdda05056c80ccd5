#include "apps/report/study/recover_tables.h"

#include <fmt/format.h>

#include <algorithm>

#include "apps/terminal/number_text.h"
#include "vision/track/rejection.h"

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

Table tracker_table(const TrackerErrors& tracker) {
  const double found = tracker.accepted + tracker.rejections();
  return {.header = {"pictures", "markers shown", "accepted", "rejected", "rms error px",
                     "stated sigma px", "chi2 / number", "beyond 5 sigma"},
          .rows = {{std::to_string(tracker.pictures), std::to_string(tracker.shown),
                    std::to_string(tracker.accepted), percent(tracker.rejections() / found, 2),
                    significant(tracker.rms_error_px(), 3), significant(tracker.rms_sigma_px(), 3),
                    significant(tracker.chi_squared_per_number(), 3),
                    std::to_string(tracker.beyond_5_sigma)}}};
}

Table tracker_rejections(const TrackerErrors& tracker) {
  const double found = tracker.accepted + tracker.rejections();
  Table table{.header = {"rejected", "markers", "share", "because"}, .rows = {}};
  for (const RejectionReason& reason : rejection_reasons()) {
    const auto rows = tracker.rejected.find(reason.code);
    if (rows == tracker.rejected.end()) continue;
    table.rows.push_back({reason.code, std::to_string(rows->second),
                          percent(rows->second / found, 2), reason.meaning});
  }
  return table;
}

Table tracker_trials_table(const RecoverResult& result) {
  Table table{.header = {"trial", "pictures", "shown", "accepted", "rms_error_px", "rms_sigma_px",
                         "chi_squared_per_number", "beyond_5_sigma"},
              .rows = {}};
  for (const RejectionReason& reason : rejection_reasons()) table.header.push_back(reason.code);
  for (size_t n = 0; n < result.trials.size(); ++n) {
    if (!result.trials[n].tracker) continue;
    const TrackerErrors& tracker = *result.trials[n].tracker;
    std::vector<std::string>& row = table.rows.emplace_back(std::vector<std::string>{
        std::to_string(n), std::to_string(tracker.pictures), std::to_string(tracker.shown),
        std::to_string(tracker.accepted), exact_text(tracker.rms_error_px()),
        exact_text(tracker.rms_sigma_px()), exact_text(tracker.chi_squared_per_number()),
        std::to_string(tracker.beyond_5_sigma)});
    for (const RejectionReason& reason : rejection_reasons()) {
      const auto rows = tracker.rejected.find(reason.code);
      row.push_back(std::to_string(rows == tracker.rejected.end() ? 0 : rows->second));
    }
  }
  return table;
}

}  // namespace clothfit
