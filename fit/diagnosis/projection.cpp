#include "fit/diagnosis/projection.h"

#include <algorithm>
#include <cassert>
#include <limits>

#include "data/algebra/dense_factors.h"
#include "fit/cost/huber.h"
#include "fit/problem/prior_cost.h"
#include "fit/uncertainty/uncertainty.h"

namespace clothfit {
namespace {

/// The share of its own square that a column must keep to count as something.
constexpr double kLeastLeft = 1e-9;

}  // namespace

Projection::Projection(const Eigen::MatrixXd& jacobian, const Eigen::MatrixXd& prior_information,
                       const Eigen::VectorXd& prior_gradient,
                       const Eigen::MatrixXd& unit_directions, const Eigen::VectorXd& weight,
                       const Eigen::VectorXd& residual)
    : root_weight_(weight.cwiseSqrt()) {
  const Eigen::Index rows = jacobian.rows(), fitted = jacobian.cols(),
                     units = unit_directions.cols();
  if (fitted + units == 0) {
    moved_.resize(rows, 0);
    residual_ = root_weight_.cwiseProduct(residual);
    return;
  }
  SymmetricEigen prior;
  Eigen::VectorXd root(0), pull(0);
  if (fitted > 0) {
    prior = symmetric_eigen(prior_information);
    root = prior.values.cwiseMax(0).cwiseSqrt();
    pull = prior.vectors.transpose() * prior_gradient;
  }

  moved_ = Eigen::MatrixXd::Zero(rows + fitted + units, fitted + units);
  moved_.topLeftCorner(rows, fitted) = root_weight_.asDiagonal() * jacobian;
  moved_.topRightCorner(rows, units) = root_weight_.asDiagonal() * unit_directions;
  if (fitted > 0)
    moved_.block(rows, 0, fitted, fitted) = root.asDiagonal() * prior.vectors.transpose();
  moved_.bottomRightCorner(units, units).setIdentity();
  Eigen::MatrixXd information = moved_.transpose() * moved_;
  // A coordinate that data and priors say nothing of stays where it is.
  information.diagonal().array() += 1e-12 * std::max(1.0, information.diagonal().maxCoeff());
  information_ = SymmetricFactors(information);
  const auto of_data = moved_.topRows(rows);
  taken_ = information_.solve(of_data.transpose() * of_data).trace();

  residual_ = Eigen::VectorXd::Zero(moved_.rows());
  residual_.head(rows) = root_weight_.cwiseProduct(residual);
  for (Eigen::Index p = 0; p < fitted; ++p)
    if (root[p] > 0) residual_[rows + p] = pull[p] / root[p];
  residual_ -= moved_ * information_.solve(moved_.transpose() * residual_);
}

Eigen::MatrixXd Projection::columns(const Eigen::MatrixXd& of) const {
  Eigen::MatrixXd left = Eigen::MatrixXd::Zero(moved_.rows(), of.cols());
  left.topRows(of.rows()) = root_weight_.asDiagonal() * of;
  if (moved_.cols() == 0) return left;
  const Eigen::VectorXd before = left.colwise().squaredNorm();
  left -= moved_ * information_.solve(moved_.transpose() * left);
  for (Eigen::Index k = 0; k < left.cols(); ++k)
    if (left.col(k).squaredNorm() < kLeastLeft * before[k]) left.col(k).setZero();
  return left;
}

ModelProjection::ModelProjection(const FittedModel& model, Loss loss, bool with_directions) {
  const std::vector<const FitProblem*> problems = model.problem_pointers();
  const PooledSpace space(problems);
  const double threshold = loss == Loss::huber ? kHuberScales * robust_scale(model.residual())
                                               : std::numeric_limits<double>::infinity();
  std::vector<Eigen::MatrixXd> shared_columns;
  Eigen::MatrixXd prior_information = Eigen::MatrixXd::Zero(space.shared(), space.shared());
  Eigen::VectorXd prior_gradient = Eigen::VectorXd::Zero(space.shared());
  Eigen::Index rows = 0;
  for (size_t n = 0; n < problems.size(); ++n) {
    const PooledPart& part = model.parts[n];
    const std::vector<int> common = space.shared_of(n);
    const std::vector<int>& own = space.own_of(n);
    const PriorCost prior = prior_cost(*problems[n], part.values);
    const Eigen::MatrixXd& jacobian = part.linear.residual_by_coordinate;
    const Eigen::VectorXd residual = corrected_residual(part);
    const bool has_directions = with_directions && part.directions.cols() > 0;
    own_.emplace_back(jacobian(Eigen::all, own), prior.information(own, own), prior.gradient(own),
                      has_directions ? part.directions : Eigen::MatrixXd(residual.size(), 0),
                      huber_weights(model.objective(n),
                                    with_directions ? residual_of(part) : residual, threshold),
                      residual);
    first_row_.push_back(rows);
    rows += own_.back().residual().size();
    shared_columns.push_back(own_.back().columns(jacobian(Eigen::all, common)));
    prior_information += prior.information(common, common);
    prior_gradient += prior.gradient(common);
  }
  first_row_.push_back(rows);
  Eigen::VectorXd residual(rows);
  for (size_t n = 0; n < own_.size(); ++n)
    residual.segment(first_row_[n], own_[n].residual().size()) = own_[n].residual();
  shared_.emplace_back(stacked(shared_columns), prior_information, prior_gradient,
                       Eigen::MatrixXd(rows, 0), Eigen::VectorXd::Ones(rows), residual);
}

Eigen::MatrixXd ModelProjection::stacked(const std::vector<Eigen::MatrixXd>& projected) const {
  Eigen::MatrixXd all(first_row_.back(), projected.front().cols());
  for (size_t n = 0; n < projected.size(); ++n)
    all.middleRows(first_row_[n], projected[n].rows()) = projected[n];
  return all;
}

Eigen::MatrixXd ModelProjection::columns(const std::vector<Eigen::MatrixXd>& of) const {
  std::vector<Eigen::MatrixXd> projected;
  for (size_t n = 0; n < own_.size(); ++n) projected.push_back(own_[n].columns(of[n]));
  return shared_.front().columns(stacked(projected));
}

double ModelProjection::taken() const {
  double sum = shared_.front().taken();
  for (const Projection& own : own_) sum += own.taken();
  return sum;
}

double ModelProjection::weights() const {
  double sum = 0;
  for (const Projection& own : own_) sum += own.weights();
  return sum;
}

Explained explain(const Eigen::VectorXd& residual, const Eigen::MatrixXd& columns,
                  const Eigen::VectorXd& lower, const Eigen::VectorXd& upper) {
  assert(columns.cols() == lower.size() && lower.size() == upper.size());
  Explained result{.amplitude = Eigen::VectorXd::Zero(columns.cols()),
                   .information = columns.transpose() * columns};
  const Eigen::VectorXd pull = -columns.transpose() * residual;
  // Coordinate descent ends at the least within the box, for the sum of squares is convex.
  constexpr int kSweeps = 1000;
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    double most = 0;
    for (Eigen::Index k = 0; k < columns.cols(); ++k) {
      const double own = result.information(k, k);
      if (own == 0) continue;
      const double slope = pull[k] - result.information.row(k).dot(result.amplitude);
      const double next = std::clamp(result.amplitude[k] + slope / own, lower[k], upper[k]);
      most = std::max(most, (next - result.amplitude[k]) * (next - result.amplitude[k]) * own);
      result.amplitude[k] = next;
    }
    if (most < 1e-18) break;
  }
  result.decrease =
      2 * pull.dot(result.amplitude) - result.amplitude.dot(result.information * result.amplitude);
  return result;
}

}  // namespace clothfit
