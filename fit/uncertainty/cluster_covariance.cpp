#include "fit/uncertainty/cluster_covariance.h"

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cassert>
#include <cmath>
#include <limits>

#include "data/algebra/dense_factors.h"

namespace clothfit {

namespace {

/// Returns T with J_b' A_b r_b = T J_b' r_b. A_b differs from the identity only in the column space
/// of J_b, so a p x p matrix holds it. With S = J_b' J_b = V e^2 V' and U = J_b V e^-1 orthonormal,
/// A_b = I + U (f(e V' H^-1 V e) - I) U' for the correction's function f of the block's leverage.
Eigen::MatrixXd score_correction(const Eigen::MatrixXd& block_information,
                                 const Eigen::MatrixXd& inverse, ClusterCorrection correction) {
  const Eigen::Index p = inverse.rows();
  if (correction != ClusterCorrection::bias_reduced && correction != ClusterCorrection::jackknife)
    return Eigen::MatrixXd::Identity(p, p);
  const double power = correction == ClusterCorrection::bias_reduced ? -0.5 : -1.0;
  // Information that no other block has gives a leverage of 1. The fit leaves nothing of such
  // residuals to be enlarged, so the exact bound does not matter.
  constexpr double kLeastFreedom = 1e-6;

  const SymmetricEigen own = symmetric_eigen(block_information);
  const Eigen::VectorXd root = own.values.cwiseMax(0).cwiseSqrt();
  const double least = 1e-7 * root.maxCoeff();
  Eigen::VectorXd inverse_root = Eigen::VectorXd::Zero(p);
  for (Eigen::Index i = 0; i < p; ++i)
    if (root[i] > least) inverse_root[i] = 1 / root[i];
  const Eigen::MatrixXd& v = own.vectors;
  const Eigen::MatrixXd leverage =
      root.asDiagonal() * (v.transpose() * inverse * v) * root.asDiagonal();
  const SymmetricEigen lever = symmetric_eigen(leverage);
  const Eigen::VectorXd grown = (1 - lever.values.array()).max(kLeastFreedom).pow(power).matrix();
  return v * root.asDiagonal() * (lever.vectors * grown.asDiagonal() * lever.vectors.transpose()) *
         inverse_root.asDiagonal() * v.transpose();
}

}  // namespace

ClusterCovariance cluster_covariance(const LinearisedFit& fit, const Eigen::VectorXi& block,
                                     ClusterCorrection correction) {
  constexpr double kLeastInformation = 1e-12;
  const BlockSums all = sum_over_blocks(fit, block);
  const Eigen::Index coordinates = all.coordinates();
  ClusterCovariance result{.blocks = all.blocks()};
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  result.covariance = Eigen::MatrixXd::Zero(coordinates, coordinates);
  result.degrees_of_freedom = Eigen::VectorXd::Ones(coordinates);
  std::vector<Eigen::Index> known;
  for (Eigen::Index i = 0; i < coordinates; ++i)
    if (all.total_information(i, i) > kLeastInformation)
      known.push_back(i);
    else
      result.covariance(i, i) = kInfinite;
  if (known.empty()) {
    result.reason = "no coordinate changes any residual";
    return result;
  }

  // Units are those of each coordinate's own information, so that conditions can be judged.
  const auto p = static_cast<Eigen::Index>(known.size());
  const Eigen::VectorXd unit =
      Eigen::VectorXd(all.total_information.diagonal())(known).cwiseSqrt().cwiseInverse();
  const auto scaled = [&](const Eigen::MatrixXd& matrix) {
    return Eigen::MatrixXd(unit.asDiagonal() * Eigen::MatrixXd(matrix(known, known)) *
                           unit.asDiagonal());
  };
  const SymmetricEigen total = symmetric_eigen(scaled(all.total_information));
  if (total.values.minCoeff() < kLeastInformation) {
    result.reason = "some coordinates cannot be told apart";
    return result;
  }
  const Eigen::MatrixXd inverse =
      total.vectors * total.values.cwiseInverse().asDiagonal() * total.vectors.transpose();
  const Eigen::MatrixXd prior = scaled(all.prior_information);

  Eigen::MatrixXd score(p, all.blocks());
  std::vector<Eigen::MatrixXd> mixed, squared;  // J_b' A_b J_b and J_b' A_b A_b J_b
  for (int b = 0; b < all.blocks(); ++b) {
    const Eigen::MatrixXd own = scaled(all.information[static_cast<size_t>(b)]);
    const Eigen::MatrixXd grow = score_correction(own, inverse, correction);
    score.col(b) =
        grow * unit.cwiseProduct(Eigen::VectorXd(Eigen::VectorXd(all.gradient.col(b))(known)));
    mixed.push_back(grow * own);
    squared.push_back(grow * own * grow.transpose());
  }
  if (correction == ClusterCorrection::count)
    score *= std::sqrt(static_cast<double>(all.blocks()) / (all.blocks() - 1));
  const Eigen::MatrixXd covariance =
      inverse * (score * score.transpose() + prior) * inverse.transpose();

  for (Eigen::Index i = 0; i < p; ++i) {
    for (Eigen::Index j = 0; j < p; ++j)
      result.covariance(known[static_cast<size_t>(i)], known[static_cast<size_t>(j)]) =
          unit[i] * covariance(i, j) * unit[j];

    // Were residuals white, the blocks' shares in this coordinate's change have the covariance a_b'
    // (I - J H^-1 J') a_c. Their sum of squares is the estimate.
    const Eigen::VectorXd row = inverse.col(i);
    Eigen::MatrixXd share(all.blocks(), p);
    Eigen::VectorXd own(all.blocks());
    for (int b = 0; b < all.blocks(); ++b) {
      share.row(b) = row.transpose() * mixed[static_cast<size_t>(b)];
      own[b] = row.dot(squared[static_cast<size_t>(b)] * row);
    }
    Eigen::MatrixXd scatter = -share * inverse * share.transpose();
    scatter.diagonal() += own;
    const double mean = std::max(0.0, scatter.trace()) + row.dot(prior * row);
    const double spread = scatter.squaredNorm();
    result.degrees_of_freedom[known[static_cast<size_t>(i)]] =
        spread > 1e-24 * mean * mean ? std::max(1.0, mean * mean / spread) : kInfinite;
  }
  result.usable = true;
  return result;
}

double student_factor(double level, double degrees_of_freedom) {
  assert(level > 0 && level < 1 && degrees_of_freedom > 0);
  const double share = 0.5 * (1 + level);
  if (std::isinf(degrees_of_freedom))
    return boost::math::quantile(boost::math::normal_distribution<>(), share);
  return boost::math::quantile(boost::math::students_t_distribution<>(degrees_of_freedom), share);
}

Eigen::VectorXd half_width(const ClusterCovariance& covariance, double level) {
  Eigen::VectorXd width = covariance.covariance.diagonal().cwiseSqrt();
  for (Eigen::Index i = 0; i < width.size(); ++i)
    width[i] *= student_factor(level, covariance.degrees_of_freedom[i]);
  return width;
}

}  // namespace clothfit
