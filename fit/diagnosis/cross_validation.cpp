#include "fit/diagnosis/cross_validation.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "fit/prior_cost.h"
#include "fit/uncertainty.h"

namespace clothfit {
namespace {

/// Twice Huber's cost of a residual's length.
double huber_square(double length, double threshold) {
  return length <= threshold ? length * length : threshold * (2 * length - threshold);
}

}  // namespace

CrossValidation cross_validate(const DiagnosisSetup& setup, const ModelFit& model, int blocks,
                               double threshold) {
  CrossValidation result;
  const TrajectoryObjective objective = model.objective();
  const ParameterSpace& space = model.problem->space;
  const Eigen::MatrixXd& jacobian = model.linear.residual_by_coordinate;
  const Eigen::VectorXd& residual = model.linear.residual;
  const Eigen::VectorXd weight = setup.options.loss == Loss::huber
                                     ? huber_weights(objective, residual, threshold)
                                     : Eigen::VectorXd::Ones(residual.size());
  const PriorCost prior = prior_cost(*model.problem, model.values);
  const auto block_of = [&](const Objective::Block& row) {
    return row.frame * blocks / model.frames;
  };

  Eigen::MatrixXd information = prior.information;
  Eigen::VectorXd gradient = prior.gradient;
  std::vector<Eigen::MatrixXd> own_information(static_cast<size_t>(blocks),
                                               Eigen::MatrixXd::Zero(space.size(), space.size()));
  Eigen::MatrixXd own_gradient = Eigen::MatrixXd::Zero(space.size(), blocks);
  for (const Objective::Block& row : objective.blocks()) {
    const auto block = static_cast<size_t>(block_of(row));
    const auto rows = jacobian.middleRows(row.offset, row.dimension);
    own_information[block].noalias() += weight[row.offset] * rows.transpose() * rows;
    own_gradient.col(block_of(row)) +=
        weight[row.offset] * rows.transpose() * residual.segment(row.offset, row.dimension);
  }
  for (const Eigen::MatrixXd& own : own_information) information += own;
  gradient += own_gradient.rowwise().sum();

  Eigen::VectorXd lower(space.size()), upper(space.size());
  for (int p = 0; p < space.size(); ++p) {
    lower[p] = space.parameters[static_cast<size_t>(p)].lower;
    upper[p] = space.parameters[static_cast<size_t>(p)].upper;
  }
  lower = space.coordinates(lower);
  upper = space.coordinates(upper);
  const Eigen::VectorXd here = space.coordinates(model.values);
  std::vector<Eigen::VectorXd> points;
  for (int b = 0; b < blocks; ++b) {
    Eigen::MatrixXd others = information - own_information[static_cast<size_t>(b)];
    others.diagonal().array() += 1e-9 * std::max(1.0, others.diagonal().maxCoeff());
    const Eigen::VectorXd step = -others.ldlt().solve(gradient - own_gradient.col(b));
    points.push_back(space.values((here + step).cwiseMax(lower).cwiseMin(upper)));
  }
  std::vector<Eigen::VectorXd> residuals = objective.residuals(points);
  for (Eigen::VectorXd& of : residuals)
    if (of.size() != residual.size()) of = residual;  // such a step led out of what is stable

  result.block.assign(static_cast<size_t>(blocks), 0);
  std::vector<int> count(static_cast<size_t>(blocks), 0);
  double all = 0, offset_all = 0, last_all = 0;
  for (int b = 0; b < blocks; ++b) {
    const Eigen::VectorXd& of = residuals[static_cast<size_t>(b)];
    // What the frames outside the block say of each marker, in sigmas (which hardly vary).
    std::map<std::pair<int, int>, std::pair<Eigen::VectorXd, int>> sums;
    std::map<std::pair<int, int>, const Objective::Block*> nearest;
    for (const Objective::Block& row : objective.blocks()) {
      if (block_of(row) == b) continue;
      const std::pair<int, int> key{row.set, row.marker};
      const auto part = of.segment(row.offset, row.dimension);
      auto& sum = sums[key];
      if (sum.second == 0) sum.first = Eigen::VectorXd::Zero(row.dimension);
      sum.first += part;
      ++sum.second;
      const bool before = block_of(row) < b;
      const Objective::Block*& held = nearest[key];
      if (held == nullptr || (before && row.frame > held->frame)) held = &row;
    }
    for (const Objective::Block& row : objective.blocks()) {
      if (block_of(row) != b) continue;
      const std::pair<int, int> key{row.set, row.marker};
      const Eigen::VectorXd part = of.segment(row.offset, row.dimension);
      const double square = huber_square(part.norm(), threshold);
      result.block[static_cast<size_t>(b)] += square;
      count[static_cast<size_t>(b)] += row.dimension;
      all += square;
      const auto known = sums.find(key);
      if (known == sums.end()) {
        offset_all += square;
        last_all += square;
        continue;
      }
      const Eigen::VectorXd mean = known->second.first / known->second.second;
      const Objective::Block& held = *nearest.at(key);
      offset_all += huber_square((part - mean).norm(), threshold);
      last_all += huber_square((part - of.segment(held.offset, held.dimension)).norm(), threshold);
    }
  }
  const double total = static_cast<double>(objective.residual_count());
  for (size_t b = 0; b < result.block.size(); ++b) result.block[b] /= std::max(1, count[b]);
  result.mean = all / total;
  result.constant_offset = offset_all / total;
  result.last_residual = last_all / total;
  result.usable = std::isfinite(result.mean);
  return result;
}

}  // namespace clothfit
