#include "fit/fit.h"

#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cassert>
#include <chrono>
#include <cmath>
#include <limits>
#include <span>

#include "data/input_error.h"
#include "fit/lead_in.h"
#include "fit/marker_offsets.h"
#include "fit/observed_motion.h"
#include "fit/other_mesh.h"
#include "fit/parameter_profiles.h"
#include "fit/parameter_search.h"
#include "fit/problem.h"
#include "fit/refine.h"
#include "fit/report_residuals.h"
#include "fit/simulation.h"
#include "fit/springs_on_limit.h"
#include "fit/uncertainty.h"
#include "model/spring_vector.h"
#include "model/stability.h"

namespace clothfit {
namespace {

/// The search runs on a mesh of half the resolution: a run costs a sixteenth (a quarter of the
/// springs, and a quarter of the steps where damping limits them), and the basin is the same.
constexpr int kCoarsening = 2;
constexpr int kSmallestMesh = 7;

/// Shares of the fitted frames that the refinement's stages look at: whole trajectories of folding
/// cloth diverge from a start that is only roughly right. Those shorter than the search's window
/// are left out.
constexpr double kSearchShare = 0.4;
constexpr double kHorizonShares[] = {0.4, 0.7};
constexpr double kFineShares[] = {kSearchShare, 0.7};
/// A given start may be far off, and nothing has been simulated yet.
constexpr double kGivenShares[] = {0.1, 0.2, 0.4};
/// Closer than this factor to an end of its range a logarithmic parameter is at that end.
constexpr double kEnd = 1.5;
constexpr int kFewestFrames = 8;

/// Spring-steps that a search over the usual share may cost; its time step is cut no finer than
/// that. A longer window is allowed as much more.
constexpr double kSearchSpringSteps = 1.2e9;

/// How finely a stage is solved. The last one goes to the rounding of the reported digits; those
/// before only lead there, and look at slopes over wider spans: the cost of folding cloth is rough,
/// and its trend is what a start far away needs.
struct Effort {
  int iterations = RefineOptions().iterations;
  int rounds = 0;
  double least_gain = 0;
  Derivatives derivatives = Derivatives::tangents;
  double difference_step = 0;
  double trust_region_radius = RefineOptions().trust_region_radius;
  bool exact_in_the_end = false;
  double most_spring_steps = 0;  ///< a stage stops there: a wrong model may lead it on for hours
};
constexpr Effort kCoarseEffort{.rounds = 3,
                               .least_gain = 1e-3,
                               .derivatives = Derivatives::forward,
                               .difference_step = 2e-2,
                               .most_spring_steps = 1e9};
constexpr Effort kTrendEffort{.rounds = 2,
                              .least_gain = 1e-4,
                              .derivatives = Derivatives::forward,
                              .difference_step = 5e-3,
                              .most_spring_steps = 5e9};
constexpr Effort kApproachEffort{.iterations = 6,  // the coarse mesh's derivatives lead no further
                                 .rounds = 1,
                                 .least_gain = 1e-3,
                                 .derivatives = Derivatives::tangents,
                                 .most_spring_steps = 1e10};
constexpr Effort kRoughEffort{.rounds = 2,
                              .least_gain = 1e-4,
                              .derivatives = Derivatives::tangents,
                              .trust_region_radius = 1e4,
                              .most_spring_steps = 1e10};
constexpr Effort kFinalEffort{.rounds = 6,
                              .least_gain = 1e-7,
                              .derivatives = Derivatives::tangents,
                              .trust_region_radius = 1e6,
                              .exact_in_the_end = true,
                              .most_spring_steps = 2e10};

/// A log-parameter less certain than this (a factor of e^0.7 = 2 either way) is undetermined.
constexpr double kUndeterminedLogSigma = 0.7;

/// Basins differ by more than this share in some parameter, and by more than so many sigmas.
constexpr double kDifferentBasins = 0.05;
constexpr double kDifferentSigmas = 3;

/// A linear one is when its sigma is that of a uniform draw from its range, 1 / sqrt(12), about.
constexpr double kUndeterminedRangeShare = 0.25;

/// Parameters more strongly correlated than this do the same to the motion, about.
constexpr double kAlike = 0.95;

/// A cost whose local derivative is this many times that over two per cent is rough.
constexpr double kRough = 3;

int horizon_frames(const FitProblem& problem, double share) {
  const int wanted = static_cast<int>(std::lround(share * problem.first_held_out));
  return std::clamp(wanted, std::min(kFewestFrames, problem.first_held_out),
                    problem.first_held_out);
}

/// Natural lengths, where they are fitted, are those of one mesh.
int coarse(const FitProblem& problem, const FitOptions& options, int count) {
  if (problem.spring_set != SpringSet::fabric) return count;
  int smallest = kSmallestMesh;
  if (problem.start == StartKind::unknown) smallest = std::max(smallest, options.start_nodes + 1);
  return std::max(std::min(count, smallest), (count - 1) / kCoarsening + 1);
}

/// The time steps of a search: stable at the upper corner of the ranges if the budget allows; else
/// as fine as the budget allows, and individuals that would need a finer one rank last.
TimeSteps search_time_steps(const FitProblem& problem, const FitOptions& options, int frames) {
  Eigen::VectorXd corner = problem.space.start();
  for (int p = 0; p < problem.space.size(); ++p)
    if (is_physical(problem.space.parameters[static_cast<size_t>(p)].role))
      corner[p] = problem.space.parameters[static_cast<size_t>(p)].upper;
  const TimeSteps stable = stable_time_steps(problem.cloth, parameter_set(problem, corner));
  const double simulated_s =
      problem.frame_time_s[static_cast<size_t>(frames - 1)] - problem.frame_time_s.front();
  const auto simulations = static_cast<double>(search_simulations(options));
  const double affordable_s = simulated_s * static_cast<double>(problem.cloth.spring_count()) *
                              simulations /
                              (kSearchSpringSteps * options.search_share / kSearchShare);
  // Long recordings would otherwise leave steps at which hardly any individual is stable.
  const TimeSteps of_middle =
      stable_time_steps(problem.cloth, parameter_set(problem, problem.space.start()));
  const double run_s = std::max(stable.run_s, std::min(affordable_s, of_middle.run_s));
  return {run_s, std::max(run_s, stable.rest_s)};
}

/// The search over the physical parameters on a coarse mesh and a short window, with its line in
/// the report.
SearchedParameters search(const TrajectoryObjective& objective, const FitOptions& options,
                          const Eigen::VectorXd& start, const ProgressCallback& progress,
                          FitReport& report) {
  SearchedParameters found = search_parameters(objective, options, start, progress);
  const Mesh& mesh = objective.problem().cloth.mesh;
  report.search_cost = found.best_cost;
  report.stages.push_back(
      fmt::format("{}; {} simulations, mesh {} x {}, {} frames, time step {:.3g} s, cost in sigmas",
                  found.message, found.simulations, mesh.columns, mesh.rows, objective.frames(),
                  objective.time_step_s()));
  return found;
}

/// A stage of the refinement: which mesh, how much of the recording, how hard.
struct Stage {
  const FitProblem& problem;
  const FitProblem* derivatives_of = nullptr;  ///< a coarser mesh's; null: its own
  double share = 1;                            ///< of the fitted frames
  const Effort& effort;
};

/// One refinement, with its line in the report.
RefineResult refine_stage(const Stage& stage, const FitOptions& options,
                          const Eigen::VectorXd& start, const ProgressCallback& progress,
                          FitReport& report) {
  const FitProblem& problem = stage.problem;
  const RefineOptions refine_options{
      .iterations = stage.effort.iterations,
      .rounds = stage.effort.rounds,
      .least_gain = stage.effort.least_gain,
      .derivatives = stage.effort.derivatives,
      .difference_step = stage.effort.difference_step,
      .exact_in_the_end = stage.effort.exact_in_the_end,
      .loss = options.loss,
      .trust_region_radius = stage.effort.trust_region_radius,
      .most_spring_steps = options.work * stage.effort.most_spring_steps,
      .substep_scale = options.substep_scale};
  const int frames = horizon_frames(problem, stage.share);
  const auto make_objective = [&](const TimeSteps& steps) -> std::unique_ptr<Objective> {
    if (stage.derivatives_of == nullptr)
      return std::make_unique<TrajectoryObjective>(problem, frames, steps);
    // What is stable for the fine mesh is far more so for the coarse one.
    const double coarser =
        problem.cloth.mesh.spacing_s_m() / stage.derivatives_of->cloth.mesh.spacing_s_m();
    return std::make_unique<CoarselyDifferentiated>(problem, *stage.derivatives_of, frames, steps,
                                                    steps.times(1 / coarser));
  };
  RefineResult result = refine(problem, make_objective, start, refine_options, progress);
  report.stages.push_back(fmt::format(
      "refinement on {} x {}{} over {} frames: {} iterations, {} simulations, time step {:.3g} s, "
      "residuals of {:.2f} sigma; {}",
      problem.cloth.mesh.columns, problem.cloth.mesh.rows,
      stage.derivatives_of == nullptr ? "" : " with the coarse mesh's derivatives", frames,
      result.solver_iterations, result.simulations, result.time_step_s, result.robust_scale,
      result.message));
  return result;
}

/// The cost of a search (Objective::mean_length), at time steps that are stable for these values.
double search_cost(const TrajectoryObjective& objective, const Eigen::VectorXd& values) {
  const FitProblem& problem = objective.problem();
  const TimeSteps stable = stable_time_steps(problem.cloth, parameter_set(problem, values))
                               .times(1 / RefineOptions().stability_margin);
  const TimeSteps& searched = objective.steps();
  const TrajectoryObjective safe(
      problem, objective.frames(),
      {std::min(searched.run_s, stable.run_s), std::min(searched.rest_s, stable.rest_s)});
  return safe.mean_length(safe.residuals({values}).front());
}

/// Whether the model follows the cloth over the window of a search (fit/observed_motion.h).
bool follows(const FitProblem& problem, const Eigen::VectorXd& values) {
  const double any_step_s = std::numeric_limits<double>::infinity();
  const TrajectoryObjective window(problem, horizon_frames(problem, kSearchShare), any_step_s);
  return search_cost(window, values) < cost_of_following(window);
}

/// Logarithmic parameters that a coarse mesh has driven to an end of their range go back to where a
/// fit begins: there the residuals hardly change with the logarithm, and a first step on the finer
/// mesh would leap across the range.
Eigen::VectorXd away_from_ends(const ParameterSpace& space, const Eigen::VectorXd& values) {
  const Eigen::VectorXd start = space.start();
  Eigen::VectorXd result = values;
  for (int p = 0; p < space.size(); ++p) {
    const FitParameter& parameter = space.parameters[static_cast<size_t>(p)];
    if (parameter.scale != ParameterScale::logarithmic) continue;
    const bool at_end = values[p] < kEnd * parameter.lower || values[p] > parameter.upper / kEnd;
    if (at_end) result[p] = start[p];
  }
  return result;
}

/// Refinement, stage after stage: on the coarse mesh over growing horizons, then on the fit's own
/// mesh, first with the coarse one's derivatives.
RefineResult refine_on(const FitProblem& coarse_problem, const FitProblem& problem,
                       const FitOptions& options, const Eigen::VectorXd& start,
                       std::span<const double> coarse_shares, const ProgressCallback& progress,
                       FitReport& report) {
  const double least_share = options.start ? 0 : options.search_share;
  RefineResult best;
  best.values = start;
  const auto improve = [&](const Stage& stage) {
    best = refine_stage(stage, options, best.values, progress, report);
    return !best.cancelled && best.usable;
  };
  // Where the model follows the cloth already the coarse mesh has nothing more to teach.
  if (!follows(problem, start) && !follows(coarse_problem, start)) {
    for (const double share : coarse_shares)
      if (share >= least_share &&
          !improve({.problem = coarse_problem, .share = share, .effort = kTrendEffort}))
        return best;
    best.values = away_from_ends(problem.space, best.values);
    if (!improve({.problem = problem,
                  .derivatives_of = &coarse_problem,
                  .share = std::max(kSearchShare, least_share),
                  .effort = kApproachEffort}))
      return best;
  }
  best.values = away_from_ends(problem.space, best.values);
  for (const double share : kFineShares)
    if (share >= least_share &&
        !improve({.problem = problem, .share = share, .effort = kRoughEffort}))
      return best;
  improve({.problem = problem, .effort = kFinalEffort});
  return best;
}

/// What a search found, after refinement where there was one.
struct Candidate {
  Eigen::VectorXd values;
  double cost = 0;  ///< as the search has it: Objective::mean_length
  int runs = 0;
  bool refined = false;
};

/// The one of the optima of a search that gets furthest over a short horizon on the coarse mesh.
/// `candidates` are all of them, the best few refined, up to the first that follows the cloth.
RefineResult pick_best(const TrajectoryObjective& objective, const FitOptions& options,
                       const std::vector<SearchOptimum>& optima, const ProgressCallback& progress,
                       FitReport& report, std::vector<Candidate>& candidates) {
  RefineResult best;
  best.values = optima.front().values;
  best.cost = std::numeric_limits<double>::infinity();
  bool enough = false;
  for (const SearchOptimum& optimum : optima) {
    candidates.push_back({.values = optimum.values, .cost = optimum.cost, .runs = optimum.runs});
    if (enough || static_cast<int>(candidates.size()) > options.refine_best) continue;
    RefineResult result = refine_stage(
        {.problem = objective.problem(), .share = options.search_share, .effort = kCoarseEffort},
        options, optimum.values, progress, report);
    if (result.cancelled) return result;
    if (!result.usable) continue;
    const double cost = search_cost(objective, result.values);
    if (std::isfinite(cost))
      candidates.back() = {
          .values = result.values, .cost = cost, .runs = optimum.runs, .refined = true};
    if (result.cost < best.cost) best = std::move(result);
    enough = candidates.back().cost < cost_of_following(objective);
  }
  return best;
}

/// Candidates that ended in the same place, put together; best first.
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

/// Where a fit begins without a search: the values given, within their ranges.
Eigen::VectorXd given_start(const FitProblem& problem, const std::map<std::string, double>& given) {
  Eigen::VectorXd values = problem.space.start();
  for (const auto& [name, value] : given) {
    const int p = problem.space.index(name);
    if (p < 0)
      throw InputError("--start", "the fit has no parameter '" + name + "'",
                       "a fit of the same parameter set and effects");
    const FitParameter& parameter = problem.space.parameters[static_cast<size_t>(p)];
    values[p] = std::clamp(value, parameter.lower, parameter.upper);
  }
  return values;
}

/// From the ranges to the optimum. `candidates` are what the search found on the way.
RefineResult search_and_refine(const FitProblem& coarse_problem, const FitProblem& problem,
                               const FitOptions& options, const ProgressCallback& progress,
                               FitReport& report, std::vector<Candidate>& candidates) {
  Eigen::VectorXd start = problem.space.start();
  if (problem.start == StartKind::unknown) {
    // A search needs to know where the cloth begins: from the middle of the ranges, over the first
    // frames, which say more of the start than of the fabric.
    const RefineResult first =
        refine_stage({.problem = coarse_problem, .share = 0, .effort = kCoarseEffort}, options,
                     start, progress, report);
    if (first.cancelled || !first.usable) return first;
    for (int p = 0; p < problem.space.size(); ++p)
      if (problem.space.parameters[static_cast<size_t>(p)].role == ParameterRole::start)
        start[p] = first.values[p];
  }
  const int frames = horizon_frames(coarse_problem, options.search_share);
  const TrajectoryObjective objective(coarse_problem, frames,
                                      search_time_steps(coarse_problem, options, frames));
  const SearchedParameters found = search(objective, options, start, progress, report);
  if (found.optima.empty() || found.cancelled) {
    RefineResult none;
    none.cancelled = found.cancelled;
    none.message = "no individual of the search could be simulated to the end of its window";
    return none;
  }
  const RefineResult best =
      pick_best(objective, options, found.optima, progress, report, candidates);
  if (best.cancelled) return best;
  return refine_on(coarse_problem, problem, options, best.values, kHorizonShares, progress, report);
}

/// The whole way to the optimum: from a given start or where another cost leads, and from the
/// ranges where there is neither or where it does not lead to an optimum.
RefineResult identify(const FitInput& input, const FitProblem& problem, const FitOptions& options,
                      const ProgressCallback& progress, FitReport& report,
                      std::vector<Candidate>& candidates) {
  const FitProblem coarse_problem =
      make_problem(input, options, coarse(problem, options, problem.cloth.mesh.columns),
                   coarse(problem, options, problem.cloth.mesh.rows));
  RefineResult from_start;
  const bool led = options.cost != LeadingCost::trajectory;
  if (options.start || led) {
    Eigen::VectorXd start =
        options.start ? given_start(problem, *options.start) : problem.space.start();
    if (led) {
      LeadIn lead = lead_in(problem, coarse_problem, options, start, progress);
      report.stages.push_back(lead.stage);
      from_start.cancelled = lead.cancelled;
      if (lead.cancelled) return from_start;
      if (lead.usable) start = std::move(lead.values);
    }
    from_start = refine_on(coarse_problem, problem, options, start, kGivenShares, progress, report);
    if (from_start.cancelled || (from_start.usable && from_start.converged)) return from_start;
    report.stages.push_back(led ? "the " + to_string(options.cost) + " cost leads to no optimum"
                                : "the given start leads to no optimum");
  }
  RefineResult found =
      search_and_refine(coarse_problem, problem, options, progress, report, candidates);
  const bool better =
      found.cancelled || !from_start.usable || (found.usable && found.cost < from_start.cost);
  return better ? found : from_start;
}

ParameterEstimate estimate(const FitParameter& parameter, const std::string& name, double value,
                           double sigma, double roughness) {
  ParameterEstimate result{.name = name, .unit = parameter.unit, .value = value, .sigma = sigma};
  const bool logarithmic = parameter.scale == ParameterScale::logarithmic;
  const double edge = logarithmic ? 1e-3 * value : 1e-6 * (parameter.upper - parameter.lower);
  const double relative = sigma / value;
  if (logarithmic && !(relative < kUndeterminedLogSigma)) {
    result.state = ParameterState::undetermined;
    result.reason = fmt::format("the motion hardly depends on it (sigma {:.0f} % of the value)",
                                100 * std::min(relative, 1e4));
    result.sigma = std::min(sigma, 1e4 * value);
  } else if (!logarithmic && is_physical(parameter.role) &&
             !(sigma < kUndeterminedRangeShare * (parameter.upper - parameter.lower))) {
    result.state = ParameterState::undetermined;
    result.reason = fmt::format("the motion hardly depends on it (sigma {:.0f} % of its range)",
                                100 * std::min(sigma / (parameter.upper - parameter.lower), 1e4));
    result.sigma = std::min(sigma, 1e4 * (parameter.upper - parameter.lower));
  } else if (roughness > kRough) {
    result.state = ParameterState::undetermined;
    result.reason = fmt::format(
        "the cost is rough here (its slope over 0.01 % is {:.0f} times that over 2 %), as where "
        "cloth folds and unfolds: sigma means nothing",
        roughness);
  } else if (value - parameter.lower < edge || parameter.upper - value < edge) {
    const bool at_neutral =
        parameter.role == ParameterRole::effect && value - parameter.lower < edge;
    if (!at_neutral) {
      result.state = ParameterState::undetermined;
      result.reason = fmt::format("it ended at the {} end of its range",
                                  value - parameter.lower < edge ? "lower" : "upper");
    }
  }
  return result;
}

ParameterEstimate constant(const std::string& name, const std::string& unit, double value,
                           const std::string& reason) {
  return {.name = name,
          .unit = unit,
          .value = value,
          .sigma = 0,
          .state = ParameterState::fixed,
          .reason = reason};
}

/// The parameter that is hardest to tell from the p-th, and their correlation.
std::pair<int, double> nearest_parameter(const Eigen::MatrixXd& correlation, int p) {
  std::pair<int, double> nearest{-1, 0};
  for (int other = 0; other < static_cast<int>(correlation.cols()); ++other)
    if (other != p && std::abs(correlation(p, other)) > std::abs(nearest.second))
      nearest = {other, correlation(p, other)};
  return nearest;
}

/// Says so where a parameter is undetermined because another one does the same: where the cloth or
/// the camera was placed, say, or the scale of gravity.
void explain_by_correlation(const ParameterSpace& space, const Uncertainty& uncertainty, int p,
                            ParameterEstimate& parameter) {
  if (parameter.state != ParameterState::undetermined) return;
  const auto [other, correlation] = nearest_parameter(uncertainty.correlation, p);
  if (other < 0 || !(std::abs(correlation) > kAlike)) return;
  const FitParameter& alike = space.parameters[static_cast<size_t>(other)];
  std::string name = alike.name;
  if (alike.role == ParameterRole::nuisance) name += " (how the scene was placed)";
  if (alike.role == ParameterRole::start) name += " (where the cloth was at the start)";
  parameter.reason +=
      fmt::format("; it can hardly be told from {} (correlation {:.3f})", name, correlation);
}

/// A spring that sits on its strain limit is as long as that allows, however stiff it is.
void explain_by_strain_limit(const FitProblem& problem, const Eigen::VectorXd& values,
                             const SpringsOnLimit& count,
                             std::vector<ParameterEstimate>& parameters) {
  Eigen::VectorXd numbers(static_cast<Eigen::Index>(problem.spring_numbers.size()));
  for (size_t n = 0; n < problem.spring_numbers.size(); ++n)
    numbers[static_cast<Eigen::Index>(n)] = problem.spring_numbers[n].value(values);
  const Eigen::MatrixXd springs = springs_by_numbers(problem.spring_set, numbers);
  const std::vector<SpringNumber> names = numbers_of(problem.spring_set);
  for (size_t n = 0; n < names.size(); ++n) {
    if (names[n].quantity != SpringQuantity::stiffness) continue;
    if (problem.spring_numbers[n].parameter < 0) continue;
    long on = 0, all = 0;
    for (size_t type = 0; type < kSpringTypes; ++type) {
      const auto row = static_cast<Eigen::Index>(stiffness_block + type);
      if (springs(row, static_cast<Eigen::Index>(n)) == 0) continue;
      on += count.on[type];
      all += count.all[type];
    }
    if (2 * on <= all) continue;
    const auto found = std::ranges::find(parameters, names[n].name, &ParameterEstimate::name);
    assert(found != parameters.end());
    found->state = ParameterState::undetermined;
    found->interval_90.reset();
    found->bootstrap_90.reset();
    found->interval_by_profile = false;
    found->reason = fmt::format(
        "{:.0f} % of its springs sit on their strain limit in the fitted frames, as long as that "
        "allows however stiff they are",
        100.0 * static_cast<double>(on) / static_cast<double>(all));
  }
}

/// What is asked for beside sigma.
struct FurtherLooks {
  std::vector<ParameterProfile> profiles;
  OtherMesh other_mesh;
};

/// Profiles and the fit on another mesh, where the options ask for them, each with its line in the
/// report.
FurtherLooks look_further(const FitInput& input, const TrajectoryObjective& objective,
                          const FitOptions& options, const Eigen::VectorXd& values,
                          const Uncertainty& uncertainty, const ProgressCallback& progress,
                          FitReport& report) {
  const FitProblem& problem = objective.problem();
  FurtherLooks looks;
  if (options.profile) {
    looks.profiles = parameter_profiles(objective, values, uncertainty, options.loss, progress);
    for (const ParameterProfile& profile : looks.profiles) {
      const std::string& name =
          problem.space.parameters[static_cast<size_t>(profile.parameter)].name;
      const std::string ends =
          profile.profiled
              ? fmt::format("profiled: {:.4g} to {:.4g}{}", profile.lower, profile.upper,
                            profile.profile.optimum_was_none
                                ? "; lower costs than the optimum's were met"
                                : "")
              : "a parabola";
      report.stages.push_back(fmt::format(
          "{}: at the ends of its interval the cost rises {:.2f} and {:.2f} times as far as a "
          "parabola; {}",
          name, profile.rise_below, profile.rise_above, ends));
    }
  }
  if (options.two_meshes) {
    const Mesh& mesh = problem.cloth.mesh;
    const int least = std::max(kSmallestMesh, options.start_nodes + 1);
    const FitProblem other = make_problem(input, options, other_mesh_count(mesh.columns, least),
                                          other_mesh_count(mesh.rows, least));
    const RefineOptions refine_options{
        .loss = options.loss,
        .trust_region_radius = kFinalEffort.trust_region_radius,
        .most_spring_steps = options.work * kFinalEffort.most_spring_steps,
        .substep_scale = options.substep_scale};
    looks.other_mesh = fit_on_other_mesh(other, values, refine_options, progress);
    report.stages.push_back(fmt::format("the fit again on {} x {}, for the mesh's share: {}",
                                        looks.other_mesh.columns, looks.other_mesh.rows,
                                        looks.other_mesh.message));
  }
  return looks;
}

/// The intervals of the p-th parameter.
void add_intervals(int p, const Uncertainty& uncertainty, const FurtherLooks& looks,
                   ParameterEstimate& parameter) {
  if (looks.other_mesh.usable) parameter.mesh_shift = looks.other_mesh.shift[p];
  if (parameter.state != ParameterState::fitted) return;
  parameter.interval_90 = {.lower = uncertainty.lower[p], .upper = uncertainty.upper[p]};
  if (uncertainty.bootstrap_lower.size() > 0)
    parameter.bootstrap_90 = {.lower = uncertainty.bootstrap_lower[p],
                              .upper = uncertainty.bootstrap_upper[p]};
  const auto profile = std::ranges::find(looks.profiles, p, &ParameterProfile::parameter);
  if (profile == looks.profiles.end() || !profile->profiled || !profile->profile.preferable())
    return;
  parameter.interval_90 = {.lower = profile->lower, .upper = profile->upper};
  parameter.interval_by_profile = true;
}

/// The parameter tables of the result from the fitted values.
void fill_parameters(const FitProblem& problem, const FitOptions& options,
                     const Eigen::VectorXd& values, const Uncertainty& uncertainty,
                     const FurtherLooks& looks, FitResult& result) {
  const auto estimate_of = [&](int p, const std::string& name) {
    ParameterEstimate parameter =
        estimate(problem.space.parameters[static_cast<size_t>(p)], name, values[p],
                 uncertainty.sigma[p], uncertainty.roughness[p]);
    explain_by_correlation(problem.space, uncertainty, p, parameter);
    add_intervals(p, uncertainty, looks, parameter);
    return parameter;
  };
  const double area_m2 = problem.cloth.mesh.width_m * problem.cloth.mesh.height_m;
  ParameterEstimate density =
      constant("areal_density", "kg/m2", problem.cloth_mass_kg / area_m2, "weighed");
  if (problem.mass_assumed) {
    density.state = ParameterState::undetermined;
    density.reason =
        "the cloth was not weighed and nothing but gravity loads it: only ratios to mass are "
        "determined; stiffness refers to this assumed value";
  }
  result.parameters.push_back(density);

  for (int p = 0; p < problem.space.size(); ++p) {
    const FitParameter& parameter = problem.space.parameters[static_cast<size_t>(p)];
    if (parameter.role == ParameterRole::effect || parameter.role == ParameterRole::start) continue;
    auto& list = parameter.role == ParameterRole::springs ? result.parameters : result.nuisance;
    list.push_back(estimate_of(p, parameter.name));
  }
  if (options.forecast) {
    for (const ParameterEstimate& known : options.forecast->parameters)
      if (known.name != "areal_density")
        result.parameters.push_back(constant(known.name, known.unit, known.value, "given"));
  }
  for (size_t e = 0; e < problem.effects.size(); ++e) {
    const EffectDescription& description = problem.cloth.effect_descriptions[e];
    EffectEstimate effect{.name = description.name, .parameters = {}};
    for (size_t p = 0; p < description.parameters.size(); ++p) {
      const Binding& binding = problem.effects[e][p];
      const EffectParameter& parameter = description.parameters[p];
      effect.parameters.push_back(binding.parameter >= 0
                                      ? estimate_of(binding.parameter, parameter.name)
                                      : constant(parameter.name, parameter.unit, binding.constant,
                                                 options.forecast ? "given" : "declared"));
    }
    result.effects.push_back(std::move(effect));
  }
}

/// Of all parameters but those of the start, of which there may be hundreds.
void fill_correlation(const ParameterSpace& space, const Uncertainty& uncertainty,
                      FitReport& report) {
  std::vector<int> shown;
  for (int p = 0; p < space.size(); ++p) {
    if (space.parameters[static_cast<size_t>(p)].role == ParameterRole::start) continue;
    shown.push_back(p);
    report.correlation_names.push_back(space.parameters[static_cast<size_t>(p)].name);
  }
  report.correlation = uncertainty.correlation(shown, shown);
}

/// Of the physics, what sigma is made of; of all, what residuals it was made from.
void add_uncertainty(const FitProblem& problem, const Eigen::VectorXd& values,
                     const Uncertainty& uncertainty, FitReport& report) {
  for (int p = 0; p < problem.space.size(); ++p) {
    const FitParameter& parameter = problem.space.parameters[static_cast<size_t>(p)];
    if (!is_physical(parameter.role)) continue;
    report.sigma_parts.push_back(
        {.name = parameter.name,
         .value = values[p],
         .noise = uncertainty.noise_sigma[p],
         .robust = uncertainty.robust_sigma[p],
         .step_shift = uncertainty.step_shift[p],
         .degrees_of_freedom = uncertainty.degrees_of_freedom[p],
         .interval_90 = {.lower = uncertainty.lower[p], .upper = uncertainty.upper[p]}});
  }
  const BlockCounts& counts = uncertainty.block_counts;
  const std::string blocks =
      uncertainty.blocks > 0
          ? fmt::format("sigma over {} blocks ({} along s, {} along t, {} in time)",
                        uncertainty.blocks, counts.along_s, counts.along_t, counts.in_time)
          : "sigma of independent residuals alone: " + uncertainty.why_no_blocks;
  report.stages.push_back(fmt::format("chi-square per degree of freedom {:.3g}; {}",
                                      uncertainty.chi_square_per_dof, blocks));
}

/// Columns and rows. Natural lengths that come from an earlier fit are those of its mesh.
std::pair<int, int> mesh_of(const ClothDescription& cloth, const FitOptions& options) {
  std::pair<int, int> suggested{cloth.mesh_columns, cloth.mesh_rows};
  const bool of_one_mesh = options.forecast && options.spring_set != SpringSet::fabric;
  if (of_one_mesh) suggested = {options.forecast->mesh_columns, options.forecast->mesh_rows};
  const std::pair<int, int> mesh{options.mesh_columns > 0 ? options.mesh_columns : suggested.first,
                                 options.mesh_rows > 0 ? options.mesh_rows : suggested.second};
  if (of_one_mesh && mesh != suggested)
    throw InputError("--mesh", "the natural lengths of the earlier fit are those of its own mesh",
                     fmt::format("{}x{}", suggested.first, suggested.second), "leave --mesh out");
  return mesh;
}

/// Constants that predictions of the markers get, 3 x markers, with their part of the report: what
/// the fitted frames ask for, or what the earlier fit of a forecast found for markers of such
/// names. None where there are none.
Eigen::Matrix3Xd marker_offsets(const FitProblem& problem, const MarkerSet& markers,
                                const FitOptions& options,
                                const std::vector<Eigen::Matrix3Xd>& mesh_positions,
                                FitReport& report) {
  const std::vector<MarkerOffset> known =
      options.forecast ? options.forecast->marker_offsets : std::vector<MarkerOffset>();
  const auto count = static_cast<Eigen::Index>(markers.markers.size());
  Eigen::Matrix3Xd offset_m;
  if (problem.marker_offset_sigma_m > 0) {
    offset_m = estimate_offsets(problem.observations.front(),
                                marker_positions(problem.vertex_weights, mesh_positions),
                                problem.first_held_out, problem.marker_offset_sigma_m);
  } else if (!known.empty()) {
    offset_m = Eigen::Matrix3Xd::Zero(3, count);
    for (const MarkerOffset& offset : known)
      if (const auto found = markers.index.find(offset.marker); found != markers.index.end())
        offset_m.col(found->second) = offset.offset_m;
  } else {
    return {};
  }
  Eigen::Index furthest = 0;
  const double most_m = offset_m.colwise().norm().maxCoeff(&furthest);
  report.stages.push_back(
      fmt::format("offsets of markers{}: {:.2g} mm rms, at most {:.2g} mm (marker {})",
                  options.forecast ? " of the earlier fit" : "",
                  1e3 * std::sqrt(offset_m.squaredNorm() / static_cast<double>(count)),
                  1e3 * most_m, markers.markers[static_cast<size_t>(furthest)].name));
  report.result.marker_offset_sigma_m = problem.marker_offset_sigma_m;
  for (Eigen::Index m = 0; m < count; ++m)
    if (!offset_m.col(m).isZero(0))
      report.result.marker_offsets.push_back(
          {.marker = markers.markers[static_cast<size_t>(m)].name, .offset_m = offset_m.col(m)});
  return offset_m;
}

FitReport stopped(FitReport report, FitStop stop, const std::string& message) {
  report.stop = stop;
  report.message = message;
  return report;
}

}  // namespace

void FitOptions::validate() const {
  const auto require = [](bool good, const std::string& name, const std::string& expected) {
    if (!good) throw InputError("--" + name, "is out of range", expected);
  };
  require(mesh_columns == 0 || mesh_columns >= 2, "mesh", "at least 2 columns");
  require(mesh_rows == 0 || mesh_rows >= 2, "mesh", "at least 2 rows");
  require(population >= 4 && population <= 100000, "population", "4 to 100000 individuals");
  require(generations >= 1, "generations", "at least 1");
  require(search_share > 0 && search_share <= 1, "search-share", "more than 0, at most 1");
  require(refine_best >= 1, "refine-best", "at least 1");
  require(!stop_cost || !std::isnan(*stop_cost), "stop-cost", "a mean error in sigmas");
  require(!resume || !checkpoint.empty(), "resume", "a --checkpoint to go on from");
  require(checkpoint.empty() || (!start && !forecast), "checkpoint",
          "a fit that searches: without --start and --forecast");
  require(cost == LeadingCost::trajectory || checkpoint.empty(), "checkpoint",
          "a fit that searches: with --cost trajectory");
  require(cost == LeadingCost::trajectory || !forecast, "cost", "a fit: without --forecast");
  require(substep_scale >= 1 && std::isfinite(substep_scale), "substep-scale", "1 or more");
  require(start_nodes >= 2 && start_nodes <= 30, "start-nodes", "2 to 30 nodes a side");
  require(marker_offset_sigma_m >= 0 && std::isfinite(marker_offset_sigma_m), "marker-offsets",
          "a length in metres, 0 (none) or more");
  require(marker_offset_sigma_m == 0 || !forecast, "marker-offsets",
          "a fit: a forecast takes those of the earlier one");
  require(work > 0 && std::isfinite(work), "work", "more than 0");
  require(bootstrap == 0 || (bootstrap >= 19 && bootstrap <= 100000), "bootstrap",
          "19 to 100000 replicates");
  const auto need_a_fit = [&](bool asked, const std::string& name) {
    require(!asked || !forecast, name, "a fit: without --forecast");
  };
  need_a_fit(profile, "profile");
  need_a_fit(bootstrap > 0, "bootstrap");
  need_a_fit(two_meshes, "two-meshes");
  require(!two_meshes || spring_set == SpringSet::fabric, "two-meshes",
          "--springs fabric: natural lengths are those of one mesh");
  require(threads >= 0, "threads", "0 (all) or more");
}

FitReport fit(const FitInput& input, const FitOptions& options, const ProgressCallback& progress) {
  options.validate();
  const auto began = std::chrono::steady_clock::now();
  const tbb::global_control threads(
      tbb::global_control::max_allowed_parallelism,
      options.threads > 0
          ? static_cast<size_t>(options.threads)
          : tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));

  const auto [columns, rows] = mesh_of(input.recording.cloth, options);
  const FitProblem problem = make_problem(input, options, columns, rows);
  FitReport report;
  FitResult& result = report.result;
  result.recording = input.recording.name;
  result.seed = options.seed;
  result.mesh_columns = problem.cloth.mesh.columns;
  result.mesh_rows = problem.cloth.mesh.rows;
  result.parameter_set = to_string(problem.spring_set);
  result.integrator = "euler";
  result.start = to_string(problem.start);
  result.observations_rejected = problem.rejected;

  Eigen::VectorXd values = problem.space.start();
  const auto steps_at = [&](const Eigen::VectorXd& at) {
    return time_steps_of_run(problem.cloth, parameter_set(problem, at), result.time_step_s);
  };
  Uncertainty uncertainty;
  FurtherLooks looks;
  if (!options.forecast) {
    std::vector<Candidate> candidates;
    const RefineResult refined = identify(input, problem, options, progress, report, candidates);
    if (refined.cancelled) return stopped(std::move(report), FitStop::cancelled, "cancelled");
    if (!refined.usable)
      return stopped(std::move(report), FitStop::diverged, "no fit worked out: " + refined.message);
    values = refined.values;
    result.time_step_s = refined.time_step_s;
    report.stop = refined.converged ? FitStop::converged : FitStop::reached_limit;
    report.message = refined.message;
    const TrajectoryObjective objective(problem, problem.first_held_out, steps_at(values));
    uncertainty = estimate_uncertainty(
        objective, values,
        {.loss = options.loss, .bootstrap = options.bootstrap, .seed = options.seed},
        refined.residual_by_coordinate);
    if (!uncertainty.usable)
      return stopped(std::move(report), FitStop::diverged,
                     "the derivatives at the optimum could not be computed");
    fill_correlation(problem.space, uncertainty, report);
    result.basins = basins_of(problem.space, std::move(candidates), values, uncertainty);
    add_uncertainty(problem, values, uncertainty, report);
    bool cancelled = false;
    const ProgressCallback watched = [&](const Progress& now) {
      cancelled = cancelled || (progress && !progress(now));
      return !cancelled;
    };
    looks = look_further(input, objective, options, values, uncertainty, watched, report);
    if (cancelled) return stopped(std::move(report), FitStop::cancelled, "cancelled");
  } else {
    const RefineOptions defaults;
    result.time_step_s = stable_time_step_s(problem.cloth, parameter_set(problem, values)) /
                         (defaults.stability_margin * options.substep_scale);
    report.stages.push_back("forecast: nothing fitted");
  }

  const auto trajectories = run_model(problem, {values}, problem.frames(), steps_at(values));
  if (trajectories.front().empty())
    return stopped(std::move(report), FitStop::diverged,
                   "the model diverged when it was run on through all frames");
  double longest_frame_s = 0;
  for (size_t f = 1; f < problem.frame_time_s.size(); ++f)
    longest_frame_s =
        std::max(longest_frame_s, problem.frame_time_s[f] - problem.frame_time_s[f - 1]);
  result.substeps = static_cast<int>(std::ceil(longest_frame_s / result.time_step_s - 1e-9));
  fill_parameters(problem, options, values, uncertainty, looks, result);
  const std::vector<Eigen::Matrix3Xd> fitted_frames(
      trajectories.front().begin(), trajectories.front().begin() + problem.first_held_out);
  explain_by_strain_limit(
      problem, values,
      springs_on_limit(problem.cloth, parameter_set(problem, values).springs, fitted_frames),
      result.parameters);
  report.model = describe_model(problem, input.recording, values);
  report.model.time_step_s = result.time_step_s;
  fill_residuals(
      problem, trajectories.front(),
      marker_offsets(problem, input.recording.markers, options, trajectories.front(), report),
      report);
  for (const ObservationSet& set : problem.observations)
    result.observations_used += static_cast<int>(set.rows.size());
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  return report;
}

}  // namespace clothfit
