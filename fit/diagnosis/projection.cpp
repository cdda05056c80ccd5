#include "fit/diagnosis/projection.h"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cassert>
#include <vector>

namespace clothfit {
namespace {

/// Of a column's own square, that it may lose and still count as something.
constexpr double kLeastLeft = 1e-9;

/// An orthonormal basis of what columns span.
Eigen::MatrixXd basis(Eigen::MatrixXd columns) {
  for (Eigen::Index k = 0; k < columns.cols(); ++k)
    columns.col(k) /= std::max(columns.col(k).norm(), 1e-300);
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(columns);
  qr.setThreshold(1e-6);
  return qr.householderQ() * Eigen::MatrixXd::Identity(columns.rows(), qr.rank());
}

}  // namespace

Projection::Projection(const Eigen::MatrixXd& jacobian, const Eigen::MatrixXd& prior_information,
                       const Eigen::VectorXd& prior_gradient,
                       const Eigen::MatrixXd& unit_directions, const Eigen::VectorXd& weight,
                       const Eigen::VectorXd& residual)
    : root_weight_(weight.cwiseSqrt()) {
  const Eigen::Index fitted = jacobian.cols(), units = unit_directions.cols();
  moved_.resize(jacobian.rows(), fitted + units);
  moved_ << jacobian, unit_directions;
  moved_ = root_weight_.asDiagonal() * moved_;
  const Eigen::MatrixXd of_data = moved_.transpose() * moved_;
  Eigen::MatrixXd information = of_data;
  information.topLeftCorner(fitted, fitted) += prior_information;
  information.diagonal().tail(units).array() += 1;
  // A coordinate that data and priors say nothing of stays where it is.
  information.diagonal().array() += 1e-12 * std::max(1.0, information.diagonal().maxCoeff());
  information_.compute(information);
  taken_ = information_.solve(of_data).trace();
  residual_ = root_weight_.cwiseProduct(residual);
  Eigen::VectorXd gradient = moved_.transpose() * residual_;
  gradient.head(fitted) += prior_gradient;
  residual_ -= moved_ * information_.solve(gradient);
}

Eigen::MatrixXd Projection::columns(const Eigen::MatrixXd& of) const {
  Eigen::MatrixXd left = root_weight_.asDiagonal() * of;
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

double canonical_correlation(const Eigen::MatrixXd& one, const Eigen::MatrixXd& other) {
  const Eigen::MatrixXd first = basis(one), second = basis(other);
  if (first.cols() == 0 || second.cols() == 0) return 0;
  const Eigen::MatrixXd cosines = first.transpose() * second;
  return cosines.jacobiSvd().singularValues()[0];
}

}  // namespace clothfit
