#include "apps/study/trials/undeclared_summary.h"

#include <algorithm>
#include <boost/math/special_functions/beta.hpp>
#include <cmath>
#include <limits>
#include <set>

namespace clothfit {
namespace {

std::string hidden_title(const UndeclaredTrial& trial) {
  std::string title;
  for (const HiddenInTrial& hidden : trial.hidden)
    title += (title.empty() ? "" : " + ") + hidden.mode.title();
  return title.empty() ? "nothing" : title;
}

void add(UndeclaredSummary& summary, const UndeclaredTrial& trial) {
  if (!trial.usable()) {
    ++summary.refused;
    return;
  }
  ++summary.right_first.trials;
  summary.right_first.hits += trial.right_first() ? 1 : 0;
  ++summary.all_named.trials;
  summary.all_named.hits += trial.all_named() ? 1 : 0;
  switch (trial.verdict) {
    case DiagnosisVerdict::adequate:
      ++summary.adequate;
      break;
    case DiagnosisVerdict::explained:
      ++summary.explained;
      break;
    case DiagnosisVerdict::partly_explained:
      ++summary.partly;
      break;
    case DiagnosisVerdict::unexplained:
      ++summary.unexplained;
      break;
    case DiagnosisVerdict::not_reached:
      break;
  }
  const bool structure = trial.verdict == DiagnosisVerdict::partly_explained ||
                         trial.verdict == DiagnosisVerdict::unexplained;
  if (std::isfinite(trial.mimicked) && structure) {
    ++summary.law_halves.trials;
    summary.law_halves.hits += trial.with_law <= 0.5 * trial.before ? 1 : 0;
  }
  if (!trial.accepted.empty()) summary.over_truth.add(trial.after / trial.with_truth);
  summary.over_noise.add(trial.after / trial.noise);
  summary.before_noise.add(trial.before / trial.noise);
  summary.seconds.add(trial.seconds);
}

void add(UndeclaredSummary& summary, const HiddenInTrial& hidden) {
  summary.class_size.add(static_cast<double>(hidden.right.size()));
  summary.sigmas.add(hidden.sigmas);
  summary.amplitude_ratio.add(hidden.amplitude_ratio);
  for (const FoundAmplitude& found : hidden.found) {
    ++summary.covered.trials;
    summary.covered.hits += std::abs(found.estimate - found.truth) <= 2 * found.sigma ? 1 : 0;
  }
}

}  // namespace

double Rate::share() const {
  return trials > 0 ? hits / static_cast<double>(trials) : std::numeric_limits<double>::quiet_NaN();
}

Interval Rate::bounds() const {
  constexpr double kTail = 0.025;
  const double k = hits, n = trials;
  return {.lower = hits == 0 ? 0 : boost::math::ibeta_inv(k, n - k + 1, kTail),
          .upper = hits == trials ? 1 : boost::math::ibeta_inv(k + 1, n - k, 1 - kTail)};
}

void Mean::add(double value) {
  if (!std::isfinite(value)) return;
  sum += value;
  ++count;
}

double Mean::value() const {
  return count > 0 ? sum / count : std::numeric_limits<double>::quiet_NaN();
}

std::vector<UndeclaredSummary> undeclared_summaries(const UndeclaredResult& result) {
  std::vector<UndeclaredSummary> rows;
  UndeclaredSummary all{.title = "all"};
  const auto row_of = [&](const std::string& title) -> UndeclaredSummary& {
    const auto known = std::ranges::find(rows, title, &UndeclaredSummary::title);
    return known != rows.end() ? *known : rows.emplace_back(UndeclaredSummary{.title = title});
  };
  for (const UndeclaredTrial& trial : result.trials) {
    add(all, trial);
    if (trial.hidden.empty()) add(row_of("nothing"), trial);
    for (const HiddenInTrial& hidden : trial.hidden) {
      UndeclaredSummary& row = row_of(hidden.mode.title());
      add(row, trial);
      if (!trial.usable()) continue;
      add(row, hidden);
      add(all, hidden);
    }
  }
  rows.push_back(std::move(all));
  return rows;
}

Confusion confusion_of(const UndeclaredResult& result) {
  Confusion confusion;
  std::set<std::string> named;
  for (const UndeclaredTrial& trial : result.trials) {
    if (!trial.usable()) continue;
    const std::string title = hidden_title(trial);
    if (std::ranges::find(confusion.hidden, title) == confusion.hidden.end())
      confusion.hidden.push_back(title);
    if (!trial.accepted_effects.empty()) named.insert(trial.accepted_effects.front());
  }
  confusion.named.assign(named.begin(), named.end());
  confusion.named.emplace_back("nothing");
  confusion.count.assign(confusion.hidden.size(), std::vector<int>(confusion.named.size(), 0));
  confusion.right = confusion.count;
  for (const UndeclaredTrial& trial : result.trials) {
    if (!trial.usable()) continue;
    const auto row = static_cast<size_t>(std::ranges::find(confusion.hidden, hidden_title(trial)) -
                                         confusion.hidden.begin());
    const std::string first =
        trial.accepted_effects.empty() ? "nothing" : trial.accepted_effects.front();
    const auto column =
        static_cast<size_t>(std::ranges::find(confusion.named, first) - confusion.named.begin());
    ++confusion.count[row][column];
    confusion.right[row][column] += trial.right_first() ? 1 : 0;
  }
  return confusion;
}

}  // namespace clothfit
