#include "apps/report/study/undeclared_tables.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

#include "apps/terminal/number_text.h"

namespace clothfit {
namespace {

std::string percent(double share) {
  return std::isfinite(share) ? fmt::format("{:.1f} %", 100 * share) : "-";
}

std::string rate_text(const Rate& rate) {
  if (rate.trials == 0) return "-";
  const Interval bounds = rate.bounds();
  return fmt::format("{} ({} to {})", percent(rate.share()), percent(bounds.lower),
                     percent(bounds.upper));
}

std::string ratio_text(double value) {
  return std::isfinite(value) ? fmt::format("{:.3f}", value) : "-";
}

/// Joins the texts of all hidden modes of a trial.
template <class Text>
std::string joined(const UndeclaredTrial& trial, const Text& text) {
  std::vector<std::string> parts;
  for (const HiddenInTrial& hidden : trial.hidden) parts.push_back(text(hidden));
  return fmt::format("{}", fmt::join(parts, " + "));
}

std::string verdict_text(const UndeclaredTrial& trial) {
  if (!trial.refused.empty()) return trial.refused;
  return trial.usable() ? to_string(trial.verdict) : trial.message;
}

std::string yes(bool is) {
  return is ? "yes" : "no";
}

}  // namespace

Table undeclared_trials_table(const UndeclaredResult& result) {
  Table table{.header = {"trial",          "hidden",        "shape",        "sigmas",
                         "right",          "mimicked",      "verdict",      "accepted",
                         "right_first",    "all_named",     "amplitude",    "amplitude_ratio",
                         "error_before",   "error_after",   "error_truth",  "error_law",
                         "noise",          "fitted_before", "fitted_after", "seconds",
                         "drawing_seconds"},
              .rows = {}};
  for (size_t n = 0; n < result.trials.size(); ++n) {
    const UndeclaredTrial& trial = result.trials[n];
    const bool usable = trial.usable();
    table.rows.push_back(
        {std::to_string(n),
         joined(trial, [](const HiddenInTrial& h) { return h.mode.title(); }),
         joined(trial,
                [](const HiddenInTrial& h) {
                  std::string text;
                  for (const auto& [name, value] : h.shape)
                    text += fmt::format("{}{}={}", text.empty() ? "" : " ", name,
                                        significant(value, 4));
                  return text;
                }),
         joined(trial, [](const HiddenInTrial& h) { return exact_text(h.sigmas); }),
         joined(trial,
                [](const HiddenInTrial& h) { return fmt::format("{}", fmt::join(h.right, " ")); }),
         exact_text(trial.mimicked),
         verdict_text(trial),
         fmt::format("{}", fmt::join(trial.accepted, " + ")),
         usable ? yes(trial.right_first()) : "",
         usable ? yes(trial.all_named()) : "",
         joined(trial,
                [](const HiddenInTrial& h) {
                  std::string text;
                  for (const FoundAmplitude& found : h.found)
                    text += fmt::format("{}{}={}+-{} true {}", text.empty() ? "" : " ", found.name,
                                        exact_text(found.estimate), exact_text(found.sigma),
                                        exact_text(found.truth));
                  return text;
                }),
         joined(trial, [](const HiddenInTrial& h) { return exact_text(h.amplitude_ratio); }),
         exact_text(trial.before),
         exact_text(trial.after),
         exact_text(trial.with_truth),
         exact_text(trial.with_law),
         exact_text(trial.noise),
         exact_text(trial.before_fitted),
         exact_text(trial.after_fitted),
         usable ? exact_text(trial.seconds) : "",
         exact_text(trial.drawing_seconds)});
  }
  return table;
}

Table short_undeclared_trials_table(const UndeclaredResult& result) {
  Table table{.header = {"hidden", "sigmas", "verdict", "accepted", "right first", "before / noise",
                         "after / noise", "after / true model"},
              .rows = {}};
  for (const UndeclaredTrial& trial : result.trials)
    table.rows.push_back(
        {trial.hidden.empty()
             ? "nothing"
             : joined(trial, [](const HiddenInTrial& h) { return h.mode.title(); }),
         trial.hidden.empty()
             ? "-"
             : joined(trial, [](const HiddenInTrial& h) { return significant(h.sigmas, 2); }),
         verdict_text(trial), fmt::format("{}", fmt::join(trial.accepted, " + ")),
         trial.usable() ? yes(trial.right_first()) : "-", ratio_text(trial.before / trial.noise),
         ratio_text(trial.after / trial.noise), ratio_text(trial.after / trial.with_truth)});
  return table;
}

Table undeclared_effects_table(const UndeclaredResult& result) {
  Table table{.header = {"hidden",
                         "trials",
                         "refused",
                         "right_first",
                         "rate",
                         "rate_lower_95",
                         "rate_upper_95",
                         "all_named",
                         "explained",
                         "partly_explained",
                         "unexplained",
                         "adequate",
                         "laws_asked",
                         "laws_halving",
                         "mean_class_size",
                         "mean_sigmas",
                         "amplitude_ratio",
                         "amplitudes",
                         "within_2_sigma",
                         "after_over_truth",
                         "after_over_noise",
                         "before_over_noise",
                         "seconds"},
              .rows = {}};
  for (const UndeclaredSummary& row : undeclared_summaries(result)) {
    const Interval bounds = row.right_first.bounds();
    table.rows.push_back({row.title,
                          std::to_string(row.right_first.trials),
                          std::to_string(row.refused),
                          std::to_string(row.right_first.hits),
                          exact_text(row.right_first.share()),
                          exact_text(bounds.lower),
                          exact_text(bounds.upper),
                          std::to_string(row.all_named.hits),
                          std::to_string(row.explained),
                          std::to_string(row.partly),
                          std::to_string(row.unexplained),
                          std::to_string(row.adequate),
                          std::to_string(row.law_halves.trials),
                          std::to_string(row.law_halves.hits),
                          exact_text(row.class_size.value()),
                          exact_text(row.sigmas.value()),
                          exact_text(row.amplitude_ratio.value()),
                          std::to_string(row.covered.trials),
                          exact_text(row.covered.share()),
                          exact_text(row.over_truth.value()),
                          exact_text(row.over_noise.value()),
                          exact_text(row.before_noise.value()),
                          exact_text(row.seconds.value())});
  }
  return table;
}

Table short_undeclared_effects_table(const UndeclaredResult& result) {
  const std::vector<UndeclaredSummary> summaries = undeclared_summaries(result);
  Table table{.header = {"hidden", "trials", "not drawn", "right first (95 %)", "all named",
                         "unexplained", "partly", "class", "found / true", "within 2 sigma",
                         "before / noise", "after / noise", "after / true model", "s"},
              .rows = {}};
  for (const UndeclaredSummary& row : summaries)
    table.rows.push_back({row.title, std::to_string(row.right_first.trials),
                          std::to_string(row.refused), rate_text(row.right_first),
                          percent(row.all_named.share()), std::to_string(row.unexplained),
                          std::to_string(row.partly), significant(row.class_size.value(), 2),
                          ratio_text(row.amplitude_ratio.value()), percent(row.covered.share()),
                          ratio_text(row.before_noise.value()), ratio_text(row.over_noise.value()),
                          ratio_text(row.over_truth.value()), significant(row.seconds.value(), 2)});
  // The last line is of all trials.
  if (summaries.empty() || summaries.back().law_halves.trials == 0) return table;
  constexpr std::ptrdiff_t kBehindPartly = 7;
  table.header.insert(table.header.begin() + kBehindPartly, "law halves");
  for (size_t n = 0; n < summaries.size(); ++n) {
    const Rate& halves = summaries[n].law_halves;
    table.rows[n].insert(
        table.rows[n].begin() + kBehindPartly,
        halves.trials > 0 ? fmt::format("{} of {}", halves.hits, halves.trials) : "-");
  }
  return table;
}

Table confusion_table(const UndeclaredResult& result) {
  const Confusion confusion = confusion_of(result);
  Table table{.header = {"hidden"}, .rows = {}};
  table.header.insert(table.header.end(), confusion.named.begin(), confusion.named.end());
  for (size_t row = 0; row < confusion.hidden.size(); ++row) {
    std::vector<std::string>& cells = table.rows.emplace_back();
    cells.push_back(confusion.hidden[row]);
    for (const int count : confusion.count[row]) cells.push_back(std::to_string(count));
  }
  return table;
}

}  // namespace clothfit
