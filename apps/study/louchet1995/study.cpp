#include "apps/study/louchet1995/study.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>

#include "apps/study/louchet1995/determination.h"
#include "apps/study/louchet1995/payload.h"
#include "data/input_error.h"
#include "fit/jobs/executor.h"
#include "fit/jobs/journal_key.h"
#include "fit/jobs/thread_limit.h"
#include "fit/problem/parameterised_model.h"

namespace clothfit {
namespace {

constexpr std::array kLandscapeElongations{0.1, 0.5};  // figures 3 and 4 of the paper
constexpr int kPlaces = 10;
constexpr int kRecoveryGenerations = 100;

/// The differences between a whole run and a quick one.
struct Extent {
  int landscape_points = 41;
  int landscape_transitions = 60;
  int full_cost_transitions = 20;
  int places = kPlaces;
  int generations = kRecoveryGenerations;

  static Extent of(const Louchet1995Options& options) {
    if (!options.quick) return {};
    return {.landscape_points = 7,
            .landscape_transitions = 4,
            .full_cost_transitions = 2,
            .places = 2,
            .generations = 60};
  }
};

/// A motion with all that the pieces share.
struct Setting {
  PaperExperiment experiment;
  RecordedStates states = paper_states(experiment);
  FitProblem five = paper_problem(experiment, states, SpringSet::louchet5);
  FitProblem eighteen = paper_problem(experiment, states, SpringSet::louchet18);

  const FitProblem& problem(SpringSet set) const {
    return set == SpringSet::louchet5 ? five : eighteen;
  }
  Eigen::Index parameters(SpringSet set) const { return std::ssize(problem(set).space.parameters); }
};

Recovery recovery_piece(const Setting& setting, SpringSet set, const std::vector<int>& transitions,
                        const RecoveryOptions& options) {
  return recover(setting.problem(set), setting.states, transitions, setting.experiment.time_step_s,
                 options);
}

/// Returns transitions at equal distances over the motion, the first one and the last among them.
/// The paper says that the first one's state says nothing of springs.
std::vector<int> places_in_motion(const RecordedStates& states, int count) {
  std::vector<int> places;
  for (int n = 0; n < count; ++n) places.push_back(1 + (states.last() - 1) * n / (count - 1));
  return places;
}

struct Piece {
  std::function<std::string()> make;
  std::function<void(const std::string& payload)> accept;  ///< throws for what is not of it
};
using Pieces = std::vector<Piece>;

/// Returns pieces by number; the readers below take their payloads in the same order.
Pieces pieces_of(const Louchet1995Options& options, const Setting& setting) {
  const Extent extent = Extent::of(options);
  Pieces pieces;
  for (const SettingReading& reading : setting_readings())
    pieces.push_back(
        {[=] { return to_payload(search_setting(reading, options.quick)); }, setting_search_of});
  for (const double elongation : kLandscapeElongations)
    for (const PaperCost cost : {PaperCost::full, PaperCost::small})
      pieces.push_back({[=, &setting] {
                          return to_payload(cost_landscape(setting.experiment, elongation, cost,
                                                           extent.landscape_points,
                                                           extent.landscape_transitions));
                        },
                        landscape_of});
  const auto recovery = [&](SpringSet set, const std::vector<int>& transitions,
                            const RecoveryOptions& how) {
    pieces.push_back(
        {[=, &setting] { return to_payload(recovery_piece(setting, set, transitions, how)); },
         [=, &setting](const std::string& payload) {
           recovery_of(payload, setting.parameters(set));
         }});
  };
  const auto options_of = [&](int n) {
    return RecoveryOptions{.generations = extent.generations,
                           .seed = options.seed + static_cast<unsigned long long>(n)};
  };
  for (const SpringSet set : {SpringSet::louchet5, SpringSet::louchet18})
    for (int n = 0; n < options.seeds; ++n)
      recovery(set, small_cost_transitions(setting.states), options_of(n));
  for (int n = 0; n < options.compared_seeds(); ++n) {
    RecoveryOptions strategy_alone = options_of(n);
    strategy_alone.starts = 0;
    strategy_alone.searches = 1;
    recovery(SpringSet::louchet5,
             thinned_out(full_cost_transitions(setting.states), extent.full_cost_transitions),
             strategy_alone);
  }
  for (const Racer racer : kRacers)
    for (int n = 0; n < options.compared_seeds(); ++n)
      pieces.push_back({[=, &setting] {
                          return to_payload(race(setting.experiment, setting.states, racer,
                                                 options.seed + static_cast<unsigned long long>(n),
                                                 options.quick));
                        },
                        race_of});
  for (const int place : places_in_motion(setting.states, extent.places))
    for (int n = 0; n < options.compared_seeds(); ++n) {
      RecoveryOptions one_place = options_of(n);
      one_place.searches = 2;
      recovery(SpringSet::louchet5, {place}, one_place);
    }
  return pieces;
}

RecoveryTrials described(const Setting& setting, SpringSet set) {
  RecoveryTrials trials{.set = set, .truth = paper_truth(setting.experiment, set)};
  for (const FitParameter& parameter : setting.problem(set).space.parameters)
    trials.names.push_back(parameter.name);
  trials.relative_sigma =
      measured_sigmas(setting.experiment, setting.states, set, kFrameRate_hz, kMeasuringNoise_m);
  return trials;
}

Reconstruction reconstruction(const Setting& setting, const std::string& name,
                              const Eigen::VectorXd& values) {
  Reconstruction result{.name = name, .set = louchet5_of(values)};
  const RecordedStates& original = setting.states;
  const StateObjective full(setting.five, original, full_cost_transitions(original),
                            setting.experiment.time_step_s);
  result.cost_m2 = full.residuals({values}).front().squaredNorm();
  result.states = simulate_states(setting.five.cloth, parameter_set(setting.five, values),
                                  setting.experiment.time_step_s, setting.experiment.duration_s);
  result.rms_m = rms_distance_m(result.states, original);
  return result;
}

/// Returns the best and the worst final cost of the strategy alone on the full cost.
std::pair<const FullCostTrial*, const FullCostTrial*> best_and_worst(
    const std::vector<FullCostTrial>& trials) {
  const auto [best, worst] = std::minmax_element(
      trials.begin(), trials.end(), [](const FullCostTrial& a, const FullCostTrial& b) {
        return a.recovery.listed.front().cost < b.recovery.listed.front().cost;
      });
  return {&*best, &*worst};
}

}  // namespace

void Louchet1995Options::validate() const {
  constexpr int kMostSeeds = 10'000;
  if (seeds < 1 || seeds > kMostSeeds)
    throw InputError("--seeds", fmt::format("{} seeds", seeds), fmt::format("1 to {}", kMostSeeds));
  require_threads(threads);
}

std::string Louchet1995Options::key() const {
  JournalKey key("louchet1995/2");
  key.add("seeds", seeds).add("seed", seed).add("quick", quick);
  return key.line();
}

bool RecoveryTrials::determined(Eigen::Index p) const {
  return relative_sigma[p] < kDeterminedSigma;
}

double RecoveryTrials::determined_error(const RecoveryTrial& trial) const {
  double largest = 0;
  for (Eigen::Index p = 0; p < truth.size(); ++p)
    if (determined(p))
      largest = std::max(largest, std::abs(trial.recovery.refined.values[p] / truth[p] - 1));
  return largest;
}

Louchet1995Study study_louchet1995(const Louchet1995Options& options, Journal* journal,
                                   const ProgressCallback& progress) {
  options.validate();
  const Extent extent = Extent::of(options);
  const Setting setting;
  const Pieces pieces = pieces_of(options, setting);
  std::vector<double> seconds(pieces.size(), -1);
  const Work work = [&](int index, std::uint64_t) {
    const auto begin = std::chrono::steady_clock::now();
    std::string payload = pieces[static_cast<size_t>(index)].make();
    seconds[static_cast<size_t>(index)] =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return payload;
  };
  Louchet1995Study study;
  const auto accept = [&](int index, const std::string& payload) {
    pieces[static_cast<size_t>(index)].accept(payload);
  };
  const ExecuteResult done = execute(
      static_cast<int>(pieces.size()), work,
      {.threads = options.threads, .seed = options.seed, .unit = "pieces", .accept = accept},
      journal, progress);
  if (!done.usable()) {
    study.cancelled = true;
    return study;
  }

  // Payloads come in the order of the pieces.
  size_t next = 0;
  const auto payload = [&]() -> const std::string& { return done.payloads[next++]; };
  const auto seed_of = [&](int n) { return options.seed + static_cast<unsigned long long>(n); };
  study.experiment = setting.experiment;
  study.full_match = match_listing(setting.experiment, PaperCost::full);
  study.small_match = match_listing(setting.experiment, PaperCost::small);
  for (size_t n = 0; n < setting_readings().size(); ++n)
    study.settings.push_back(setting_search_of(payload()));
  for (size_t n = 0; n < 2 * kLandscapeElongations.size(); ++n)
    study.landscapes.push_back(landscape_of(payload()));
  for (RecoveryTrials* trials : {&study.five, &study.eighteen}) {
    *trials =
        described(setting, trials == &study.five ? SpringSet::louchet5 : SpringSet::louchet18);
    for (int n = 0; n < options.seeds; ++n) {
      RecoveryTrial trial{.seed = seed_of(n), .seconds = seconds[next]};
      trial.recovery = recovery_of(payload(), setting.parameters(trials->set));
      trial.error = largest_relative_error(trial.recovery.refined.values, trials->truth);
      trials->trials.push_back(std::move(trial));
    }
  }
  study.full_cost_transitions = std::min(extent.full_cost_transitions, setting.states.last());
  for (int n = 0; n < options.compared_seeds(); ++n)
    study.full_cost.push_back(
        {seed_of(n), recovery_of(payload(), setting.parameters(SpringSet::louchet5))});
  for (const Racer racer : kRacers) {
    study.races.push_back({.racer = racer});
    for (int n = 0; n < options.compared_seeds(); ++n)
      study.races.back().races.push_back(race_of(payload()));
  }
  for (const int transition : places_in_motion(setting.states, extent.places)) {
    PlaceInMotion place{
        .transition = transition,
        .time_s = setting.states.time_s[static_cast<size_t>(transition)],
        .share_at_limit = share_at_limit(setting.experiment, setting.states, transition),
        .relative_sigma = transition_sigmas(setting.experiment, setting.states, SpringSet::louchet5,
                                            transition, kMeasuringNoise_m)};
    for (int n = 0; n < options.compared_seeds(); ++n)
      place.errors.push_back(largest_relative_error(
          recovery_of(payload(), setting.parameters(SpringSet::louchet5)).refined.values,
          study.five.truth));
    study.places.push_back(std::move(place));
  }

  study.original = setting.states;
  const auto [best, worst] = best_and_worst(study.full_cost);
  study.reconstructions = {
      reconstruction(setting, "printed, good", to_vector(kPaperGoodListing.back().set)),
      reconstruction(setting, "printed, bad", to_vector(kPaperBadListing.back().set)),
      reconstruction(setting, "ours, best seed", best->recovery.listed.front().values),
      reconstruction(setting, "ours, worst seed", worst->recovery.listed.front().values)};
  return study;
}

}  // namespace clothfit
