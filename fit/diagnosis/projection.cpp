#include "fit/diagnosis/projection.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cassert>

namespace clothfit {
namespace {

/// Of a column's own square, that it may lose and still count as something.
constexpr double kLeastLeft = 1e-9;

}  // namespace

Projection::Projection(const Eigen::MatrixXd& jacobian, const Eigen::MatrixXd& prior_information,
                       const Eigen::VectorXd& prior_gradient,
                       const Eigen::MatrixXd& unit_directions, const Eigen::VectorXd& weight,
                       const Eigen::VectorXd& residual)
    : root_weight_(weight.cwiseSqrt()) {
  const Eigen::Index rows = jacobian.rows(), fitted = jacobian.cols(),
                     units = unit_directions.cols();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> prior(prior_information);
  const Eigen::VectorXd root = prior.eigenvalues().cwiseMax(0).cwiseSqrt();

  moved_ = Eigen::MatrixXd::Zero(rows + fitted + units, fitted + units);
  moved_.topLeftCorner(rows, fitted) = root_weight_.asDiagonal() * jacobian;
  moved_.topRightCorner(rows, units) = root_weight_.asDiagonal() * unit_directions;
  moved_.block(rows, 0, fitted, fitted) = root.asDiagonal() * prior.eigenvectors().transpose();
  moved_.bottomRightCorner(units, units).setIdentity();
  Eigen::MatrixXd information = moved_.transpose() * moved_;
  // A coordinate that data and priors say nothing of stays where it is.
  information.diagonal().array() += 1e-12 * std::max(1.0, information.diagonal().maxCoeff());
  information_.compute(information);
  const auto of_data = moved_.topRows(rows);
  taken_ = information_.solve(of_data.transpose() * of_data).trace();

  residual_ = Eigen::VectorXd::Zero(moved_.rows());
  residual_.head(rows) = root_weight_.cwiseProduct(residual);
  const Eigen::VectorXd pull = prior.eigenvectors().transpose() * prior_gradient;
  for (Eigen::Index p = 0; p < fitted; ++p)
    if (root[p] > 0) residual_[rows + p] = pull[p] / root[p];
  residual_ -= moved_ * information_.solve(moved_.transpose() * residual_);
}

Eigen::MatrixXd Projection::columns(const Eigen::MatrixXd& of) const {
  Eigen::MatrixXd left = Eigen::MatrixXd::Zero(moved_.rows(), of.cols());
  left.topRows(of.rows()) = root_weight_.asDiagonal() * of;
  const Eigen::VectorXd before = left.colwise().squaredNorm();
  left -= moved_ * information_.solve(moved_.transpose() * left);
  for (Eigen::Index k = 0; k < left.cols(); ++k)
    if (left.col(k).squaredNorm() < kLeastLeft * before[k]) left.col(k).setZero();
  return left;
}

Explained explain(const Eigen::VectorXd& residual, const Eigen::MatrixXd& columns,
                  const Eigen::VectorXd& lower, const Eigen::VectorXd& upper) {
  assert(columns.cols() == lower.size() && lower.size() == upper.size());
  Explained result{.amount = Eigen::VectorXd::Zero(columns.cols()),
                   .information = columns.transpose() * columns};
  const Eigen::VectorXd pull = -columns.transpose() * residual;
  // Coordinate descent ends at the least within the box, for the sum of squares is convex.
  constexpr int kSweeps = 1000;
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    double most = 0;
    for (Eigen::Index k = 0; k < columns.cols(); ++k) {
      const double own = result.information(k, k);
      if (own == 0) continue;
      const double slope = pull[k] - result.information.row(k).dot(result.amount);
      const double next = std::clamp(result.amount[k] + slope / own, lower[k], upper[k]);
      most = std::max(most, (next - result.amount[k]) * (next - result.amount[k]) * own);
      result.amount[k] = next;
    }
    if (most < 1e-18) break;
  }
  result.fall = 2 * pull.dot(result.amount) - result.amount.dot(result.information * result.amount);
  return result;
}

}  // namespace clothfit
