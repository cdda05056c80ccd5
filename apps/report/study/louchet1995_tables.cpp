#include "apps/report/study/louchet1995_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/terminal/number_text.h"

namespace clothfit {
namespace {

using Row = std::vector<std::string>;

/// Writes "3.2e-05" as `significant` does, or "none" where there is no bound.
std::string sigma_text(double sigma) {
  return std::isfinite(sigma) ? significant(100 * sigma, 2) + " %" : "unbounded";
}

Row numbers(std::initializer_list<double> values) {
  Row row;
  for (const double value : values) row.push_back(exact_text(value));
  return row;
}

std::string text_of(const ScannedSetting& setting) {
  return to_string(setting.experiment.limit, setting.experiment.release);
}

Table scan_file(const Louchet1995Study& study) {
  Table table{{"search", "cost", "limit", "release", "mass_kg", "step_s", "duration_s",
               "damping_per_s", "usable", "factor", "spread", "distance", "overshoot"},
              {}};
  const auto add = [&](const char* search, const ScannedSetting& setting) {
    const PaperExperiment& experiment = setting.experiment;
    const ListingMatch& match = setting.match;
    Row row{search, to_string(setting.cost),
            experiment.limit == StrainLimitMode::rates_first ? "rates_first" : "positions",
            experiment.release == PaperRelease::level ? "level" : "upright"};
    for (const std::string& cell : numbers({experiment.vertex_mass_kg, experiment.time_step_s,
                                            experiment.duration_s, experiment.damping_per_s}))
      row.push_back(cell);
    row.push_back(match.usable ? "1" : "0");
    for (const double value : {match.factor, match.spread, match.distance(), match.overshoot})
      row.push_back(match.usable ? exact_text(value) : "");
    table.rows.push_back(row);
  };
  for (const SettingSearch& search : study.settings) {
    for (const ScannedSetting& setting : search.grid) add("grid", setting);
    for (const NearSetting& near : search.nearest)
      add(near.setting.searched ? "searched" : "grid, all transitions", near.setting);
  }
  return table;
}

Table listed_costs_file(const Louchet1995Study& study) {
  Table table{{"listing", "candidate", "printed_cost", "full_cost_m2", "small_cost_m2"}, {}};
  size_t n = 0;
  for (const auto* listing : {&kPaperGoodListing, &kPaperBadListing})
    for (const PaperIndividual& individual : *listing) {
      const auto ours = [&](const ListingMatch& match) {
        return match.usable ? exact_text(match.cost[n]) : std::string();
      };
      table.rows.push_back({listing == &kPaperGoodListing ? "good" : "bad",
                            std::to_string(individual.candidate), exact_text(individual.cost),
                            ours(study.full_match), ours(study.small_match)});
      ++n;
    }
  return table;
}

Table landscapes_file(const Louchet1995Study& study) {
  Table table{{"reference_tau", "cost", "k_n_per_m", "tau", "cost_m2"}, {}};
  for (const CostLandscape& map : study.landscapes)
    for (size_t i = 0; i < map.stiffness_n_per_m.size(); ++i)
      for (size_t j = 0; j < map.elongation.size(); ++j)
        table.rows.push_back(
            {exact_text(map.reference_elongation), to_string(map.cost),
             exact_text(map.stiffness_n_per_m[i]), exact_text(map.elongation[j]),
             exact_text(map.value_m2(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)))});
  return table;
}

Row individual_cells(const Individual& individual) {
  Row row;
  for (const double value : individual.values) row.push_back(exact_text(value));
  row.push_back(exact_text(individual.cost));
  return row;
}

Table recoveries_file(const RecoveryTrials& trials) {
  Table table{{"seed"}, {}};
  for (const char* stage : {"listed", "strategy", "refined"}) {
    for (const std::string& name : trials.names)
      table.header.push_back(fmt::format("{}_{}", stage, name));
    table.header.push_back(fmt::format("{}_cost_m2", stage));
  }
  for (const char* name : {"largest_relative_error", "searches", "refinements", "iterations"})
    table.header.emplace_back(name);
  for (const RecoveryTrial& trial : trials.trials) {
    const Recovery& recovery = trial.recovery;
    Row row{std::to_string(trial.seed)};
    for (const Individual* individual :
         {&recovery.listed.front(), &recovery.strategy, &recovery.refined})
      for (std::string& cell : individual_cells(*individual)) row.push_back(std::move(cell));
    row.push_back(exact_text(trial.error));
    for (const int count : {recovery.searches, recovery.refinements, recovery.iterations})
      row.push_back(std::to_string(count));
    table.rows.push_back(row);
  }
  return table;
}

Table full_cost_file(const Louchet1995Study& study) {
  Table table{
      {"seed", "generation", "rank", "l01_m", "l23_m", "l45_m", "k_n_per_m", "tau", "cost_m2"}, {}};
  for (const FullCostTrial& trial : study.full_cost) {
    const auto add = [&](const std::string& generation, size_t rank, const Individual& individual) {
      Row row{std::to_string(trial.seed), generation, std::to_string(rank)};
      for (std::string& cell : individual_cells(individual)) row.push_back(std::move(cell));
      table.rows.push_back(row);
    };
    for (size_t rank = 0; rank < trial.recovery.listed.size(); ++rank)
      add(std::to_string(kListedGeneration), rank, trial.recovery.listed[rank]);
    add("last", 0, trial.recovery.strategy);
  }
  return table;
}

Table races_file(const Louchet1995Study& study) {
  Table table{{"search", "race", "evaluations", "relative_cost"}, {}};
  for (const RaceResults& results : study.races)
    for (size_t n = 0; n < results.races.size(); ++n)
      for (size_t k = 0; k < results.races[n].evaluations.size(); ++k)
        table.rows.push_back({to_string(results.racer), std::to_string(n),
                              std::to_string(results.races[n].evaluations[k]),
                              exact_text(results.races[n].relative_cost[k])});
  return table;
}

Table race_marks_file(const Louchet1995Study& study) {
  Table table{{"search", "race", "relative_cost", "generations", "evaluations"}, {}};
  for (const RaceResults& results : study.races)
    for (size_t n = 0; n < results.races.size(); ++n)
      for (size_t mark = 0; mark < kRaceMarks.size(); ++mark) {
        const Race& race = results.races[n];
        const bool reached = race.generations[mark] >= 0;
        table.rows.push_back({to_string(results.racer), std::to_string(n),
                              exact_text(kRaceMarks[mark]),
                              reached ? std::to_string(race.generations[mark]) : "",
                              reached ? std::to_string(race.costs_asked[mark]) : ""});
      }
  return table;
}

Table places_file(const Louchet1995Study& study) {
  Table table{{"transition", "time_s", "share_at_limit"}, {}};
  for (const std::string& name : study.five.names) table.header.push_back("relative_sigma_" + name);
  table.header.emplace_back("recovered");
  table.header.emplace_back("seeds");
  for (const PlaceInMotion& place : study.places) {
    Row row{std::to_string(place.transition), exact_text(place.time_s),
            exact_text(place.share_at_limit)};
    for (const double sigma : place.relative_sigma)
      row.push_back(std::isfinite(sigma) ? exact_text(sigma) : "");
    row.push_back(std::to_string(std::count_if(place.errors.begin(), place.errors.end(),
                                               [](double error) { return error < 1e-6; })));
    row.push_back(std::to_string(place.errors.size()));
    table.rows.push_back(row);
  }
  return table;
}

Table motion_file(const Louchet1995Study& study) {
  Table table{{"motion", "time_s", "rms_distance_m"}, {}};
  for (const Reconstruction& reconstruction : study.reconstructions)
    for (size_t n = 0; n < study.original.time_s.size(); n += 10) {
      const Eigen::Matrix3Xd difference =
          reconstruction.states.position_m[n] - study.original.position_m[n];
      table.rows.push_back({reconstruction.name, exact_text(study.original.time_s[n]),
                            exact_text(std::sqrt(difference.squaredNorm() /
                                                 static_cast<double>(difference.cols())))});
    }
  return table;
}

Table sigma_file(const RecoveryTrials& trials) {
  Table table{{"parameter", "truth", "relative_sigma"}, {}};
  for (Eigen::Index p = 0; p < trials.truth.size(); ++p)
    table.rows.push_back(
        {trials.names[static_cast<size_t>(p)], exact_text(trials.truth[p]),
         std::isfinite(trials.relative_sigma[p]) ? exact_text(trials.relative_sigma[p]) : ""});
  return table;
}

/// Counts individuals that have K within `share` of the reference.
template <class Trials, class Pick>
std::string with_stiffness(const Trials& trials, double truth, double share, const Pick& pick) {
  const auto good = std::count_if(trials.begin(), trials.end(), [&](const auto& trial) {
    return std::abs(pick(trial).values[3] / truth - 1) <= share;
  });
  return fmt::format("{} of {}", good, trials.size());
}

template <class Trials, class Pick>
std::string cost_quartiles(const Trials& trials, const Pick& pick) {
  std::vector<double> costs;
  for (const auto& trial : trials) costs.push_back(pick(trial).cost);
  return fmt::format("{} ({} to {})", significant(quantile(costs, 0.5), 2),
                     significant(quantile(costs, 0.25), 2), significant(quantile(costs, 0.75), 2));
}

std::string quartiles(const std::vector<double>& values) {
  const auto text = [&](double share) {
    const double value = quantile(values, share);
    return std::isfinite(value) ? fmt::format("{:.0f}", value) : std::string("never");
  };
  if (text(0.25) == "never") return "never";
  return fmt::format("{} ({} to {})", text(0.5), text(0.25), text(0.75));
}

std::string met(bool is_met) {
  return is_met ? "met" : "missed";
}

}  // namespace

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return INFINITY;
  std::sort(values.begin(), values.end());
  return values[static_cast<size_t>(std::lround(share * static_cast<double>(values.size() - 1)))];
}

std::string to_string(StrainLimitMode limit, PaperRelease release) {
  return fmt::format("{}, {}", limit == StrainLimitMode::rates_first ? "rates first" : "positions",
                     release == PaperRelease::level ? "level" : "upright");
}

std::vector<StudyTable> louchet1995_files(const Louchet1995Study& study) {
  return {{"scan.csv", scan_file(study)},
          {"listed_costs.csv", listed_costs_file(study)},
          {"landscapes.csv", landscapes_file(study)},
          {"recoveries_5.csv", recoveries_file(study.five)},
          {"recoveries_18.csv", recoveries_file(study.eighteen)},
          {"sigma_5.csv", sigma_file(study.five)},
          {"sigma_18.csv", sigma_file(study.eighteen)},
          {"strategy_full_cost.csv", full_cost_file(study)},
          {"races.csv", races_file(study)},
          {"race_marks.csv", race_marks_file(study)},
          {"places.csv", places_file(study)},
          {"reconstructions.csv", motion_file(study)}};
}

StudyTable louchet1995_timing(const Louchet1995Study& study) {
  StudyTable timing{"timing.csv", {{"parameters", "seed", "seconds"}, {}}};
  for (const RecoveryTrials* trials : {&study.five, &study.eighteen})
    for (const RecoveryTrial& trial : trials->trials)
      if (trial.seconds >= 0)
        timing.table.rows.push_back({std::to_string(trials->truth.size()),
                                     std::to_string(trial.seed), exact_text(trial.seconds)});
  return timing;
}

Table nearest_settings_table(const Louchet1995Study& study) {
  Table table{{"reading", "cost", "mass kg", "step s", "duration s", "damping 1/s", "distance",
               "factor", "spread", "over- shoot", "good off", "bad off"},
              {}};
  std::vector<NearSetting> settings;
  for (const SettingSearch& search : study.settings)
    settings.insert(settings.end(), search.nearest.begin(), search.nearest.end());
  std::stable_sort(
      settings.begin(), settings.end(),
      [](const NearSetting& a, const NearSetting& b) { return rank(a.setting) < rank(b.setting); });
  settings.resize(std::min<size_t>(12, settings.size()));
  for (const NearSetting& near : settings) {
    const PaperExperiment& experiment = near.setting.experiment;
    const ListingMatch& match = near.setting.match;
    const double length_m = experiment.reference.natural_length_01_m;
    table.rows.push_back({text_of(near.setting), to_string(near.setting.cost),
                          fmt::format("{:.3g}", experiment.vertex_mass_kg),
                          fmt::format("{:.3g}", experiment.time_step_s),
                          fmt::format("{:.3g}", experiment.duration_s),
                          fmt::format("{:.3g}", experiment.damping_per_s),
                          significant(match.distance(), 2), significant(match.factor, 3),
                          significant(match.spread, 2), significant(match.overshoot, 2),
                          significant(near.good_off_m / length_m, 2),
                          significant(near.bad_off_m / length_m, 2)});
  }
  return table;
}

Table landscape_table(const Louchet1995Study& study) {
  Table table{{"reference", "cost", "lowest at K", "and tau", "other minima on the grid"}, {}};
  for (const CostLandscape& map : study.landscapes) {
    const auto [i, j] = map.lowest();
    table.rows.push_back({fmt::format("K = 4, tau = {}", map.reference_elongation),
                          to_string(map.cost),
                          significant(map.stiffness_n_per_m[static_cast<size_t>(i)], 3),
                          significant(map.elongation[static_cast<size_t>(j)], 3),
                          std::to_string(map.other_minima())});
  }
  return table;
}

Table listing_table(const Louchet1995Study& study, bool bad) {
  Table table{{"", "l01", "l23", "l45", "K", "tau", "cost"}, {}};
  const auto add = [&](const std::string& name, const Eigen::VectorXd& values, double cost) {
    Row row{name};
    for (const double value : values) row.push_back(fmt::format("{:.6f}", value));
    row.push_back(fmt::format("{:.6f}", cost));
    table.rows.push_back(row);
  };
  for (const PaperIndividual& individual : bad ? kPaperBadListing : kPaperGoodListing)
    add(fmt::format("printed, candidate {}", individual.candidate), to_vector(individual.set),
        individual.cost);
  const auto [best, worst] =
      std::minmax_element(study.full_cost.begin(), study.full_cost.end(),
                          [](const FullCostTrial& a, const FullCostTrial& b) {
                            return a.recovery.listed.front().cost < b.recovery.listed.front().cost;
                          });
  const FullCostTrial& trial = bad ? *worst : *best;
  const double weight = static_cast<double>(study.original.last()) / study.full_cost_transitions;
  for (size_t place = trial.recovery.listed.size(); place > 0; --place) {
    const Individual& individual = trial.recovery.listed[place - 1];
    add(fmt::format("seed {}, rank {}", trial.seed, place), individual.values,
        weight * individual.cost);
  }
  return table;
}

Table success_table(const Louchet1995Study& study) {
  Table table{{"strategy alone", "generations", "K within 2 %", "K within 10 %",
               "cost in m², median (quartiles)"},
              {}};
  const double truth = study.experiment.reference.stiffness_n_per_m;
  const auto listed = [](const auto& trial) -> const Individual& {
    return trial.recovery.listed.front();
  };
  const auto last = [](const auto& trial) -> const Individual& { return trial.recovery.strategy; };
  const auto add = [&](const std::string& name, const std::string& generations, const auto& trials,
                       const auto& pick) {
    table.rows.push_back({name, generations, with_stiffness(trials, truth, 0.02, pick),
                          with_stiffness(trials, truth, 0.1, pick), cost_quartiles(trials, pick)});
  };
  const std::string full =
      fmt::format("full cost over {} transitions", study.full_cost_transitions);
  add("small cost", std::to_string(kListedGeneration), study.five.trials, listed);
  add("small cost", "at the end", study.five.trials, last);
  add(full, std::to_string(kListedGeneration), study.full_cost, listed);
  add(full, "at the end", study.full_cost, last);
  return table;
}

Table eighteen_table(const Louchet1995Study& study) {
  const RecoveryTrials& trials = study.eighteen;
  Table table{{"parameter", "truth", "relative sigma at 1 mm", "", "largest error of a recovery"},
              {}};
  for (Eigen::Index p = 0; p < trials.truth.size(); ++p) {
    double largest = 0;
    for (const RecoveryTrial& trial : trials.trials)
      largest = std::max(largest, std::abs(trial.recovery.refined.values[p] / trials.truth[p] - 1));
    table.rows.push_back({trials.names[static_cast<size_t>(p)], significant(trials.truth[p], 6),
                          sigma_text(trials.relative_sigma[p]),
                          trials.determined(p) ? "determined" : "undetermined",
                          significant(largest, 2)});
  }
  return table;
}

Table race_table(const Louchet1995Study& study) {
  Table table{{"search", "relative cost", "generations", "costs asked for", "reached"}, {}};
  for (const RaceResults& results : study.races)
    for (size_t mark = 0; mark < kRaceMarks.size(); ++mark) {
      std::vector<double> generations, asked;
      int reached = 0;
      for (const Race& race : results.races) {
        const bool there = race.generations[mark] >= 0;
        reached += there;
        generations.push_back(there ? static_cast<double>(race.generations[mark]) : INFINITY);
        asked.push_back(there ? static_cast<double>(race.costs_asked[mark]) : INFINITY);
      }
      table.rows.push_back({to_string(results.racer), significant(kRaceMarks[mark], 1),
                            quartiles(generations), quartiles(asked),
                            fmt::format("{} of {}", reached, results.races.size())});
    }
  return table;
}

Table place_table(const Louchet1995Study& study) {
  Table table{{"time s", "springs at the limit"}, {}};
  for (const char* name : {"l01", "l23", "l45", "K", "tau"})
    table.header.push_back(fmt::format("sigma of {}", name));
  table.header.emplace_back("recovered");
  for (const PlaceInMotion& place : study.places) {
    Row row{significant(place.time_s, 3), significant(100 * place.share_at_limit, 2) + " %"};
    for (const double sigma : place.relative_sigma) row.push_back(sigma_text(sigma));
    row.push_back(fmt::format("{} of {}",
                              std::count_if(place.errors.begin(), place.errors.end(),
                                            [](double error) { return error < 1e-6; }),
                              place.errors.size()));
    table.rows.push_back(row);
  }
  return table;
}

Table reconstruction_table(const Louchet1995Study& study) {
  Table table{{"reconstruction", "K", "tau", "full cost m²", "rms distance mm", "of l01"}, {}};
  for (const Reconstruction& reconstruction : study.reconstructions)
    table.rows.push_back(
        {reconstruction.name, significant(reconstruction.set.stiffness_n_per_m, 4),
         significant(reconstruction.set.critical_elongation, 4),
         significant(reconstruction.cost_m2, 3), significant(1000 * reconstruction.rms_m, 3),
         significant(reconstruction.rms_m / study.experiment.reference.natural_length_01_m, 2)});
  return table;
}

int recovered_five(const Louchet1995Study& study, double share) {
  return static_cast<int>(
      std::count_if(study.five.trials.begin(), study.five.trials.end(),
                    [&](const RecoveryTrial& trial) { return trial.error < share; }));
}

int recovered_eighteen(const Louchet1995Study& study, double share) {
  return static_cast<int>(std::count_if(
      study.eighteen.trials.begin(), study.eighteen.trials.end(),
      [&](const RecoveryTrial& trial) { return study.eighteen.determined_error(trial) < share; }));
}

double longest_seconds(const RecoveryTrials& trials) {
  double longest = -1;
  for (const RecoveryTrial& trial : trials.trials) longest = std::max(longest, trial.seconds);
  return longest;
}

Table target_table(const Louchet1995Study& study) {
  Table table{{"target", "measured", ""}, {}};
  const size_t count = study.five.trials.size();
  const int five = recovered_five(study, 1e-6);
  table.rows.push_back({"all five parameters within 1e-6 relative, every seed",
                        fmt::format("{} of {}", five, count),
                        met(five == static_cast<int>(count))});
  const double longest = longest_seconds(study.five);
  table.rows.push_back({"each of them in less than 2 s",
                        longest < 0 ? "measured: resumed, not timed"
                                    : fmt::format("measured: longest {:.2f} s", longest),
                        longest < 0 ? "measured: -" : "measured: " + met(longest < 2)});
  const int eighteen = recovered_eighteen(study, 1e-4);
  table.rows.push_back(
      {"18 parameters: those whose sigma at 1 mm is below 10 % within 1e-4, in 95 % of the seeds",
       fmt::format("{} of {}", eighteen, study.eighteen.trials.size()),
       met(eighteen * 100 >= 95 * static_cast<int>(study.eighteen.trials.size()))});
  const double longest_18 = longest_seconds(study.eighteen);
  table.rows.push_back({"(18 parameters: time of a recovery; no target)",
                        longest_18 < 0 ? "measured: resumed, not timed"
                                       : fmt::format("measured: longest {:.2f} s", longest_18),
                        ""});
  return table;
}

}  // namespace clothfit
