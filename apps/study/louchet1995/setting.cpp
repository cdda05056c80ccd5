#include "apps/study/louchet1995/setting.h"

#include <algorithm>
#include <cmath>

#include "fit/search/cma_es.h"

namespace clothfit {
namespace {

constexpr int kMostSteps = 1000;          ///< for a setting: the limit of a search
constexpr int kScreenedTransitions = 25;  ///< for the full cost on the grid
constexpr int kSearchedTransitions = 50;  ///< and in the search
constexpr double kMostDampingPerStep = 0.5;
constexpr size_t kShown = 3;  ///< rows of the grid

ScannedSetting scanned(const PaperExperiment& experiment, PaperCost cost, int most_transitions) {
  return {experiment, cost, match_listing(experiment, cost, most_transitions)};
}

struct Grid {
  std::vector<double> mass_kg, step_s, duration_s, damping_per_s;
};

Grid grid_of(bool quick) {
  if (quick) return {{0.01}, {0.002, 0.032}, {0.1}, {2}};
  return {{0.003, 0.01, 0.03, 0.1},
          {0.001, 0.002, 0.004, 0.008, 0.016, 0.032, 0.064},
          {0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1, 2, 5},
          {0, 0.5, 2, 6}};
}

/// The four numbers as CMA-ES searches them, all by their logarithms.
const std::vector<SearchParameter> kNumbers{
    {.name = "mass", .lower = 1e-3, .upper = 1, .log_scale = true},
    {.name = "step", .lower = 2e-4, .upper = 0.1, .log_scale = true},
    {.name = "duration", .lower = 0.05, .upper = 5, .log_scale = true},
    {.name = "damping", .lower = 0.01, .upper = 30, .log_scale = true}};

PaperExperiment with_numbers(PaperExperiment experiment, const Eigen::VectorXd& numbers) {
  experiment.vertex_mass_kg = numbers[0];
  experiment.time_step_s = numbers[1];
  experiment.duration_s = std::max(numbers[2], 2 * numbers[1]);
  experiment.damping_per_s = std::min(numbers[3], kMostDampingPerStep / numbers[1]);
  return experiment;
}

ScannedSetting refined(const ScannedSetting& start, bool quick) {
  const CmaOptions options{.population = 8,
                           .initial_step = 0.06,
                           .restarts = 0,
                           .most_evaluations = quick ? 8 : 120,
                           .cost_tolerance = 1e-4};
  const GenerationCost distance = [&](const Eigen::MatrixXd& individuals) {
    Eigen::VectorXd distances(individuals.cols());
    for (Eigen::Index n = 0; n < individuals.cols(); ++n) {
      const PaperExperiment experiment = with_numbers(start.experiment, individuals.col(n));
      const bool short_enough = experiment.duration_s <= kMostSteps * experiment.time_step_s;
      distances[n] =
          short_enough ? rank(scanned(experiment, start.cost, kSearchedTransitions)) : INFINITY;
    }
    return distances;
  };
  const PaperExperiment& from = start.experiment;
  const Eigen::Vector4d numbers(from.vertex_mass_kg, from.time_step_s, from.duration_s,
                                from.damping_per_s);
  const CmaResult result =
      search_by_cma(kNumbers, options, distance, start_cma(kNumbers, options, numbers));
  if (!result.usable()) return start;
  ScannedSetting found = scanned(with_numbers(from, result.state.best().values), start.cost, 0);
  found.searched = true;
  return found;
}

NearSetting told(const ScannedSetting& setting) {
  return {setting, free_run_distance_m(setting.experiment, kPaperGoodListing.back().set),
          free_run_distance_m(setting.experiment, kPaperBadListing.back().set)};
}

bool is_nearer(const ScannedSetting& a, const ScannedSetting& b) {
  return rank(a) < rank(b);
}

}  // namespace

std::vector<SettingReading> setting_readings() {
  std::vector<SettingReading> readings;
  for (const StrainLimitMode limit : {StrainLimitMode::positions, StrainLimitMode::rates_first})
    for (const PaperRelease release : {PaperRelease::level, PaperRelease::upright})
      readings.push_back({limit, release});
  return readings;
}

double rank(const ScannedSetting& setting) {
  return setting.match.overshoot <= kMostOvershoot ? setting.match.distance() : INFINITY;
}

SettingSearch search_setting(const SettingReading& reading, bool quick) {
  SettingSearch search;
  const Grid grid = grid_of(quick);
  for (const double damping_per_s : grid.damping_per_s)
    for (const double mass_kg : grid.mass_kg)
      for (const double step_s : grid.step_s)
        for (const double duration_s : grid.duration_s) {
          if (duration_s < 2 * step_s || duration_s > kMostSteps * step_s) continue;
          PaperExperiment experiment;
          experiment.limit = reading.limit;
          experiment.release = reading.release;
          experiment.vertex_mass_kg = mass_kg;
          experiment.time_step_s = step_s;
          experiment.duration_s = duration_s;
          experiment.damping_per_s = damping_per_s;
          for (const PaperCost cost : {PaperCost::full, PaperCost::small})
            search.grid.push_back(scanned(experiment, cost, kScreenedTransitions));
        }
  for (const PaperCost cost : {PaperCost::full, PaperCost::small}) {
    std::vector<ScannedSetting> near;
    for (const ScannedSetting& setting : search.grid)
      if (setting.cost == cost && std::isfinite(rank(setting))) near.push_back(setting);
    std::stable_sort(near.begin(), near.end(), is_nearer);
    near.resize(std::min(near.size(), kShown));
    for (ScannedSetting& setting : near) setting = scanned(setting.experiment, cost, 0);
    if (!near.empty()) near.push_back(refined(near.front(), quick));
    for (const ScannedSetting& setting : near)
      if (std::isfinite(rank(setting))) search.nearest.push_back(told(setting));
  }
  std::stable_sort(
      search.nearest.begin(), search.nearest.end(),
      [](const NearSetting& a, const NearSetting& b) { return is_nearer(a.setting, b.setting); });
  return search;
}

}  // namespace clothfit
