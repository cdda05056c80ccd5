#include "fit/cost/shooting.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

#include "data/algebra/dense_factors.h"
#include "data/parallel.h"
#include "fit/cost/huber.h"
#include "fit/observe/node_weights.h"
#include "fit/problem/parameterised_model.h"
#include "fit/problem/prior_cost.h"
#include "model/integrate/relax.h"
#include "model/integrate/tangents.h"

namespace clothfit {
namespace {

/// Returns the held points' weights: held points x vertices.
Eigen::MatrixXd held_weights(const Cloth& cloth) {
  Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(cloth.held.size()),
                                                  cloth.mesh.vertex_count());
  for (size_t h = 0; h < cloth.held.size(); ++h)
    for (const auto& [vertex, weight] : cloth.held[h].weights)
      weights(static_cast<Eigen::Index>(h), vertex) = weight;
  return weights;
}

/// Returns the vertices' moves as HeldPlacement makes them: vertices x held points.
Eigen::MatrixXd held_move(const Cloth& cloth, const Eigen::MatrixXd& weights) {
  const HeldPlacement<SingleLane> placement(cloth);
  Eigen::MatrixXd move = Eigen::MatrixXd::Zero(weights.cols(), weights.rows());
  for (size_t n = 0; n < placement.touched().size(); ++n)
    move.row(placement.touched()[n]) = placement.correction().row(static_cast<Eigen::Index>(n));
  return move;
}

}  // namespace

/// The model for one parameter vector, ready to start a window.
struct ShootingObjective::Model {
  ParameterSet set;
  std::vector<Direction> along;  ///< empty where no derivatives were asked for
  /// The cloth of all windows but the first. Fixed points are held where the recording begins, not
  /// where the window does.
  Cloth cloth_of_later;
  Eigen::Matrix3Xd fixed_place_m;                     ///< 3 x held points; unused for moving ones
  std::vector<Eigen::Matrix3Xd> fixed_place_along_m;  ///< [direction]
};

/// The result of a run over one window.
struct ShootingObjective::Window {
  Eigen::VectorXd residual;      ///< observations, then the gap to the next window
  Eigen::MatrixXd by_parameter;  ///< residuals x coordinates of the space
  Eigen::MatrixXd by_state;      ///< residuals x own corrections
  Eigen::Matrix3Xd start_position_m, start_velocity_m_per_s;
  Eigen::Matrix3Xd end_position_m, end_velocity_m_per_s;
};

ShootingObjective::ShootingObjective(const FitProblem& problem, int frames, const TimeSteps& steps,
                                     ShootingWindows windows, const Continuity& continuity)
    : Objective(problem, steps),
      frames_(frames),
      windows_(std::move(windows)),
      continuity_(continuity),
      held_weights_(held_weights(problem.cloth)),
      held_move_(held_move(problem.cloth, held_weights_)) {
  const Mesh& mesh = problem.cloth.mesh;
  const std::vector<int>& first = windows_.first_frame;
  assert(frames >= 1 && frames <= problem.frames());
  assert(!first.empty() && first.front() == 0 && first.back() < frames);
  assert(std::ranges::adjacent_find(first, std::greater_equal<>()) == first.end());
  assert(windows_.position_m.size() == static_cast<size_t>(windows_.count()));
  assert(windows_.velocity_m_per_s.size() == static_cast<size_t>(windows_.count()));
  assert(windows_.nodes >= 2 && windows_.nodes <= std::min(mesh.columns, mesh.rows));
  assert(continuity.position_m > 0 && continuity.velocity_m_per_s > 0);
  basis_ = node_weights(mesh, windows_.nodes, flat_positions(mesh).topRows<2>());
  to_nodes_ = SymmetricFactors(basis_.transpose() * basis_).solve(basis_.transpose());
  corrections_ = no_corrections();

  for (int w = 0; w < windows_.count(); ++w) {
    first_row_.push_back(residual_count());
    first_block_.push_back(static_cast<int>(blocks().size()));
    const int begin = first[static_cast<size_t>(w)];
    const int end = is_last(w) ? frames : first[static_cast<size_t>(w) + 1];
    for (size_t s = 0; s < problem.observations.size(); ++s) {
      const ObservationSet& set = problem.observations[s];
      for (size_t r = 0; r < set.rows.size(); ++r) {
        if (set.rows[r].frame < begin || set.rows[r].frame >= end) continue;
        add_block({.set = static_cast<int>(s),
                   .row = static_cast<int>(r),
                   .marker = set.rows[r].marker,
                   .frame = set.rows[r].frame,
                   .dimension = set.dimension});
      }
    }
    if (is_last(w)) break;
    for (int n = 0; n < state_size() / 3; ++n)
      add_block({.set = -1, .marker = n, .frame = end, .dimension = 3});
  }
  first_row_.push_back(residual_count());
  first_block_.push_back(static_cast<int>(blocks().size()));
}

ShootingObjective::Corrections ShootingObjective::no_corrections() const {
  Corrections none(static_cast<size_t>(windows_.count()), Eigen::VectorXd::Zero(state_size()));
  none.front().resize(0);
  return none;
}

void ShootingObjective::set_corrections(Corrections corrections) {
  assert(corrections.size() == corrections_.size());
  corrections_ = std::move(corrections);
}

std::string ShootingObjective::name() const {
  return "over " + std::to_string(frames_) + " frames in " + std::to_string(windows_.count()) +
         (windows_.count() == 1 ? " window" : " windows");
}

Schedule ShootingObjective::schedule_of(int window) const {
  const auto first = problem().frame_time_s.begin();
  const auto w = static_cast<size_t>(window);
  // The end of a window is the first frame of the next.
  const int end = is_last(window) ? frames_ : windows_.first_frame[w + 1] + 1;
  return {.frame_time_s = {first + windows_.first_frame[w], first + end},
          .time_step_s = time_step_s(),
          .velocities = true};
}

double ShootingObjective::spring_steps_per_run() const {
  double steps = 0;
  for (int w = 0; w < windows_.count(); ++w) {
    const Schedule schedule = schedule_of(w);
    for (size_t f = 1; f < schedule.frame_time_s.size(); ++f)
      steps += schedule.substeps(static_cast<int>(f));
  }
  return steps * static_cast<double>(problem().cloth.spring_count());
}

ShootingObjective::Model ShootingObjective::model_at(const Eigen::VectorXd& values,
                                                     bool derivatives) const {
  const FitProblem& of = problem();
  Model model{.set = parameter_set(of, values),
              .along = {},
              .cloth_of_later = of.cloth,
              .fixed_place_m = {},
              .fixed_place_along_m = {}};
  if (derivatives) model.along = directions(of, values);
  model.fixed_place_m = model.set.start_position_m * held_weights_.transpose();
  std::vector<HeldVertexWeights>& held = model.cloth_of_later.held;
  for (size_t h = 0; h < held.size(); ++h) {
    if (held[h].motion) continue;
    const Eigen::Vector3d place = model.fixed_place_m.col(static_cast<Eigen::Index>(h));
    held[h].motion = [place](double) { return place; };
    held[h].rests = true;
    if (!model.set.held_shift.empty()) model.set.held_shift[h] = nullptr;
  }
  for (const Direction& direction : model.along) {
    Eigen::Matrix3Xd change = Eigen::Matrix3Xd::Zero(3, model.fixed_place_m.cols());
    if (direction.start_position_m.cols() > 0)
      change = direction.start_position_m * held_weights_.transpose();
    for (size_t h = 0; h < held.size(); ++h)
      if (of.cloth.held[h].motion) change.col(static_cast<Eigen::Index>(h)).setZero();
    model.fixed_place_along_m.push_back(std::move(change));
  }
  return model;
}

std::vector<Direction> ShootingObjective::begin(int window, const Eigen::VectorXd& correction,
                                                Model& model) const {
  const FitProblem& of = problem();
  if (window == 0) {
    if (of.start == StartKind::at_rest) {
      if (model.along.empty())
        start_at_rest(of.cloth, {&model.set, 1}, of.gravity_m_per_s2.norm(),
                      of.frame_time_s.front(), steps().rest_s, of.stop);
      else
        start_at_rest_with_tangents(of.cloth, model.set, model.along, of.gravity_m_per_s2.norm(),
                                    of.frame_time_s.front(), steps().rest_s, of.stop);
    }
    return {};
  }
  const auto w = static_cast<size_t>(window);
  const double time_s = of.frame_time_s[static_cast<size_t>(windows_.first_frame[w])];
  const Eigen::Index numbers = 3 * basis_.cols();
  // Held points are at their places, with the velocity that the scheme gives them there.
  const Eigen::Index held = held_weights_.rows();
  Eigen::Matrix3Xd place_m(3, held), velocity_m_per_s(3, held);
  for (Eigen::Index h = 0; h < held; ++h) {
    const auto& motion = model.cloth_of_later.held[static_cast<size_t>(h)].motion;
    const auto place_at = [&](double at_s) {
      return shifted(motion(at_s), model.set, static_cast<size_t>(h), at_s);
    };
    place_m.col(h) = place_at(time_s);
    velocity_m_per_s.col(h) = (place_m.col(h) - place_at(time_s - time_step_s())) / time_step_s();
  }
  const auto with_held = [&](const Eigen::Matrix3Xd& field, const Eigen::Matrix3Xd& at_held) {
    return Eigen::Matrix3Xd(field +
                            (at_held - field * held_weights_.transpose()) * held_move_.transpose());
  };
  const Eigen::Map<const Eigen::Matrix3Xd> p(correction.data(), 3, basis_.cols());
  const Eigen::Map<const Eigen::Matrix3Xd> v(correction.data() + numbers, 3, basis_.cols());
  model.set.start_position_m = with_held(windows_.position_m[w] + p * basis_.transpose(), place_m);
  model.set.start_velocity_m_per_s =
      with_held(windows_.velocity_m_per_s[w] + v * basis_.transpose(), velocity_m_per_s);
  model.set.start_effect_memory.clear();
  if (model.along.empty()) return {};

  Direction still;
  for (const std::vector<double>& effect : model.set.effects)
    still.effects.emplace_back(effect.size(), 0.0);
  for (size_t d = 0; d < model.along.size(); ++d) {
    Direction& direction = model.along[d];
    Eigen::Matrix3Xd change = model.fixed_place_along_m[d];
    const auto driven = std::exchange(direction.held_motion, {});
    direction.start_velocity_m_per_s.resize(3, 0);
    for (Eigen::Index h = 0; h < held; ++h) {
      const auto n = static_cast<size_t>(h);
      if (!driven.empty() && driven[n] && of.cloth.held[n].motion) {
        change.col(h) = driven[n](time_s);
        const Eigen::Vector3d rate =
            (change.col(h) - driven[n](time_s - time_step_s())) / time_step_s();
        if (direction.start_velocity_m_per_s.cols() == 0)
          direction.start_velocity_m_per_s.setZero(3, held_move_.rows());
        direction.start_velocity_m_per_s += rate * held_move_.col(h).transpose();
        direction.held_motion.push_back(driven[n]);
        continue;
      }
      const Eigen::Vector3d moved = change.col(h);
      direction.held_motion.push_back([moved](double) { return moved; });
    }
    direction.start_position_m = change * held_move_.transpose();
    direction.start_effect_memory.clear();
  }
  std::vector<Direction> own(static_cast<size_t>(state_size()), still);
  const Eigen::Matrix3Xd at_held = Eigen::Matrix3Xd::Zero(3, held);
  for (Eigen::Index n = 0; n < numbers; ++n) {
    const Eigen::Matrix3Xd field =
        with_held(Eigen::Vector3d::Unit(n % 3) * basis_.col(n / 3).transpose(), at_held);
    own[static_cast<size_t>(n)].start_position_m = field;
    own[static_cast<size_t>(n + numbers)].start_velocity_m_per_s = field;
  }
  return own;
}

Eigen::VectorXd ShootingObjective::seen_by_nodes(const Eigen::Matrix3Xd& position_m,
                                                 const Eigen::Matrix3Xd& velocity_m_per_s) const {
  Eigen::VectorXd seen(state_size());
  const Eigen::Matrix3Xd position = position_m * to_nodes_.transpose();
  const Eigen::Matrix3Xd velocity = velocity_m_per_s * to_nodes_.transpose();
  seen << position.reshaped(), velocity.reshaped();
  return seen;
}

Eigen::VectorXd ShootingObjective::continuity_weights() const {
  Eigen::VectorXd weights(state_size());
  weights.head(state_size() / 2).setConstant(1 / continuity_.position_m);
  weights.tail(state_size() / 2).setConstant(1 / continuity_.velocity_m_per_s);
  return weights;
}

std::optional<ShootingObjective::Window> ShootingObjective::run(
    int window, Model model, const Corrections& corrections) const {
  const auto w = static_cast<size_t>(window);
  begin(window, corrections[w], model);
  const Cloth& cloth = window == 0 ? problem().cloth : model.cloth_of_later;
  const SimulateResult run =
      simulate(cloth, {&model.set, 1}, schedule_of(window), Precision::exact, {}, problem().stop)
          .front();
  if (!run.usable()) return std::nullopt;
  Window result{.residual = Eigen::VectorXd(rows(window)),
                .by_parameter = {},
                .by_state = {},
                .start_position_m = run.position_m.front(),
                .start_velocity_m_per_s = run.velocity_m_per_s.front(),
                .end_position_m = run.position_m.back(),
                .end_velocity_m_per_s = run.velocity_m_per_s.back()};
  const auto markers = marker_positions(problem().vertex_weights, run.position_m);
  for (int b = first_block_[w]; b < first_block_[w + 1]; ++b) {
    const Block& block = blocks()[static_cast<size_t>(b)];
    if (block.set < 0) break;
    const ObservationSet& set = problem().observations[static_cast<size_t>(block.set)];
    const Observation& row = set.rows[static_cast<size_t>(block.row)];
    const auto frame = static_cast<size_t>(row.frame - windows_.first_frame[w]);
    const auto predicted = set.predict(markers[frame].col(row.marker));
    if (!predicted) return std::nullopt;
    result.residual.segment(block.offset - first_row_[w], block.dimension) =
        (*predicted - row.observed).head(block.dimension) / row.sigma;
  }
  if (!is_last(window))
    result.residual.tail(state_size()) = continuity_weights().cwiseProduct(
        seen_by_nodes(result.end_position_m - windows_.position_m[w + 1],
                      result.end_velocity_m_per_s - windows_.velocity_m_per_s[w + 1]) -
        corrections[w + 1]);
  if (!result.residual.allFinite()) return std::nullopt;
  return result;
}

std::optional<ShootingObjective::Window> ShootingObjective::run_with_tangents(
    int window, Model model, bool by_states) const {
  const auto w = static_cast<size_t>(window);
  std::vector<Direction> own = begin(window, corrections_[w], model);
  if (!by_states) own.clear();
  std::vector<Direction> along = std::move(model.along);
  const auto parameters = static_cast<Eigen::Index>(along.size());
  along.insert(along.end(), own.begin(), own.end());
  const Cloth& cloth = window == 0 ? problem().cloth : model.cloth_of_later;
  const TangentResult run =
      simulate_with_tangents(cloth, model.set, along, schedule_of(window), problem().stop);
  if (!run.run.usable()) return std::nullopt;
  Window result{.residual = Eigen::VectorXd(rows(window)),
                .by_parameter = {},
                .by_state = {},
                .start_position_m = run.run.position_m.front(),
                .start_velocity_m_per_s = run.run.velocity_m_per_s.front(),
                .end_position_m = run.run.position_m.back(),
                .end_velocity_m_per_s = run.run.velocity_m_per_s.back()};
  Eigen::MatrixXd jacobian(rows(window), static_cast<Eigen::Index>(along.size()));
  const auto markers = marker_positions(problem().vertex_weights, run.run.position_m);
  std::vector<std::vector<Eigen::Matrix3Xd>> marker_tangents;
  for (const std::vector<Eigen::Matrix3Xd>& tangent : run.position_tangent)
    marker_tangents.push_back(marker_positions(problem().vertex_weights, tangent));
  for (int b = first_block_[w]; b < first_block_[w + 1]; ++b) {
    const Block& block = blocks()[static_cast<size_t>(b)];
    if (block.set < 0) break;
    const ObservationSet& set = problem().observations[static_cast<size_t>(block.set)];
    const Observation& row = set.rows[static_cast<size_t>(block.row)];
    const auto frame = static_cast<size_t>(row.frame - windows_.first_frame[w]);
    Eigen::Matrix3d by_position;
    const auto predicted = set.predict(markers[frame].col(row.marker), &by_position);
    if (!predicted) return std::nullopt;
    const int at = block.offset - first_row_[w];
    result.residual.segment(at, block.dimension) =
        (*predicted - row.observed).head(block.dimension) / row.sigma;
    for (size_t d = 0; d < along.size(); ++d) {
      const Eigen::Vector3d change = by_position * marker_tangents[d][frame].col(row.marker);
      jacobian.col(static_cast<Eigen::Index>(d)).segment(at, block.dimension) =
          change.head(block.dimension) / row.sigma;
    }
  }
  if (!is_last(window)) {
    const Eigen::VectorXd weights = continuity_weights();
    result.residual.tail(state_size()) = weights.cwiseProduct(
        seen_by_nodes(result.end_position_m - windows_.position_m[w + 1],
                      result.end_velocity_m_per_s - windows_.velocity_m_per_s[w + 1]) -
        corrections_[w + 1]);
    for (size_t d = 0; d < along.size(); ++d)
      jacobian.col(static_cast<Eigen::Index>(d)).tail(state_size()) = weights.cwiseProduct(
          seen_by_nodes(run.position_tangent[d].back(), run.velocity_tangent[d].back()));
  }
  if (!result.residual.allFinite() || !jacobian.allFinite()) return std::nullopt;
  result.by_parameter = jacobian.leftCols(parameters);
  result.by_state = jacobian.rightCols(jacobian.cols() - parameters);
  return result;
}

std::vector<std::optional<ShootingObjective::Window>> ShootingObjective::run_all(
    const Eigen::VectorXd& values, const Corrections& corrections) const {
  std::vector<std::optional<Window>> windows(static_cast<size_t>(windows_.count()));
  if (!is_stable(values)) return windows;
  const Model model = model_at(values, false);
  for_each_index(windows.size(),
                 [&](size_t w) { windows[w] = run(static_cast<int>(w), model, corrections); });
  return windows;
}

std::vector<std::optional<ShootingObjective::Window>> ShootingObjective::linearise_all(
    const Eigen::VectorXd& values, bool by_states) const {
  std::vector<std::optional<Window>> windows(static_cast<size_t>(windows_.count()));
  if (!is_stable(values)) return windows;
  const Model model = model_at(values, true);
  for_each_index(windows.size(), [&](size_t w) {
    windows[w] = run_with_tangents(static_cast<int>(w), model, by_states);
  });
  return windows;
}

Eigen::VectorXd ShootingObjective::residual(const Eigen::VectorXd& values,
                                            const Corrections& corrections) const {
  Eigen::VectorXd all(residual_count());
  const std::vector<std::optional<Window>> windows = run_all(values, corrections);
  for (size_t w = 0; w < windows.size(); ++w) {
    if (!windows[w]) return {};
    all.segment(first_row_[w], windows[w]->residual.size()) = windows[w]->residual;
  }
  return all;
}

std::vector<Eigen::VectorXd> ShootingObjective::residuals(
    const std::vector<Eigen::VectorXd>& values) const {
  std::vector<Eigen::VectorXd> results;
  for (const Eigen::VectorXd& point : values) results.push_back(residual(point, corrections_));
  return results;
}

Linearisation ShootingObjective::linearise(const Eigen::VectorXd& values) const {
  Linearisation result;
  const std::vector<std::optional<Window>> windows = linearise_all(values, false);
  result.runs = 1 + problem().space.size();
  result.residual.resize(residual_count());
  result.residual_by_coordinate.resize(residual_count(), problem().space.size());
  for (size_t w = 0; w < windows.size(); ++w) {
    if (!windows[w]) return result;
    result.residual.segment(first_row_[w], windows[w]->residual.size()) = windows[w]->residual;
    result.residual_by_coordinate.middleRows(first_row_[w], windows[w]->residual.size()) =
        windows[w]->by_parameter;
  }
  result.usable = true;
  return result;
}

double ShootingObjective::cost(const Eigen::VectorXd& residual, double huber_threshold) const {
  if (residual.size() != residual_count()) return std::numeric_limits<double>::infinity();
  double sum = 0;
  for (const Block& block : blocks()) {
    const double length = residual.segment(block.offset, block.dimension).norm();
    sum += 0.5 * (block.set < 0 ? length * length : huber_square(length, huber_threshold));
  }
  return sum;
}

ShootingObjective::Equations ShootingObjective::equations(const Eigen::VectorXd& values,
                                                          double huber_threshold) const {
  Equations result;
  std::vector<std::optional<Window>> windows = linearise_all(values, true);
  result.runs = 1 + problem().space.size() + state_size();
  if (std::ranges::any_of(windows, [](const auto& window) { return !window; })) return result;
  const PriorCost prior = prior_cost(problem(), values);
  result.residual.resize(residual_count());
  BorderedChain& chain = result.chain;
  chain.border = prior.information;
  chain.border_right = -prior.gradient;
  const Eigen::VectorXd weights = continuity_weights();
  for (size_t w = 0; w < windows.size(); ++w) {
    Window& window = *windows[w];
    result.residual.segment(first_row_[w], window.residual.size()) = window.residual;
    // Huber's loss weighs an observation down as its slope does.
    for (int b = first_block_[w]; b < first_block_[w + 1]; ++b) {
      const Block& block = blocks()[static_cast<size_t>(b)];
      if (block.set < 0) break;
      const int at = block.offset - first_row_[w];
      const double length = window.residual.segment(at, block.dimension).norm();
      if (length <= huber_threshold) continue;
      const double root = std::sqrt(huber_threshold / length);
      window.residual.segment(at, block.dimension) *= root;
      window.by_parameter.middleRows(at, block.dimension) *= root;
      window.by_state.middleRows(at, block.dimension) *= root;
    }
    const Eigen::MatrixXd &by_parameter = window.by_parameter, &by_state = window.by_state;
    chain.border.noalias() += by_parameter.transpose() * by_parameter;
    chain.border_right.noalias() -= by_parameter.transpose() * window.residual;
    chain.diagonal.push_back(by_state.transpose() * by_state);
    chain.to_border.push_back(by_state.transpose() * by_parameter);
    chain.right.push_back(-by_state.transpose() * window.residual);
    if (w > 0) {  // the gap of the window before depends on this one's state too
      const Window& before = *windows[w - 1];
      const Eigen::Index size = state_size();
      chain.diagonal[w].diagonal() += weights.cwiseAbs2();
      chain.to_border[w] -= weights.asDiagonal() * before.by_parameter.bottomRows(size);
      chain.right[w] += weights.cwiseProduct(before.residual.tail(size));
      chain.next.push_back(-before.by_state.bottomRows(size).transpose() * weights.asDiagonal());
    }
  }
  result.cost = cost(result.residual, huber_threshold) + prior.cost;
  result.usable = true;
  return result;
}

std::optional<ShootingWindows> ShootingObjective::recentred(const Eigen::VectorXd& values) const {
  const std::vector<std::optional<Window>> windows = run_all(values, corrections_);
  if (std::ranges::any_of(windows, [](const auto& window) { return !window; })) return std::nullopt;
  const auto finer = [&](const Eigen::Matrix3Xd& field) {
    return Eigen::Matrix3Xd(field - field * to_nodes_.transpose() * basis_.transpose());
  };
  ShootingWindows result = windows_;
  for (size_t w = 1; w < windows.size(); ++w) {
    const Window &here = *windows[w], &before = *windows[w - 1];
    result.position_m[w] =
        here.start_position_m + finer(before.end_position_m - here.start_position_m);
    result.velocity_m_per_s[w] = here.start_velocity_m_per_s +
                                 finer(before.end_velocity_m_per_s - here.start_velocity_m_per_s);
  }
  return result;
}

}  // namespace clothfit
