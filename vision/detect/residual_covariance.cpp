#include "vision/detect/residual_covariance.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace clothfit {
namespace {

/// Pairs of pixels this far apart, u and v; the opposite lag is the same pair.
struct Lag {
  int u = 0, v = 0;
};

/// Lags at about one distance, over which the shift of edges is averaged.
struct LagClass {
  double distance_px = 0;
  std::vector<Lag> lags;
};

// Of noise each lag has a covariance of its own: codecs correlate along rows and columns, hardly
// along diagonals. The shift reaches further and runs smoothly.
const std::vector<LagClass>& lag_classes() {
  static const std::vector<LagClass> classes = {
      {1, {{1, 0}, {0, 1}}},
      {1.4, {{1, 1}, {1, -1}}},
      {2, {{2, 0}, {0, 2}}},
      {3, {{3, 0}, {0, 3}, {2, 2}, {2, -2}}},
      {4, {{4, 0}, {0, 4}, {3, 3}, {3, -3}}},
      {6, {{6, 0}, {0, 6}, {4, 4}, {4, -4}}},
      {8, {{8, 0}, {0, 8}, {6, 6}, {6, -6}}},
      {12, {{12, 0}, {0, 12}}},
  };
  return classes;
}

/// Classes of which the covariance of noise counts.
constexpr size_t kNoiseClasses = 4;

/// Sums over pairs of pixels that a straight line of products of residuals over products of slopes
/// needs.
struct PairSums {
  double pairs = 0, slopes = 0, square_slopes = 0, residuals = 0, mixed = 0;

  PairSums& operator+=(const PairSums& other) {
    pairs += other.pairs;
    slopes += other.slopes;
    square_slopes += other.square_slopes;
    residuals += other.residuals;
    mixed += other.mixed;
    return *this;
  }
  /// Returns covariance of noise and of shift; the latter is 0 where slopes do not tell it apart.
  Eigen::Vector2d covariances() const {
    if (pairs == 0) return Eigen::Vector2d::Zero();
    const double spread = pairs * square_slopes - slopes * slopes;
    if (!(spread > 1e-6 * pairs * square_slopes)) return {residuals / pairs, 0};
    return {(residuals * square_slopes - mixed * slopes) / spread,
            (pairs * mixed - slopes * residuals) / spread};
  }
};

/// Returns the two parts of a map whose entries lie a lag apart.
template <class Map>
auto parts_apart(const Map& map, const Lag& lag) {
  const Eigen::Index rows = map.rows() - std::abs(lag.v), columns = map.cols() - lag.u;
  const bool any = rows > 0 && columns > 0;
  const Eigen::Index r = any ? rows : 0, c = any ? columns : 0;
  return std::pair(map.block(any ? std::max(0, lag.v) : 0, any ? lag.u : 0, r, c),
                   map.block(any ? std::max(0, -lag.v) : 0, 0, r, c));
}

}  // namespace

ResidualCovariance::ResidualCovariance(const TagFit& fit) {
  const auto& samples = fit.samples();
  place_px_.resize(static_cast<Eigen::Index>(samples.size()), 2);
  for (size_t i = 0; i < samples.size(); ++i)
    place_px_.row(static_cast<Eigen::Index>(i)) << samples[i].u, samples[i].v;
  first_px_ = place_px_.colwise().minCoeff();
  size_px_ = place_px_.colwise().maxCoeff().transpose() - first_px_ + Eigen::Vector2i::Ones();
  place_px_.rowwise() -= first_px_.transpose();
  gradient_ = fit.gradient().cast<float>();
  estimate(fit);
}

ResidualCovariance::Map ResidualCovariance::to_map(const Eigen::VectorXf& values) const {
  Map map = Map::Zero(size_px_.y(), size_px_.x());
  for (Eigen::Index i = 0; i < values.size(); ++i)
    map(place_px_(i, 1), place_px_(i, 0)) = values[i];
  return map;
}

void ResidualCovariance::estimate(const TagFit& fit) {
  const Eigen::VectorXd residual = fit.residual().cwiseProduct(fit.robust().cwiseSqrt());
  const Map r = to_map(residual.cast<float>());
  const Map there = to_map(Eigen::VectorXf::Ones(residual.size()));
  const Map slope_u = to_map(gradient_.col(0)), slope_v = to_map(gradient_.col(1));
  const auto sums_at = [&](const Lag& lag) {
    const auto [r1, r2] = parts_apart(r, lag);
    const auto [there1, there2] = parts_apart(there, lag);
    const auto [u1, u2] = parts_apart(slope_u, lag);
    const auto [v1, v2] = parts_apart(slope_v, lag);
    const Map slopes = u1 * u2 + v1 * v2, products = r1 * r2;
    return PairSums{.pairs = (there1 * there2).sum(),
                    .slopes = slopes.sum(),
                    .square_slopes = slopes.square().sum(),
                    .residuals = products.sum(),
                    .mixed = (products * slopes).sum()};
  };
  const Eigen::Vector2d variances = sums_at({}).covariances();
  constexpr double kRounding = 0.3;  // grey levels; what 8 bits leave
  noise_ = std::max(variances[0], kRounding * kRounding);
  seen_shift_.push_back(variances[1]);
  for (size_t k = 0; k < lag_classes().size(); ++k) {
    PairSums sums;
    for (const Lag& lag : lag_classes()[k].lags) sums += sums_at(lag);
    const Eigen::Vector2d covariances = sums.covariances();
    if (k < kNoiseClasses) noise_lag_.push_back(std::clamp(covariances[0], 0.0, noise_));
    seen_shift_.push_back(covariances[1]);
  }
  set_taken_up(0);
}

void ResidualCovariance::set_taken_up(double taken_up_px2) {
  const double reach = 0.5 * size_px_.minCoeff();  // of smooth bending
  shift_.clear();
  for (size_t k = 0; k < seen_shift_.size(); ++k) {
    const double distance = k == 0 ? 0 : lag_classes()[k - 1].distance_px;
    const double smooth = taken_up_px2 * std::max(0.0, 1 - distance / reach);
    // It falls with the distance.
    const double most = k == 0 ? seen_shift_[k] + smooth : shift_.back();
    shift_.push_back(std::max(0.0, std::min(seen_shift_[k] + smooth, most)));
  }
}

double ResidualCovariance::shift_at(double distance_px) const {
  const std::vector<LagClass>& classes = lag_classes();
  if (distance_px <= classes.front().distance_px) return shift_[1];
  for (size_t k = 1; k < classes.size(); ++k) {
    if (distance_px > classes[k].distance_px) continue;
    const double share = (distance_px - classes[k - 1].distance_px) /
                         (classes[k].distance_px - classes[k - 1].distance_px);
    return shift_[k] + share * (shift_[k + 1] - shift_[k]);
  }
  return shift_.back() * std::exp(1 - distance_px / classes.back().distance_px);
}

double ResidualCovariance::noise_variance(const Map& weight) const {
  double variance = noise_ * weight.square().sum();
  for (size_t k = 0; k < kNoiseClasses; ++k)
    for (const Lag& lag : lag_classes()[k].lags) {
      const auto [one, other] = parts_apart(weight, lag);
      variance += 2 * noise_lag_[k] * (one * other).sum();
    }
  return std::max(variance, noise_ * static_cast<double>(weight.square().sum()));
}

/// Adds up slopes times weights over blocks of pixels, since the shift is alike within a few.
ResidualCovariance::BlockSums ResidualCovariance::block_sums(const Sums& weights) const {
  BlockSums sums;
  constexpr int kLeast = 3, kMostAcross = 10;  // px, blocks
  sums.side_px = std::max(kLeast, (size_px_.maxCoeff() + kMostAcross - 1) / kMostAcross);
  const Eigen::Vector2i blocks = (size_px_.array() + sums.side_px - 1) / sums.side_px;
  sums.across = blocks.x();
  sums.along_u = sums.along_v = Sums::Zero(blocks.prod(), 8);
  for (Eigen::Index i = 0; i < weights.rows(); ++i) {
    const Eigen::Index block =
        place_px_(i, 1) / sums.side_px * blocks.x() + place_px_(i, 0) / sums.side_px;
    sums.along_u.row(block) += gradient_(i, 0) * weights.row(i);
    sums.along_v.row(block) += gradient_(i, 1) * weights.row(i);
  }
  sums.alone = (gradient_.rowwise().squaredNorm().asDiagonal() * weights.cwiseAbs2())
                   .colwise()
                   .sum()
                   .transpose()
                   .cast<double>();
  return sums;
}

ResidualCovariance::Variances ResidualCovariance::shift_variance(const BlockSums& sums) const {
  const auto blocks = static_cast<int>(sums.along_u.rows());
  const int down = blocks / sums.across;
  Eigen::MatrixXf by_offset(down, sums.across);  // blocks apart, down and across
  for (int v = 0; v < down; ++v)
    for (int u = 0; u < sums.across; ++u)
      by_offset(v, u) = static_cast<float>(shift_at(sums.side_px * std::hypot(u, v)));
  const double within = shift_at(0.5 * sums.side_px);
  by_offset(0, 0) = static_cast<float>(within);
  Eigen::MatrixXf between(blocks, blocks);
  for (int a = 0; a < blocks; ++a)
    for (int b = 0; b < blocks; ++b)
      between(b, a) = by_offset(std::abs(a / sums.across - b / sums.across),
                                std::abs(a % sums.across - b % sums.across));
  const auto quadratic = [&](const Sums& one) {
    return one.cwiseProduct(between * one).colwise().sum().transpose().cast<double>().eval();
  };
  return ((shift_[0] - within) * sums.alone + quadratic(sums.along_u) + quadratic(sums.along_v))
      .cwiseMax(shift_[0] * sums.alone);
}

ResidualCovariance::Variances ResidualCovariance::noise_variances(const Sums& weights) const {
  Variances result;
  for (int k = 0; k < 8; ++k) result[k] = noise_variance(to_map(weights.col(k)));
  return result;
}

void ResidualCovariance::complete(const Sums& places) {
  const BlockSums sums = block_sums(places);
  const Variances by_noise = noise_variances(places);
  constexpr int kRounds = 3;
  // The harmonic mean leaves places out that hardly any pixel tells, since something hides them.
  for (int i = 0; i < kRounds; ++i)
    set_taken_up(1 / (by_noise + shift_variance(sums)).cwiseInverse().mean());
}

ResidualCovariance::Variances ResidualCovariance::variance(const Sums& weights) const {
  return noise_variances(weights) + shift_variance(block_sums(weights));
}

}  // namespace clothfit
