#include "fit/cost/objective.h"

#include <cassert>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "fit/problem/parameterised_model.h"
#include "fit/problem/predictor.h"
#include "model/cloth/stability.h"
#include "model/integrate/relax.h"
#include "model/integrate/simulate.h"
#include "model/integrate/tangents.h"

namespace clothfit {

void Objective::add_block(Block block) {
  block.offset = residual_count_;
  residual_count_ += block.dimension;
  blocks_.push_back(block);
}

bool Objective::is_stable(const Eigen::VectorXd& values) const {
  return !needs_stable_step() ||
         clothfit::is_stable(problem_, parameter_set(problem_, values), steps_);
}

Linearisation Objective::linearise(const Eigen::VectorXd& values, Derivatives derivatives,
                                   double step) const {
  if (derivatives == Derivatives::tangents) return linearise(values);
  Linearisation result;
  const int parameters = problem_.space.size();
  const bool central = derivatives == Derivatives::central;
  const Eigen::VectorXd coordinates = problem_.space.coordinates(values);
  std::vector<Eigen::VectorXd> points{values};
  const auto add_point = [&](int p, double offset) {
    Eigen::VectorXd moved = coordinates;
    moved[p] += offset;
    points.push_back(problem_.space.values(moved));
  };
  for (int p = 0; p < parameters; ++p) {
    add_point(p, step);
    if (central) add_point(p, -step);
  }
  // One run whose time step would not be stable spoils all; the others need not run then.
  for (const Eigen::VectorXd& point : points)
    if (!is_stable(point)) return result;
  std::vector<Eigen::VectorXd> residuals_of = residuals(points);
  result.runs = static_cast<int>(points.size());
  for (const Eigen::VectorXd& residual : residuals_of)
    if (residual.size() != residual_count_) return result;
  result.usable = true;
  result.residual = std::move(residuals_of.front());
  result.residual_by_coordinate.resize(residual_count_, parameters);
  for (int p = 0; p < parameters; ++p) {
    const auto plus = static_cast<size_t>(central ? 1 + 2 * p : 1 + p);
    const Eigen::VectorXd& from = central ? residuals_of[plus + 1] : result.residual;
    result.residual_by_coordinate.col(p) =
        (residuals_of[plus] - from) / (central ? 2 * step : step);
  }
  return result;
}

double Objective::mean_length(const Eigen::VectorXd& residual) const {
  if (residual.size() != residual_count_ || blocks_.empty())
    return std::numeric_limits<double>::infinity();
  double sum = 0;
  for (const Block& block : blocks_) sum += residual.segment(block.offset, block.dimension).norm();
  return sum / static_cast<double>(blocks_.size());
}

TrajectoryObjective::TrajectoryObjective(const FitProblem& problem, int frames,
                                         const TimeSteps& steps)
    : Objective(problem, steps), frames_(frames) {
  assert(frames >= 1 && frames <= problem.frames());
  for (size_t s = 0; s < problem.observations.size(); ++s) {
    const ObservationSet& set = problem.observations[s];
    for (size_t r = 0; r < set.rows.size(); ++r) {
      if (set.rows[r].frame >= frames) break;  // rows are sorted by frame
      add_block({.set = static_cast<int>(s),
                 .row = static_cast<int>(r),
                 .marker = set.rows[r].marker,
                 .frame = set.rows[r].frame,
                 .dimension = set.dimension});
    }
  }
  if (problem.marker_offset_sigma_m == 0) return;
  std::map<int, MarkerResiduals> by_marker;
  for (const Block& block : blocks()) {
    const ObservationSet& set = problem.observations[static_cast<size_t>(block.set)];
    MarkerResiduals& marker = by_marker[block.marker];
    marker.marker = block.marker;
    marker.rows.push_back(
        {.first = block.offset, .sigma_m = set.rows[static_cast<size_t>(block.row)].sigma});
  }
  for (auto& [index, marker] : by_marker) with_offset_.push_back(std::move(marker));
}

void TrajectoryObjective::take_offsets_out(Eigen::Ref<Eigen::MatrixXd> columns) const {
  if (!with_offset_.empty())
    profile_out_offsets(with_offset_, problem().marker_offset_sigma_m, columns);
}

std::string TrajectoryObjective::name() const {
  return "over " + std::to_string(frames_) + " frames";
}

double TrajectoryObjective::spring_steps_per_run() const {
  const Schedule schedule{.frame_time_s = problem().frame_time_s, .time_step_s = time_step_s()};
  double steps = 0;
  for (int frame = 1; frame < frames_; ++frame) steps += schedule.substeps(frame);
  return steps * static_cast<double>(problem().cloth.spring_count());
}

std::vector<Eigen::VectorXd> TrajectoryObjective::residuals(
    const std::vector<Eigen::VectorXd>& values) const {
  std::vector<Predictor> predictors;
  int frames = frames_;
  for (const Eigen::VectorXd& of : values) {
    predictors.emplace_back(problem(), of);
    frames = std::max(frames, predictors.back().frames_to_run(frames_));
  }
  const bool velocities = !predictors.empty() && predictors.front().needs_velocities();
  const std::vector<SimulateResult> runs =
      run_model(problem(), values, frames, steps(), velocities);
  std::vector<Eigen::VectorXd> results(values.size());
  for (size_t n = 0; n < values.size(); ++n) {
    if (!runs[n].usable()) continue;
    const MarkerRun markers = marker_run(problem(), runs[n]);
    Eigen::VectorXd residual(residual_count());
    bool visible = true;
    for (const Block& block : blocks()) {
      const ObservationSet& set = problem().observations[static_cast<size_t>(block.set)];
      const Observation& row = set.rows[static_cast<size_t>(block.row)];
      const auto predicted = predictors[n].predict(block.set, row, markers);
      if (!predicted) {
        visible = false;
        break;
      }
      residual.segment(block.offset, block.dimension) =
          (*predicted - row.observed).head(block.dimension) / row.sigma;
    }
    if (!visible || !residual.allFinite()) continue;
    take_offsets_out(residual);
    results[n] = std::move(residual);
  }
  return results;
}

Linearisation TrajectoryObjective::linearise(const Eigen::VectorXd& values) const {
  std::vector<int> all(static_cast<size_t>(problem().space.size()));
  std::iota(all.begin(), all.end(), 0);
  return linearise_by(values, all);
}

Linearisation TrajectoryObjective::linearise_by(const Eigen::VectorXd& values,
                                                std::span<const int> coordinates) const {
  Linearisation result;
  if (!is_stable(values)) return result;
  const FitProblem& of = problem();
  ParameterSet set = parameter_set(of, values);
  // The view of the cloth changes no run.
  std::vector<int> simulated;
  for (const int p : coordinates)
    if (of.space.parameters[static_cast<size_t>(p)].role != ParameterRole::measurement)
      simulated.push_back(p);
  std::vector<Direction> every = directions(of, values), along;
  for (const int p : simulated) along.push_back(std::move(every[static_cast<size_t>(p)]));
  if (of.start == StartKind::at_rest)
    start_at_rest_with_tangents(of.cloth, set, along, of.gravity_m_per_s2.norm(),
                                of.frame_time_s.front(), steps().rest_s, of.stop);
  const Predictor predictor(of, values);
  const Schedule schedule{
      .frame_time_s = {of.frame_time_s.begin(),
                       of.frame_time_s.begin() + predictor.frames_to_run(frames_)},
      .time_step_s = time_step_s(),
      .velocities = predictor.needs_velocities(),
      .derivatives_kept_s = of.derivatives_kept_s,
      .fast_derivatives = of.fast_derivatives};
  const TangentResult run = simulate_with_tangents(of.cloth, set, along, schedule, of.stop);
  result.runs = 1 + static_cast<int>(simulated.size());
  if (!run.run.usable()) return result;

  const MarkerRun markers = marker_run(of, run.run);
  const std::vector<Eigen::Matrix3Xd> none;
  std::vector<MarkerRun> tangents(static_cast<size_t>(of.space.size()));
  for (size_t n = 0; n < simulated.size(); ++n)
    tangents[static_cast<size_t>(simulated[n])] = marker_run(
        of, run.position_tangent[n], schedule.velocities ? run.velocity_tangent[n] : none);
  Eigen::Matrix3Xd change(3, of.space.size());
  const std::vector<int> chosen(coordinates.begin(), coordinates.end());
  result.residual.resize(residual_count());
  result.residual_by_coordinate.resize(residual_count(),
                                       static_cast<Eigen::Index>(coordinates.size()));
  for (const Block& block : blocks()) {
    const ObservationSet& observed = of.observations[static_cast<size_t>(block.set)];
    const Observation& row = observed.rows[static_cast<size_t>(block.row)];
    const auto predicted = predictor.predict(block.set, row, markers, tangents, change);
    if (!predicted) return result;
    result.residual.segment(block.offset, block.dimension) =
        (*predicted - row.observed).head(block.dimension) / row.sigma;
    result.residual_by_coordinate.middleRows(block.offset, block.dimension) =
        change(Eigen::seqN(0, block.dimension), chosen) / row.sigma;
  }
  take_offsets_out(result.residual);
  take_offsets_out(result.residual_by_coordinate);
  result.usable = result.residual.allFinite() && result.residual_by_coordinate.allFinite();
  return result;
}

CoarselyDifferentiated::CoarselyDifferentiated(const FitProblem& problem,
                                               const FitProblem& coarse_problem, int frames,
                                               const TimeSteps& steps,
                                               const TimeSteps& coarse_steps)
    : Objective(problem, steps),
      fine_(problem, frames, steps),
      coarse_(coarse_problem, frames, coarse_steps) {
  assert(problem.space.size() == coarse_problem.space.size());
  assert(fine_.residual_count() == coarse_.residual_count());
  for (const Block& block : fine_.blocks()) add_block(block);
}

std::vector<Eigen::VectorXd> CoarselyDifferentiated::residuals(
    const std::vector<Eigen::VectorXd>& values) const {
  return fine_.residuals(values);
}

Linearisation CoarselyDifferentiated::linearise(const Eigen::VectorXd& values) const {
  Linearisation result = coarse_.linearise(values);
  if (!result.usable) return result;
  result.residual = fine_.residuals({values}).front();
  const double share = coarse_.spring_steps_per_run() / fine_.spring_steps_per_run();
  result.runs = 1 + static_cast<int>(std::lround(share * result.runs));
  result.usable = result.residual.size() == residual_count();
  return result;
}

}  // namespace clothfit
