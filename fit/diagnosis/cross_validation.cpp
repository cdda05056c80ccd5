#include "fit/diagnosis/cross_validation.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <numeric>
#include <utility>

#include "data/algebra/dense_factors.h"
#include "data/parallel.h"
#include "fit/cost/huber.h"
#include "fit/diagnosis/free_forces.h"
#include "fit/problem/box.h"
#include "fit/problem/prior_cost.h"
#include "fit/uncertainty/uncertainty.h"

namespace clothfit {
namespace {

/// Stretches of free forces in each block of time that is left out.
constexpr int kStretchesInBlock = 2;

/// One recording's normal equations, in all and of each block of time. The unknowns are its
/// parameters, then the amplitudes of its directions, then free forces. What is known of the forces
/// beforehand is not in them.
struct Normal {
  Eigen::MatrixXd information;
  Eigen::VectorXd gradient;
  std::vector<Eigen::MatrixXd> block_information;
  std::vector<Eigen::VectorXd> block_gradient;
};

class Folds {
 public:
  Folds(const DiagnosisSetup& setup, const FittedModel& model, int blocks, double threshold,
        bool whole, FreeForces forces)
      : model_(model),
        problems_(model.problem_pointers()),
        space_(problems_),
        whole_(whole),
        blocks_(whole ? static_cast<int>(model.parts.size()) : blocks),
        threshold_(setup.options.loss == Loss::huber ? threshold
                                                     : std::numeric_limits<double>::infinity()),
        forces_(std::move(forces)) {
    for (size_t n = 0; n < model.parts.size(); ++n) {
      objectives_.push_back(model.objective(n));
      normals_.push_back(normal_of(n));
    }
  }

  int blocks() const { return blocks_; }
  /// Returns the first block that is left out. The first frames show a start in motion. Without
  /// them it would have to be told from what became of it, through hundreds of numbers.
  int first_left_out() const {
    const bool starts_unknown = std::ranges::any_of(
        problems_, [](const FitProblem* problem) { return problem->start == StartKind::unknown; });
    return starts_unknown && !whole_ && blocks_ > 1 ? 1 : 0;
  }
  int block_of(size_t recording, const Objective::Block& row) const {
    return whole_ ? static_cast<int>(recording)
                  : row.frame * blocks_ / model_.parts[recording].frames;
  }
  const TrajectoryObjective& objective(size_t recording) const { return objectives_[recording]; }
  bool has_forces() const { return forces_.usable(); }

  /// Returns residuals of all recordings where block `b` took no part. Where the whole step leaves
  /// more of what was seen, as far from an optimum, half of it is taken, and so on.
  std::vector<Eigen::VectorXd> residuals_without(int b) const {
    constexpr int kHalvings = 4;
    const std::vector<Eigen::VectorXd> ways = ways_without(b, 0);
    const double stays = seen_cost(b, residuals_after(ways, 0), ways, 0);
    double share = 1;
    for (int k = 0; k < kHalvings; ++k, share /= 2) {
      std::vector<Eigen::VectorXd> moved = residuals_after(ways, share);
      if (seen_cost(b, moved, ways, share) <= stays) return moved;
    }
    return residuals_after(ways, 0);
  }

  /// Returns the same to first order and with free forces, which are known to be about
  /// `sigma_m_per_s2`.
  std::vector<Eigen::VectorXd> residuals_with_forces_without(int b, double sigma_m_per_s2) const {
    const std::vector<Eigen::VectorXd> ways = ways_without(b, sigma_m_per_s2);
    std::vector<Eigen::VectorXd> result(model_.parts.size());
    for (size_t n = 0; n < model_.parts.size(); ++n) {
      const PooledPart& part = model_.parts[n];
      const Eigen::Index fitted = part.values.size(), amplitudes = part.directions.cols();
      result[n] = residual_of(part);
      result[n] += part.linear.residual_by_coordinate * ways[n].head(fitted);
      if (amplitudes > 0) result[n] += part.directions * ways[n].segment(fitted, amplitudes);
      result[n] += forces_.columns[n] * ways[n].tail(forces_.columns[n].cols());
    }
    return result;
  }

 private:
  /// Returns residuals of all recordings where a share of the way is gone.
  std::vector<Eigen::VectorXd> residuals_after(const std::vector<Eigen::VectorXd>& ways,
                                               double share) const {
    std::vector<Eigen::VectorXd> result(model_.parts.size());
    for (size_t n = 0; n < model_.parts.size(); ++n) {
      const PooledPart& part = model_.parts[n];
      result[n] = part.linear.residual;
      if (share > 0) {
        Eigen::VectorXd moved =
            objectives_[n].residuals({values_after(n, share * ways[n])}).front();
        // Where the step leads out of what is stable, the model stays.
        if (moved.size() == objectives_[n].residual_count()) result[n] = std::move(moved);
      }
      if (part.correction.size() > 0) result[n] += part.correction;
      if (part.amplitudes.size() > 0)
        result[n] += part.directions * amplitudes_after(n, share * ways[n]);
    }
    return result;
  }

  /// Returns twice the cost of a share of the way: of observations out of block `b`, and priors.
  double seen_cost(int b, const std::vector<Eigen::VectorXd>& residuals,
                   const std::vector<Eigen::VectorXd>& ways, double share) const {
    double sum = 0;
    for (size_t n = 0; n < residuals.size(); ++n) {
      for (const Objective::Block& row : objectives_[n].blocks())
        if (block_of(n, row) != b)
          sum += huber_square(residuals[n].segment(row.offset, row.dimension).norm(), threshold_);
      sum += 2 * prior_cost(*problems_[n], values_after(n, share * ways[n])).cost;
      if (model_.parts[n].amplitudes.size() > 0)
        sum += amplitudes_after(n, share * ways[n]).squaredNorm();
    }
    return sum;
  }

  Normal normal_of(size_t n) const {
    const PooledPart& part = model_.parts[n];
    const Eigen::VectorXd residual = residual_of(part);
    const Eigen::VectorXd root_weight =
        huber_weights(objectives_[n], residual, threshold_).cwiseSqrt();
    const Eigen::Index fitted = part.linear.residual_by_coordinate.cols(),
                       unforced = first_force(n, 0),
                       all = unforced + (has_forces() ? forces_.columns[n].cols() : 0);
    const PriorCost prior = prior_cost(*problems_[n], part.values);
    Normal normal{.information = Eigen::MatrixXd::Zero(all, all),
                  .gradient = Eigen::VectorXd::Zero(all),
                  .block_information = {},
                  .block_gradient = {}};
    normal.information.topLeftCorner(unforced, unforced).setIdentity();
    normal.information.topLeftCorner(fitted, fitted) = prior.information;
    normal.gradient.head(fitted) = prior.gradient;
    if (unforced > fitted) normal.gradient.segment(fitted, unforced - fitted) = part.amplitudes;
    const int stretches = whole_ ? 1 : blocks_;
    normal.block_information.assign(static_cast<size_t>(stretches),
                                    Eigen::MatrixXd::Zero(all, all));
    normal.block_gradient.assign(static_cast<size_t>(stretches), Eigen::VectorXd::Zero(all));
    std::vector<std::vector<int>> rows(static_cast<size_t>(stretches));
    for (const Objective::Block& block : objectives_[n].blocks())
      for (int c = 0; c < block.dimension; ++c)
        rows[whole_ ? 0 : static_cast<size_t>(block_of(n, block))].push_back(block.offset + c);
    for (size_t b = 0; b < rows.size(); ++b) {
      if (rows[b].empty()) continue;
      Eigen::MatrixXd jacobian(static_cast<Eigen::Index>(rows[b].size()), all);
      jacobian.leftCols(fitted) = part.linear.residual_by_coordinate(rows[b], Eigen::all);
      if (unforced > fitted)
        jacobian.middleCols(fitted, unforced - fitted) = part.directions(rows[b], Eigen::all);
      if (all > unforced)
        jacobian.rightCols(all - unforced) = forces_.columns[n](rows[b], Eigen::all);
      // Forces of later stretches do nothing yet.
      Eigen::Index acting = all;
      while (acting > unforced && jacobian.col(acting - 1).isZero(0)) --acting;
      jacobian = root_weight(rows[b]).asDiagonal() * jacobian.leftCols(acting).eval();
      const Eigen::VectorXd left = root_weight(rows[b]).cwiseProduct(residual(rows[b]));
      auto information = normal.block_information[b].topLeftCorner(acting, acting);
      information.selfadjointView<Eigen::Lower>().rankUpdate(jacobian.transpose());
      information.triangularView<Eigen::StrictlyUpper>() = information.transpose();
      normal.block_gradient[b].head(acting).noalias() = jacobian.transpose() * left;
      normal.information += normal.block_information[b];
      normal.gradient += normal.block_gradient[b];
    }
    return normal;
  }

  /// Returns the stretch whose forces are held in block `b`: the last one before it, or the first
  /// after it.
  static int held_in(int b) { return b > 0 ? kStretchesInBlock * b - 1 : kStretchesInBlock; }

  /// Returns where the normal equations have a stretch's forces.
  Eigen::Index first_force(size_t n, int stretch) const {
    const PooledPart& part = model_.parts[n];
    return part.values.size() + part.directions.cols() +
           static_cast<Eigen::Index>(FreeForces::kInStretch) * stretch;
  }

  /// Returns how far each recording's unknowns move, by the arrow of all recordings' equations. Own
  /// unknowns are eliminated first, then the shared ones are found. A whole recording that is left
  /// out says nothing of the shared ones, and its own ones follow them. `sigma_m_per_s2` is the
  /// size of free forces; at 0 there are none.
  std::vector<Eigen::VectorXd> ways_without(int b, double sigma_m_per_s2) const {
    const auto shared = static_cast<Eigen::Index>(space_.shared());
    Eigen::MatrixXd reduced = Eigen::MatrixXd::Zero(shared, shared);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(shared);
    struct Own {
      SymmetricFactors solver;
      Eigen::MatrixXd between;
      Eigen::VectorXd gradient;
      std::vector<int> places;
    };
    std::vector<Own> owns;
    for (size_t n = 0; n < normals_.size(); ++n) {
      const Eigen::Index unforced = first_force(n, 0),
                         used = sigma_m_per_s2 > 0 ? normals_[n].gradient.size() : unforced;
      Eigen::MatrixXd information = normals_[n].information.topLeftCorner(used, used);
      Eigen::VectorXd gradient = normals_[n].gradient.head(used);
      const bool left_out = whole_ && static_cast<size_t>(b) == n;
      if (!whole_) {
        const auto block = static_cast<size_t>(b);
        information -= normals_[n].block_information[block].topLeftCorner(used, used);
        gradient -= normals_[n].block_gradient[block].head(used);
      }
      const std::vector<int> common = space_.shared_of(n);
      std::vector<int> places = space_.own_of(n);
      for (auto k = static_cast<int>(model_.parts[n].values.size()); k < unforced; ++k)
        places.push_back(k);
      if (sigma_m_per_s2 > 0) add_forces(n, b, sigma_m_per_s2, information, gradient, places);
      information.diagonal().array() += 1e-9 * std::max(1.0, information.diagonal().maxCoeff());
      Own own{.solver = SymmetricFactors(information(places, places)),
              .between = information(places, common),
              .gradient = gradient(places),
              .places = places};
      if (!left_out) {
        reduced += information(common, common);
        right -= gradient(common);
        if (!places.empty()) {
          reduced -= own.between.transpose() * own.solver.solve(own.between);
          right += own.between.transpose() * own.solver.solve(own.gradient);
        }
      }
      owns.push_back(std::move(own));
    }
    reduced.diagonal().array() += 1e-12 * std::max(1.0, reduced.diagonal().maxCoeff());
    const Eigen::VectorXd step = SymmetricFactors(reduced).solve(right);
    std::vector<Eigen::VectorXd> ways(normals_.size());
    for (size_t n = 0; n < normals_.size(); ++n) {
      ways[n] = Eigen::VectorXd::Zero(sigma_m_per_s2 > 0 ? normals_[n].gradient.size()
                                                         : first_force(n, 0));
      ways[n](space_.shared_of(n)) = step;
      if (!owns[n].places.empty()) {
        const Eigen::VectorXd pull = -owns[n].gradient - owns[n].between * step;
        ways[n](owns[n].places) = Eigen::VectorXd(owns[n].solver.solve(pull));
      }
      if (sigma_m_per_s2 > 0)
        for (int k = 0; k < kStretchesInBlock; ++k)
          ways[n].segment<FreeForces::kInStretch>(first_force(n, kStretchesInBlock * b + k)) =
              ways[n].segment<FreeForces::kInStretch>(first_force(n, held_in(b)));
    }
    return ways;
  }

  /// Adds a recording's forces to its own unknowns. In the block that is left out they are those of
  /// another stretch, so equations for the former count for the latter.
  void add_forces(size_t n, int b, double sigma_m_per_s2, Eigen::MatrixXd& information,
                  Eigen::VectorXd& gradient, std::vector<int>& places) const {
    constexpr Eigen::Index kEach = FreeForces::kInStretch;
    const Eigen::Index held = first_force(n, held_in(b));
    for (int stretch = 0; stretch < forces_.stretches; ++stretch) {
      const Eigen::Index first = first_force(n, stretch);
      if (stretch / kStretchesInBlock == b) {
        information.middleRows(held, kEach) += information.middleRows(first, kEach).eval();
        information.middleCols(held, kEach) += information.middleCols(first, kEach).eval();
        gradient.segment(held, kEach) += gradient.segment(first, kEach).eval();
      } else {
        for (Eigen::Index k = 0; k < kEach; ++k) places.push_back(static_cast<int>(first + k));
      }
    }
    information.diagonal().tail(kEach * forces_.stretches).array() +=
        1 / (sigma_m_per_s2 * sigma_m_per_s2);
  }

  /// Returns the amplitudes of a recording's directions moved by `way`.
  Eigen::VectorXd amplitudes_after(size_t n, const Eigen::VectorXd& way) const {
    const PooledPart& part = model_.parts[n];
    return part.amplitudes + way.segment(part.values.size(), part.amplitudes.size());
  }

  /// Returns a recording's parameters moved by `way`, within their ranges.
  Eigen::VectorXd values_after(size_t n, const Eigen::VectorXd& way) const {
    const ParameterSpace& space = problems_[n]->space;
    const Eigen::VectorXd next = space.coordinates(model_.parts[n].values) + way.head(space.size());
    return space.values(box_of(space).clamped(next));
  }

  const FittedModel& model_;
  std::vector<const FitProblem*> problems_;
  PooledSpace space_;
  bool whole_;
  int blocks_;
  double threshold_;  ///< of the fit's loss
  FreeForces forces_;
  std::vector<TrajectoryObjective> objectives_;
  std::vector<Normal> normals_;
};

/// Squares of one block, and their number.
struct Sums {
  double own = 0, offset = 0, last = 0;
  int count = 0;
};

void add_block(const Folds& folds, size_t recording, int b, const Eigen::VectorXd& residual,
               double threshold, Sums& sums) {
  // The residuals of each marker outside the block predict it, in sigmas, which hardly vary.
  std::map<std::pair<int, int>, std::pair<Eigen::VectorXd, int>> seen;
  std::map<std::pair<int, int>, const Objective::Block*> nearest;
  for (const Objective::Block& row : folds.objective(recording).blocks()) {
    if (folds.block_of(recording, row) == b) continue;
    const std::pair<int, int> key{row.set, row.marker};
    auto& sum = seen[key];
    if (sum.second == 0) sum.first = Eigen::VectorXd::Zero(row.dimension);
    sum.first += residual.segment(row.offset, row.dimension);
    ++sum.second;
    const bool before = folds.block_of(recording, row) < b;
    const Objective::Block*& held = nearest[key];
    if (held == nullptr || (before && row.frame > held->frame)) held = &row;
  }
  for (const Objective::Block& row : folds.objective(recording).blocks()) {
    if (folds.block_of(recording, row) != b) continue;
    const std::pair<int, int> key{row.set, row.marker};
    const Eigen::VectorXd part = residual.segment(row.offset, row.dimension);
    const double square = huber_square(part.norm(), threshold);
    sums.own += square;
    sums.count += row.dimension;
    const auto known = seen.find(key);
    if (known == seen.end()) {
      sums.offset += square;
      sums.last += square;
      continue;
    }
    const Eigen::VectorXd mean = known->second.first / known->second.second;
    const Objective::Block& held = *nearest.at(key);
    sums.offset += huber_square((part - mean).norm(), threshold);
    sums.last +=
        huber_square((part - residual.segment(held.offset, held.dimension)).norm(), threshold);
  }
}

/// Returns the squares of one block alone.
double squares_in(const Folds& folds, size_t recording, int b, const Eigen::VectorXd& residual,
                  double threshold) {
  double sum = 0;
  for (const Objective::Block& row : folds.objective(recording).blocks())
    if (folds.block_of(recording, row) == b)
      sum += huber_square(residual.segment(row.offset, row.dimension).norm(), threshold);
  return sum;
}

/// Returns the squares of all blocks, with free forces of the size that serves best.
double squares_with_forces(const Folds& folds, double threshold) {
  constexpr double kSigmas_m_per_s2[] = {0.01, 0.1, 1, 10};
  constexpr int kSizes = std::size(kSigmas_m_per_s2);
  std::vector<double> squares(static_cast<size_t>(kSizes * folds.blocks()));
  for_each_index(static_cast<size_t>(kSizes * folds.blocks()), [&](size_t index) {
    const int k = static_cast<int>(index), b = k % folds.blocks();
    if (b < folds.first_left_out()) return;
    const std::vector<Eigen::VectorXd> residuals =
        folds.residuals_with_forces_without(b, kSigmas_m_per_s2[k / folds.blocks()]);
    for (size_t n = 0; n < residuals.size(); ++n)
      squares[static_cast<size_t>(k)] += squares_in(folds, n, b, residuals[n], threshold);
  });
  double least = std::numeric_limits<double>::infinity();
  for (int size = 0; size < kSizes; ++size) {
    const auto first = squares.begin() + size * folds.blocks();
    least = std::min(least, std::accumulate(first, first + folds.blocks(), 0.0));
  }
  return least;
}

}  // namespace

CrossValidation cross_validate(const DiagnosisSetup& setup, const FittedModel& model, int blocks,
                               double threshold, bool whole, const DiagnosisSetup* forces_mesh) {
  whole = whole && model.parts.size() > 1;
  FreeForces forces;
  if (forces_mesh != nullptr && !whole && blocks > 1)
    forces = free_forces(*forces_mesh, model, kStretchesInBlock * blocks);
  const Folds folds(setup, model, blocks, threshold, whole, std::move(forces));
  std::vector<Sums> sums(static_cast<size_t>(folds.blocks()));
  for_each_index(static_cast<size_t>(folds.blocks() - folds.first_left_out()), [&](size_t index) {
    const int b = folds.first_left_out() + static_cast<int>(index);
    const std::vector<Eigen::VectorXd> residuals = folds.residuals_without(b);
    for (size_t n = 0; n < residuals.size(); ++n)
      add_block(folds, n, b, residuals[n], threshold, sums[static_cast<size_t>(b)]);
  });
  CrossValidation result;
  Sums all;
  for (auto b = static_cast<size_t>(folds.first_left_out()); b < sums.size(); ++b) {
    const Sums& own = sums[b];
    result.block.push_back(own.own / std::max(1, own.count));
    all.own += own.own;
    all.offset += own.offset;
    all.last += own.last;
    all.count += own.count;
  }
  const double total = std::max(1, all.count);
  result.mean = all.own / total;
  result.constant_offset = all.offset / total;
  result.last_residual = all.last / total;
  if (folds.has_forces()) result.free_forces = squares_with_forces(folds, threshold) / total;
  result.usable = std::isfinite(result.mean);
  return result;
}

}  // namespace clothfit
