#include "fit/diagnosis/cross_validation.h"

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "fit/prior_cost.h"
#include "fit/uncertainty.h"

namespace clothfit {
namespace {

/// Twice Huber's cost of a residual's length.
double huber_square(double length, double threshold) {
  return length <= threshold ? length * length : threshold * (2 * length - threshold);
}

/// One recording's normal equations over its parameters, then the amounts of its directions, in
/// all and of each stretch of frames.
struct Normal {
  Eigen::MatrixXd information;
  Eigen::VectorXd gradient;
  std::vector<Eigen::MatrixXd> block_information;
  std::vector<Eigen::VectorXd> block_gradient;
};

class Folds {
 public:
  Folds(const DiagnosisSetup& setup, const ModelFit& model, int blocks, double threshold,
        bool whole)
      : model_(model),
        problems_(model.problem_pointers()),
        space_(problems_),
        whole_(whole),
        blocks_(whole ? static_cast<int>(model.parts.size()) : blocks),
        threshold_(threshold) {
    for (size_t n = 0; n < model.parts.size(); ++n) {
      objectives_.push_back(model.objective(n));
      normals_.push_back(normal_of(n, setup.options.loss));
    }
  }

  int blocks() const { return blocks_; }
  int block_of(size_t recording, const Objective::Block& row) const {
    return whole_ ? static_cast<int>(recording)
                  : row.frame * blocks_ / model_.parts[recording].frames;
  }
  const TrajectoryObjective& objective(size_t recording) const { return objectives_[recording]; }

  /// Residuals of all recordings where block `b` took no part.
  std::vector<Eigen::VectorXd> residuals_without(int b) const {
    std::vector<Eigen::VectorXd> point(model_.parts.size()), amounts(model_.parts.size());
    step_without(b, point, amounts);
    std::vector<Eigen::VectorXd> result(model_.parts.size());
    for (size_t n = 0; n < model_.parts.size(); ++n) {
      result[n] = objectives_[n].residuals({point[n]}).front();
      // Such a step led out of what is stable.
      if (result[n].size() != objectives_[n].residual_count())
        result[n] = model_.parts[n].linear.residual;
      if (model_.parts[n].correction.size() > 0) result[n] += model_.parts[n].correction;
      if (amounts[n].size() > 0) result[n] += model_.parts[n].directions * amounts[n];
    }
    return result;
  }

 private:
  Normal normal_of(size_t n, Loss loss) const {
    const PooledPart& part = model_.parts[n];
    const Eigen::VectorXd residual = residual_of(part);
    const Eigen::VectorXd weight =
        huber_weights(objectives_[n], residual,
                      loss == Loss::huber ? threshold_ : std::numeric_limits<double>::infinity());
    const Eigen::Index fitted = part.linear.residual_by_coordinate.cols(),
                       all = fitted + part.directions.cols();
    const PriorCost prior = prior_cost(*problems_[n], part.values);
    Normal normal{.information = Eigen::MatrixXd::Identity(all, all),
                  .gradient = Eigen::VectorXd::Zero(all),
                  .block_information = {},
                  .block_gradient = {}};
    normal.information.topLeftCorner(fitted, fitted) = prior.information;
    normal.gradient.head(fitted) = prior.gradient;
    if (all > fitted) normal.gradient.tail(all - fitted) = part.amounts;
    const int stretches = whole_ ? 1 : blocks_;
    normal.block_information.assign(static_cast<size_t>(stretches),
                                    Eigen::MatrixXd::Zero(all, all));
    normal.block_gradient.assign(static_cast<size_t>(stretches), Eigen::VectorXd::Zero(all));
    std::vector<std::vector<int>> rows(static_cast<size_t>(stretches));
    for (const Objective::Block& block : objectives_[n].blocks())
      for (int c = 0; c < block.dimension; ++c)
        rows[whole_ ? 0 : static_cast<size_t>(block_of(n, block))].push_back(block.offset + c);
    for (size_t b = 0; b < rows.size(); ++b) {
      Eigen::MatrixXd jacobian(static_cast<Eigen::Index>(rows[b].size()), all);
      jacobian.leftCols(fitted) = part.linear.residual_by_coordinate(rows[b], Eigen::all);
      if (all > fitted) jacobian.rightCols(all - fitted) = part.directions(rows[b], Eigen::all);
      const Eigen::MatrixXd weighted = weight(rows[b]).asDiagonal() * jacobian;
      normal.block_information[b].noalias() = weighted.transpose() * jacobian;
      normal.block_gradient[b].noalias() = weighted.transpose() * residual(rows[b]);
      normal.information += normal.block_information[b];
      normal.gradient += normal.block_gradient[b];
    }
    return normal;
  }

  /// The arrow of all recordings' equations: own unknowns go first, then the shared ones. A whole
  /// recording that is left out says nothing of the shared ones, and its own ones follow them.
  void step_without(int b, std::vector<Eigen::VectorXd>& point,
                    std::vector<Eigen::VectorXd>& amounts) const {
    const auto shared = static_cast<Eigen::Index>(space_.shared());
    Eigen::MatrixXd reduced = Eigen::MatrixXd::Zero(shared, shared);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(shared);
    struct Own {
      Eigen::LDLT<Eigen::MatrixXd> solver;
      Eigen::MatrixXd between;
      Eigen::VectorXd gradient;
      std::vector<int> places;
    };
    std::vector<Own> owns;
    for (size_t n = 0; n < normals_.size(); ++n) {
      Eigen::MatrixXd information = normals_[n].information;
      Eigen::VectorXd gradient = normals_[n].gradient;
      const bool left_out = whole_ && static_cast<size_t>(b) == n;
      if (!whole_) {
        information -= normals_[n].block_information[static_cast<size_t>(b)];
        gradient -= normals_[n].block_gradient[static_cast<size_t>(b)];
      }
      information.diagonal().array() += 1e-9 * std::max(1.0, information.diagonal().maxCoeff());
      const std::vector<int> common = space_.shared_of(n);
      std::vector<int> places = space_.own_of(n);
      for (auto k = static_cast<int>(model_.parts[n].values.size()); k < information.rows(); ++k)
        places.push_back(k);
      Own own{.solver = Eigen::LDLT<Eigen::MatrixXd>(information(places, places)),
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
    const Eigen::VectorXd step = reduced.ldlt().solve(right);
    for (size_t n = 0; n < normals_.size(); ++n) {
      const ParameterSpace& space = problems_[n]->space;
      const PooledPart& part = model_.parts[n];
      Eigen::VectorXd way = Eigen::VectorXd::Zero(normals_[n].gradient.size());
      const std::vector<int> common = space_.shared_of(n);
      way(common) = step;
      if (!owns[n].places.empty()) {
        const Eigen::VectorXd pull = -owns[n].gradient - owns[n].between * step;
        way(owns[n].places) = Eigen::VectorXd(owns[n].solver.solve(pull));
      }
      Eigen::VectorXd lower(space.size()), upper(space.size());
      for (int p = 0; p < space.size(); ++p) {
        lower[p] = space.parameters[static_cast<size_t>(p)].lower;
        upper[p] = space.parameters[static_cast<size_t>(p)].upper;
      }
      const Eigen::VectorXd next = space.coordinates(part.values) + way.head(space.size());
      point[n] =
          space.values(next.cwiseMax(space.coordinates(lower)).cwiseMin(space.coordinates(upper)));
      if (part.amounts.size() > 0) amounts[n] = part.amounts + way.tail(part.amounts.size());
    }
  }

  const ModelFit& model_;
  std::vector<const FitProblem*> problems_;
  PooledSpace space_;
  bool whole_;
  int blocks_;
  double threshold_;
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
  // What was seen outside the block says of each marker, in sigmas (which hardly vary).
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

}  // namespace

CrossValidation cross_validate(const DiagnosisSetup& setup, const ModelFit& model, int blocks,
                               double threshold, bool whole) {
  const Folds folds(setup, model, blocks, threshold, whole && model.parts.size() > 1);
  std::vector<Sums> sums(static_cast<size_t>(folds.blocks()));
  tbb::parallel_for(0, folds.blocks(), [&](int b) {
    const std::vector<Eigen::VectorXd> residuals = folds.residuals_without(b);
    for (size_t n = 0; n < residuals.size(); ++n)
      add_block(folds, n, b, residuals[n], threshold, sums[static_cast<size_t>(b)]);
  });
  CrossValidation result;
  Sums all;
  for (const Sums& own : sums) {
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
  result.usable = std::isfinite(result.mean);
  return result;
}

}  // namespace clothfit
