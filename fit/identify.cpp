#include "fit/identify.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>

#include "data/input_error.h"
#include "fit/cost/observed_motion.h"
#include "fit/problem/mesh_ladder.h"
#include "fit/problem/parameterised_model.h"
#include "fit/problem/prior_cost.h"
#include "fit/refine/lead_in.h"
#include "fit/search/parameter_search.h"
#include "model/cloth/stability.h"

namespace clothfit {
namespace {

/// The search runs on a mesh of half the resolution: a run costs a sixteenth (a quarter of the
/// springs, and a quarter of the steps where damping limits them), and the basin is the same.
constexpr int kCoarsening = 2;

/// Shares of the fitted frames that the refinement's stages look at: whole trajectories of folding
/// cloth diverge from a start that is only roughly right. Those shorter than the search's window
/// are left out.
constexpr double kSearchShare = 0.4;
constexpr double kHorizonShares[] = {0.4, 0.7};
constexpr double kFineShares[] = {kSearchShare, 0.7};
/// A given start may be far off, and nothing has been simulated yet.
constexpr double kGivenShares[] = {0.1, 0.2, 0.4};
/// Horizons for an optimum that may be local. Over so few frames there is but one; steps are so
/// short that a horizon's optimum lies in the next one's basin.
constexpr double kSecondLookShares[] = {0.2, 0.25, 0.3, 0.36, 0.45, 0.7, 1};
/// Closer than this factor to an end of its range a logarithmic parameter is at that end.
constexpr double kEnd = 1.5;
constexpr int kFewestFrames = 8;

/// Spring-steps that a search over the usual share may cost; its time step is cut no finer than
/// that. A longer window is allowed as much more.
constexpr double kSearchSpringSteps = 1.2e9;

/// The precision to which a stage is solved. The last one goes to the rounding of the reported
/// digits. Those before only lead there, and look at slopes over wider spans: the cost of folding
/// cloth is rough, and its trend is what a start far away needs.
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
/// Coordinates of a fit for which the limits of work below are meant.
constexpr double kUsualCoordinates = 20;
/// A fit with more coordinates may take up to this many times as much work. swing_moving takes 1.4
/// times. A quicker cloth of 13 x 16 vertices is cut short by 4, its stiffness within 12 %, and
/// said not to have converged. A higher value costs an hour where the model is wrong.
constexpr double kMostCoordinatesShare = 6;
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
/// A glance tells a model that is far off for good from one that steps lead to the cloth. An
/// iteration over the hundreds of coordinates of a start takes seconds.
constexpr Effort kGlanceEffort{
    .iterations = 3, .rounds = 1, .derivatives = Derivatives::tangents, .most_spring_steps = 1e10};
/// A model is far off beyond both: sigmas, which noise does not make, and a share of the observed
/// motion. Over the first frames models that explained a recording in motion left 0.01 to 0.06 of
/// it; phisft_r1, on which the share was chosen, leaves twice as much as there is. Higher shares
/// cost minutes of a fit that ends with no, lower ones fits that begin far away.
constexpr double kFarOffSigmas = 10;
constexpr double kFarOffShare = 0.5;
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

/// From a local optimum: on a shorter horizon the same basin leads past it.
constexpr Effort kSecondLookEffort{.rounds = 3,
                                   .least_gain = 1e-6,
                                   .derivatives = Derivatives::tangents,
                                   .trust_region_radius = 1e4,
                                   .exact_in_the_end = true,
                                   .most_spring_steps = 1e10};
/// Standard deviations by which the squared residuals may exceed what noise alone leaves: a second
/// look where it is not needed costs less than one that is missed.
constexpr double kNoiseDeviations = 1;

bool starts_in_motion(const FitProblem& problem) {
  return problem.start == StartKind::unknown;
}

int horizon_frames(const FitProblem& problem, double share) {
  const int wanted = static_cast<int>(std::lround(share * problem.first_held_out));
  return std::clamp(wanted, std::min(kFewestFrames, problem.first_held_out),
                    problem.first_held_out);
}

/// Natural lengths, where they are fitted, are those of one mesh.
int coarse(const FitProblem& problem, const FitOptions& options, int count) {
  if (problem.spring_set != SpringSet::fabric) return count;
  int smallest = kSmallestMesh;
  if (starts_in_motion(problem))
    smallest = std::max(smallest, vertices_for_start(options.start_nodes));
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

RefineOptions refine_options_of(const Effort& effort, const FitProblem& problem,
                                const FitOptions& options) {
  // An unknown start has hundreds of coordinates, each with its derivatives.
  const double coordinates_share =
      std::clamp(problem.space.size() / kUsualCoordinates, 1.0, kMostCoordinatesShare);
  return {.iterations = effort.iterations,
          .rounds = effort.rounds,
          .least_gain = effort.least_gain,
          .derivatives = effort.derivatives,
          .difference_step = effort.difference_step,
          .exact_in_the_end = effort.exact_in_the_end,
          .loss = options.loss,
          .trust_region_radius = effort.trust_region_radius,
          .most_spring_steps = options.work * coordinates_share * effort.most_spring_steps,
          .substep_scale = options.substep_scale};
}

/// One refinement, with its line in the report.
RefineResult refine_stage(const Stage& stage, const FitOptions& options,
                          const Eigen::VectorXd& start, const ProgressCallback& progress,
                          FitReport& report) {
  const FitProblem& problem = stage.problem;
  const RefineOptions refine_options = refine_options_of(stage.effort, problem, options);
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

/// The frames that a search looks at by default, at whatever steps are stable.
TrajectoryObjective usual_window(const FitProblem& problem) {
  return {problem, horizon_frames(problem, kSearchShare), std::numeric_limits<double>::infinity()};
}

double window_cost(const FitProblem& problem, const Eigen::VectorXd& values) {
  return search_cost(usual_window(problem), values);
}

/// Tells whether the model follows the cloth there (fit/cost/observed_motion.h).
bool follows(const FitProblem& problem, const Eigen::VectorXd& values) {
  return window_cost(problem, values) < cost_of_following(usual_window(problem));
}

/// Logarithmic parameters that a coarse mesh has driven to an end of their range go back to where a
/// fit begins: there the residuals hardly change with the logarithm, and a first step on the finer
/// mesh would leap across the range. Not where that costs more: a cloth may belong there.
Eigen::VectorXd away_from_ends(const FitProblem& problem, const Eigen::VectorXd& values) {
  const ParameterSpace& space = problem.space;
  const Eigen::VectorXd start = space.start();
  Eigen::VectorXd result = values;
  for (int p = 0; p < space.size(); ++p) {
    const FitParameter& parameter = space.parameters[static_cast<size_t>(p)];
    if (parameter.scale != ParameterScale::logarithmic) continue;
    const bool at_end =
        values[p] < kEnd * parameter.searched_from() || values[p] > parameter.upper / kEnd;
    if (at_end) result[p] = start[p];
  }
  if (result == values) return values;
  const bool keeps_to_priors = prior_cost(problem, result).cost <= prior_cost(problem, values).cost;
  const bool is_no_worse = window_cost(problem, result) <= window_cost(problem, values);
  return keeps_to_priors && is_no_worse ? result : values;
}

/// Tells whether residuals are no larger than the noise makes them. The sum of n squares is n, give
/// or take sqrt(2 n).
bool is_noise_alone(const FitProblem& problem, const RefineResult& result) {
  // The derivatives' rows do not tell: a fit that did not converge has none.
  const TrajectoryObjective whole(problem, problem.first_held_out,
                                  std::numeric_limits<double>::infinity());
  const auto residuals = static_cast<double>(whole.residual_count());
  return 2 * result.cost < 1 + kNoiseDeviations * std::sqrt(2 / residuals);
}

/// What a model leaves of the first frames. One that does not run has no residual and an infinite
/// misfit.
struct Misfit {
  Eigen::VectorXd residual;  ///< whitened
  double of_most_markers = std::numeric_limits<double>::infinity();
};

Misfit misfit_over(double share, const FitProblem& problem, const Eigen::VectorXd& values) {
  const TimeSteps stable = stable_time_steps(problem.cloth, parameter_set(problem, values))
                               .times(1 / RefineOptions().stability_margin);
  const TrajectoryObjective objective(problem, horizon_frames(problem, share), stable);
  Misfit misfit;
  misfit.residual = objective.residuals({values}).front();
  if (misfit.residual.size() > 0)
    misfit.of_most_markers = misfit_of_most_markers(objective, misfit.residual);
  return misfit;
}

/// Tells whether two meshes leave the same: what they differ by is less than what either leaves.
/// Else the misfit is that of a mesh, which fine measurements show, and says nothing of the model.
bool leave_the_same(const Misfit& one, const Misfit& other) {
  const Eigen::VectorXd &a = one.residual, &b = other.residual;
  return a.size() == b.size() && (a - b).squaredNorm() < std::min(a.squaredNorm(), b.squaredNorm());
}

/// Looks for a better optimum where this one leaves more than noise. The model may be wrong, or the
/// optimum a local one: over fewer frames the cost has fewer of them. Growing horizons lead the one
/// over a fifth to all frames. Returns the better of the two.
RefineResult second_look(const FitProblem& problem, const FitOptions& options,
                         const RefineResult& first, const ProgressCallback& progress,
                         FitReport& report) {
  if (!first.usable || is_noise_alone(problem, first)) return first;
  // A start in motion has hundreds of numbers, which few frames do not determine.
  if (starts_in_motion(problem)) return first;
  const auto look = [&](double share, const Effort& effort, const Eigen::VectorXd& start) {
    return refine_stage({.problem = problem, .share = share, .effort = effort}, options, start,
                        progress, report);
  };
  RefineResult second = first;
  int frames = 0;
  for (const double share : kSecondLookShares) {
    if (horizon_frames(problem, share) == frames) continue;
    frames = horizon_frames(problem, share);
    second = look(share, kSecondLookEffort, second.values);
    if (!second.usable) return first;
  }
  if (second.cost >= first.cost) return first;
  second = look(1, kFinalEffort, second.values);
  return second.usable && second.cost < first.cost ? second : first;
}

/// Fits over all frames on the coarse mesh from `values`, which move there. The fit's own mesh then
/// follows along its derivatives. The result is not usable where, in the end, the model is not as
/// far off on both meshes as this asks for, or each mesh is off in its own way. No second look is
/// taken: who asks for this looks for other basins with what the model lacks.
RefineResult follow_coarse(const FitProblem& coarse_problem, const FitProblem& problem,
                           const FitOptions& options, Eigen::VectorXd& values,
                           const ProgressCallback& progress, FitReport& report) {
  RefineResult found = refine_stage({.problem = coarse_problem, .effort = kRoughEffort}, options,
                                    values, progress, report);
  if (!found.usable) return found;
  values = found.values;
  const Misfit left = misfit_over(1, coarse_problem, values);
  found.usable = left.of_most_markers > options.coarse_beyond;
  if (!found.usable) return found;
  RefineResult led = refine_stage(
      {.problem = problem, .derivatives_of = &coarse_problem, .effort = kApproachEffort}, options,
      away_from_ends(problem, values), progress, report);
  if (!led.usable) return led;
  const Misfit left_there = misfit_over(1, problem, led.values);
  led.usable =
      left_there.of_most_markers > options.coarse_beyond && leave_the_same(left, left_there);
  return led;
}

/// Says how refinement comes to its start.
struct Approach {
  std::span<const double> coarse_shares;  ///< horizons on the coarse mesh
  double least_share = 0;                 ///< shorter ones are left out, on either mesh
  bool by_coarse_mesh = false;            ///< whether it started there
};

/// Refinement, stage after stage: on the coarse mesh over growing horizons, then on the fit's own
/// mesh, first with the coarse one's derivatives. Where the model follows the cloth already the
/// coarse mesh has nothing more to teach, and one short horizon is enough.
RefineResult refine_on(const FitProblem& coarse_problem, const FitProblem& problem,
                       const FitOptions& options, const Eigen::VectorXd& start,
                       const Approach& approach, const ProgressCallback& progress,
                       FitReport& report) {
  RefineResult best;
  best.values = start;
  const auto improve = [&](const Stage& stage) {
    best = refine_stage(stage, options, best.values, progress, report);
    return best.usable;
  };
  const bool follows_it = follows(problem, start) || follows(coarse_problem, start);
  if (!follows_it) {
    for (const double share : approach.coarse_shares)
      if (share >= approach.least_share &&
          !improve({.problem = coarse_problem, .share = share, .effort = kTrendEffort}))
        return best;
    if (std::isfinite(options.coarse_beyond) &&
        misfit_over(1, coarse_problem, best.values).of_most_markers > options.coarse_beyond) {
      RefineResult followed =
          follow_coarse(coarse_problem, problem, options, best.values, progress, report);
      if (followed.usable) return followed;
    }
    best.values = away_from_ends(problem, best.values);
    if (!improve({.problem = problem,
                  .derivatives_of = &coarse_problem,
                  .share = std::max(kSearchShare, approach.least_share),
                  .effort = kApproachEffort}))
      return best;
  }
  // What follows the cloth over few frames and not over all lacks something, and any mesh says so.
  if (follows_it && std::isfinite(options.coarse_beyond)) {
    Eigen::VectorXd values = start;
    RefineResult followed =
        follow_coarse(coarse_problem, problem, options, values, progress, report);
    if (followed.usable) return followed;
  }
  if (!follows_it || approach.by_coarse_mesh) best.values = away_from_ends(problem, best.values);
  for (const double share : kFineShares) {
    if (share < approach.least_share) continue;
    // Derivatives by the many corrections of a start cost least on the coarse mesh.
    const Stage rough = starts_in_motion(problem)
                            ? Stage{.problem = problem,
                                    .derivatives_of = &coarse_problem,
                                    .share = share,
                                    .effort = kApproachEffort}
                            : Stage{.problem = problem, .share = share, .effort = kRoughEffort};
    if (!improve(rough)) return best;
    if (follows_it) break;
  }
  improve({.problem = problem, .effort = kFinalEffort});
  // The basin that was followed from the start is known. A diagnosis looks for others itself.
  return follows_it && (!approach.by_coarse_mesh || std::isfinite(options.coarse_beyond))
             ? best
             : second_look(problem, options, best, progress, report);
}

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

/// Returns the start of a fit without a search: the values given, within their ranges.
Eigen::VectorXd given_start(const FitProblem& problem, const std::map<std::string, double>& given) {
  Eigen::VectorXd values = problem.space.start();
  for (const auto& [name, value] : given) {
    const int p = problem.space.index(name);
    if (p < 0)
      throw InputError("FitOptions::start", "the fit has no parameter '" + name + "'",
                       "a fit of the same parameter set and effects");
    const FitParameter& parameter = problem.space.parameters[static_cast<size_t>(p)];
    values[p] = std::clamp(value, parameter.lower, parameter.upper);
  }
  return values;
}

/// Tells whether a model is as far off over the first frames as a cloth that hardly moves.
bool is_far_off(double share, const FitProblem& problem, const Eigen::VectorXd& values) {
  const TrajectoryObjective objective(problem, horizon_frames(problem, share),
                                      std::numeric_limits<double>::infinity());
  const double cost = search_cost(objective, values);
  return !(cost <= kFarOffSigmas) && !(cost <= kFarOffShare * observed_motion(objective));
}

/// Takes a few steps over the search's window from the best that a search found. Returns their
/// result where the model is still far off; nothing where more steps may be worth their time.
std::optional<RefineResult> glance(const FitProblem& coarse_problem, const FitProblem& problem,
                                   const FitOptions& options, const Eigen::VectorXd& start,
                                   const ProgressCallback& progress, FitReport& report) {
  const double share = options.search_share;
  if (!is_far_off(share, coarse_problem, start)) return std::nullopt;
  RefineResult result = refine_stage({.problem = problem,
                                      .derivatives_of = &coarse_problem,
                                      .share = share,
                                      .effort = kGlanceEffort},
                                     options, start, progress, report);
  if (!result.usable || !is_far_off(share, problem, result.values)) return std::nullopt;
  result.converged = false;
  result.message = "no start leads the model to the first frames";
  return result;
}

/// From the ranges to the optimum. `candidates` are what the search found on the way.
RefineResult search_and_refine(const FitProblem& coarse_problem, const FitProblem& problem,
                               const FitOptions& options, const ProgressCallback& progress,
                               FitReport& report, std::vector<Candidate>& candidates) {
  Eigen::VectorXd start = problem.space.start();
  bool no_start_follows = false;
  if (starts_in_motion(problem)) {
    // A search needs to know where the cloth begins: from the middle of the ranges, over the first
    // frames, which say more of the start than of the fabric.
    const RefineResult first =
        refine_stage({.problem = coarse_problem, .share = 0, .effort = kCoarseEffort}, options,
                     start, progress, report);
    if (!first.usable) return first;
    for (int p = 0; p < problem.space.size(); ++p)
      if (problem.space.parameters[static_cast<size_t>(p)].role == ParameterRole::start)
        start[p] = first.values[p];
    no_start_follows = is_far_off(0, coarse_problem, first.values);
  }
  const int frames = horizon_frames(coarse_problem, options.search_share);
  const TrajectoryObjective objective(coarse_problem, frames,
                                      search_time_steps(coarse_problem, options, frames));
  const SearchedParameters found = search(objective, options, start, progress, report);
  if (found.optima.empty()) {
    RefineResult none;
    none.message = "no individual of the search could be simulated to the end of its window";
    return none;
  }
  if (no_start_follows && std::isfinite(options.coarse_beyond))
    if (std::optional<RefineResult> result =
            glance(coarse_problem, problem, options, found.optima.front().values, progress, report))
      return *std::move(result);
  const RefineResult best =
      pick_best(objective, options, found.optima, progress, report, candidates);
  return refine_on(coarse_problem, problem, options, best.values,
                   {.coarse_shares = kHorizonShares,
                    .least_share = options.search_share,
                    .by_coarse_mesh = true},
                   progress, report);
}

}  // namespace

double misfit_of_most_markers(const Objective& objective, const Eigen::VectorXd& residual) {
  constexpr double kLeftOut = 0.1;
  constexpr size_t kFewestToLeaveOne = 5;
  assert(residual.size() == objective.residual_count());
  struct OfMarker {
    double square = 0;
    int residuals = 0;
  };
  std::map<int, OfMarker> by_marker;
  for (const Objective::Block& block : objective.blocks()) {
    OfMarker& sum = by_marker[block.marker];
    sum.square += residual.segment(block.offset, block.dimension).squaredNorm();
    sum.residuals += block.dimension;
  }
  std::vector<OfMarker> sums;
  for (const auto& [marker, sum] : by_marker) sums.push_back(sum);
  std::ranges::sort(sums, {}, [](const OfMarker& sum) { return sum.square / sum.residuals; });
  auto left_out = static_cast<size_t>(kLeftOut * static_cast<double>(sums.size()));
  if (sums.size() >= kFewestToLeaveOne) left_out = std::max<size_t>(left_out, 1);
  const size_t kept = sums.size() - left_out;
  OfMarker most;
  for (size_t k = 0; k < kept; ++k) {
    most.square += sums[k].square;
    most.residuals += sums[k].residuals;
  }
  return most.square / std::max(1, most.residuals);
}

RefineOptions final_refinement(const FitProblem& problem, const FitOptions& options) {
  return refine_options_of(kFinalEffort, problem, options);
}

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
      if (lead.usable) start = std::move(lead.values);
    }
    from_start = refine_on(coarse_problem, problem, options, start, {.coarse_shares = kGivenShares},
                           progress, report);
    if (from_start.usable && from_start.converged) return from_start;
    report.stages.push_back(led ? "the " + to_string(options.cost) + " cost leads to no optimum"
                                : "the given start leads to no optimum");
  }
  RefineResult found =
      search_and_refine(coarse_problem, problem, options, progress, report, candidates);
  const bool better = !from_start.usable || (found.usable && found.cost < from_start.cost);
  return better ? found : from_start;
}

}  // namespace clothfit
