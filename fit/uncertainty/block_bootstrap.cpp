#include "fit/uncertainty/block_bootstrap.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "data/algebra/dense_factors.h"
#include "fit/jobs/draws.h"

namespace clothfit {

namespace {

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
constexpr int kLeastReplicates = 19;

/// Returns the inverse where it exists.
std::optional<Eigen::MatrixXd> inverse_if_any(const Eigen::MatrixXd& information) {
  const Eigen::VectorXd unit = information.diagonal().cwiseSqrt().cwiseInverse();
  if (!unit.allFinite()) return std::nullopt;
  const CholeskyFactors factor(
      Eigen::MatrixXd(unit.asDiagonal() * information * unit.asDiagonal()));
  if (!factor.usable() || factor.reciprocal_condition() < 1e-12) return std::nullopt;
  return unit.asDiagonal() *
         factor.solve(Eigen::MatrixXd::Identity(information.rows(), information.cols())) *
         unit.asDiagonal();
}

/// Returns the value below which `share` of the sorted numbers lie, linear between them.
double quantile(const std::vector<double>& sorted, double share) {
  const double place = std::clamp(share * (static_cast<double>(sorted.size()) + 1) - 1, 0.0,
                                  static_cast<double>(sorted.size() - 1));
  const auto below = static_cast<size_t>(place);
  const size_t above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (place - static_cast<double>(below)) * (sorted[above] - sorted[below]);
}

ChangeIntervals quantiles(const Eigen::MatrixXd& numbers, double level) {
  assert(level > 0 && level < 1);
  ChangeIntervals ends{Eigen::VectorXd::Constant(numbers.rows(), kNothing),
                       Eigen::VectorXd::Constant(numbers.rows(), kNothing)};
  for (Eigen::Index i = 0; i < numbers.rows(); ++i) {
    std::vector<double> sorted;
    for (const double number : numbers.row(i))
      if (!std::isnan(number)) sorted.push_back(number);
    if (sorted.size() < kLeastReplicates) continue;
    std::sort(sorted.begin(), sorted.end());
    ends.lower[i] = quantile(sorted, 0.5 * (1 - level));
    ends.upper[i] = quantile(sorted, 0.5 * (1 + level));
  }
  return ends;
}

}  // namespace

bool BootstrapOptions::valid() const {
  return replicates >= kLeastReplicates;
}

Eigen::VectorXd block_weights(const BootstrapOptions& options, int blocks, int replicate) {
  Draws draws(options.seed, replicate, 0);
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(blocks);
  if (options.weights == BlockWeights::resampled) {
    for (int b = 0; b < blocks; ++b) ++weights[draws.index(blocks)];
    return weights;
  }
  const std::array<double, 6> six{-std::sqrt(1.5), -1, -std::sqrt(0.5),
                                  std::sqrt(0.5),  1,  std::sqrt(1.5)};
  for (double& weight : weights) weight = six[static_cast<size_t>(draws.index(6))];
  return weights;
}

Bootstrap bootstrap_linearised(const LinearisedFit& fit, const Eigen::VectorXi& block,
                               const BootstrapOptions& options) {
  assert(options.valid());
  const BlockSums sums = sum_over_blocks(fit, block);
  const int p = sums.coordinates(), blocks = sums.blocks();
  Bootstrap result;
  result.change = Eigen::MatrixXd::Constant(p, options.replicates, kNothing);
  result.studentised = result.change;
  result.sigma = Eigen::VectorXd::Constant(p, kNothing);
  const std::optional<Eigen::MatrixXd> inverse = inverse_if_any(sums.total_information);
  if (!inverse) {
    result.failed = options.replicates;
    return result;
  }
  const auto sigma = [&](const Eigen::MatrixXd& bread, const Eigen::MatrixXd& gradients,
                         const Eigen::VectorXd& counts) {
    const Eigen::MatrixXd meat = gradients * counts.asDiagonal() * gradients.transpose();
    return Eigen::VectorXd(
        (bread * (meat + sums.prior_information) * bread).diagonal().cwiseMax(0).cwiseSqrt());
  };
  const Eigen::VectorXd once = Eigen::VectorXd::Ones(blocks);
  result.sigma = sigma(*inverse, sums.gradient, once);

  for (int replicate = 0; replicate < options.replicates; ++replicate) {
    const Eigen::VectorXd weights = block_weights(options, blocks, replicate);
    const bool wild = options.weights == BlockWeights::wild;
    // At the optimum the priors' gradient balances that of all blocks.
    Eigen::VectorXd gradient;
    Eigen::MatrixXd bread;
    if (wild) {
      gradient = sums.gradient * weights;
      bread = *inverse;
    } else {
      gradient = sums.gradient * (weights - once);
      Eigen::MatrixXd information = sums.prior_information;
      for (int b = 0; b < blocks; ++b)
        information += weights[b] * sums.information[static_cast<size_t>(b)];
      const std::optional<Eigen::MatrixXd> own = inverse_if_any(information);
      if (!own) {
        ++result.failed;
        continue;
      }
      bread = *own;
    }
    const Eigen::VectorXd change = -bread * gradient;
    Eigen::MatrixXd gradients(p, blocks);  // of the replicate's residuals, after the step
    for (int b = 0; b < blocks; ++b)
      gradients.col(b) = (wild ? weights[b] : 1.0) * sums.gradient.col(b) +
                         sums.information[static_cast<size_t>(b)] * change;
    result.change.col(replicate) = change;
    result.studentised.col(replicate) =
        change.cwiseQuotient(sigma(bread, gradients, wild ? once : weights).cwiseMax(1e-300));
  }
  return result;
}

ChangeIntervals percentile_intervals(const Bootstrap& bootstrap, double level) {
  return quantiles(bootstrap.change, level);
}

ChangeIntervals studentised_intervals(const Bootstrap& bootstrap, double level) {
  const ChangeIntervals factor = quantiles(bootstrap.studentised, level);
  return {-factor.upper.cwiseProduct(bootstrap.sigma), -factor.lower.cwiseProduct(bootstrap.sigma)};
}

}  // namespace clothfit
