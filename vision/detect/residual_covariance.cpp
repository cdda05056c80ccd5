#include "vision/detect/residual_covariance.h"

#include <algorithm>
#include <cmath>
#include <limits>
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
      {1.4, {{1, 1}, {-1, 1}}},
      {2, {{2, 0}, {0, 2}}},
      {3, {{3, 0}, {0, 3}, {2, 2}, {-2, 2}}},
      {4, {{4, 0}, {0, 4}, {3, 3}, {-3, 3}}},
      {6, {{6, 0}, {0, 6}, {4, 4}, {-4, 4}}},
      {8, {{8, 0}, {0, 8}, {6, 6}, {-6, 6}}},
      {12, {{12, 0}, {0, 12}}},
  };
  return classes;
}

/// Classes of which the covariance of noise counts.
constexpr size_t kNoiseClasses = 4;

/// Returns covariance of noise and of shift; the latter is 0 where slopes do not tell it apart.
Eigen::Vector2d covariances(const PairSums& sums) {
  if (sums.pairs == 0) return Eigen::Vector2d::Zero();
  const double spread = sums.pairs * sums.square_slopes - sums.slopes * sums.slopes;
  if (!(spread > 1e-6 * sums.pairs * sums.square_slopes)) return {sums.residuals / sums.pairs, 0};
  return {(sums.residuals * sums.square_slopes - sums.mixed * sums.slopes) / spread,
          (sums.pairs * sums.mixed - sums.slopes * sums.residuals) / spread};
}

void add(const PairSums& more, PairSums& sums) {
  sums.pairs += more.pairs;
  sums.slopes += more.slopes;
  sums.square_slopes += more.square_slopes;
  sums.residuals += more.residuals;
  sums.mixed += more.mixed;
}

/// Returns the distance between rows of maps: a gap of zeros follows each.
int map_stride(const TagSamples& samples) {
  return (samples.width + 15) / 16 * 16 + SampleMaps::kReach;
}

/// Returns where a sample is in the maps.
Eigen::Index map_place(const TagSamples& samples, Eigen::Index i) {
  const auto k = static_cast<size_t>(i);
  return SampleMaps::kReach + static_cast<Eigen::Index>(samples.v[k]) * map_stride(samples) +
         samples.u[k];
}

Eigen::Index map_size(const TagSamples& samples) {
  return static_cast<Eigen::Index>(samples.height + SampleMaps::kReach) * map_stride(samples) +
         2 * SampleMaps::kReach;
}

SampleMaps make_maps(const TagSamples& samples, const TagRows& rows) {
  SampleMaps maps{.stride = map_stride(samples), .rows = samples.height};
  for (Eigen::ArrayXf* map : {&maps.there, &maps.residual, &maps.gradient_u, &maps.gradient_v})
    map->setZero(map_size(samples));
  for (Eigen::Index i = 0; i < samples.count; ++i) {
    const Eigen::Index at = map_place(samples, i);
    maps.there[at] = 1;
    maps.residual[at] = rows.residual[i] * std::sqrt(rows.robust[i]);
    maps.gradient_u[at] = rows.gradient_u[i];
    maps.gradient_v[at] = rows.gradient_v[i];
  }
  return maps;
}

}  // namespace

EdgeSamples::EdgeSamples(const TagFit& fit) {
  const TagSamples& all = fit.samples();
  const float flat = flat_limits(fit.rows()).slope;
  std::vector<Eigen::Index> steep;
  for (Eigen::Index i = 0; i < all.count; ++i)
    if (fit.rows().slope[i] > flat) steep.push_back(i);
  samples = {.count = static_cast<Eigen::Index>(steep.size()),
             .x = all.x(steep),
             .y = all.y(steep),
             .grey = all.grey(steep),
             .u = {},
             .v = {},
             .width = all.width,
             .height = all.height};
  for (const Eigen::Index i : steep) {
    samples.u.push_back(all.u[static_cast<size_t>(i)]);
    samples.v.push_back(all.v[static_cast<size_t>(i)]);
  }
  rows = fit.rows().at(steep);
}

ResidualCovariance::ResidualCovariance(const EdgeSamples& edges) : edges_(&edges) {
  const TagSamples& samples = edges.samples;
  for (Eigen::Index i = 0; i < samples.count; ++i)
    place_.push_back(static_cast<int>(map_place(samples, i)));
  estimate();
}

void ResidualCovariance::estimate() {
  const SampleMaps maps = make_maps(edges_->samples, edges_->rows);
  const Eigen::Vector2d variances = covariances(pair_sums(maps, 0, 0));
  constexpr double kRounding = 0.3;  // grey levels; what 8 bits leave
  noise_ = std::max(variances[0], kRounding * kRounding);
  seen_shift_.push_back(variances[1]);
  for (size_t k = 0; k < lag_classes().size(); ++k) {
    PairSums sums;
    for (const Lag& lag : lag_classes()[k].lags) add(pair_sums(maps, lag.u, lag.v), sums);
    const Eigen::Vector2d both = covariances(sums);
    if (k < kNoiseClasses) noise_lag_.push_back(std::clamp(both[0], 0.0, noise_));
    seen_shift_.push_back(both[1]);
  }
  set_taken_up(0);
}

void ResidualCovariance::set_taken_up(double taken_up_px2) {
  const double reach =
      0.5 * std::min(edges_->samples.width, edges_->samples.height);  // of smooth bending
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

ResidualCovariance::AllVariances ResidualCovariance::noise_variances(
    const ResidualSums& weights) const {
  const TagSamples& samples = edges_->samples;
  const AllVariances alone =
      noise_ * weights.cwiseAbs2().colwise().sum().transpose().cast<double>().array();
  if (std::ranges::all_of(noise_lag_, [](double lag) { return lag == 0; })) return alone;
  std::vector<int> sample_at(static_cast<size_t>(map_size(samples)),
                             std::numeric_limits<int>::max());
  for (size_t i = 0; i < place_.size(); ++i)
    sample_at[static_cast<size_t>(place_[i])] = static_cast<int>(i);
  AllVariances all = alone;
  for (size_t k = 0; k < kNoiseClasses; ++k) {
    if (noise_lag_[k] == 0) continue;
    for (const Lag& lag : lag_classes()[k].lags)
      all +=
          2 * noise_lag_[k] *
          paired_products(weights, place_, sample_at, lag.v * map_stride(samples) + lag.u).array();
  }
  return all.max(alone);
}

/// Adds up slopes times weights over blocks of pixels, since the shift is alike within a few.
void ResidualCovariance::add_blocks(const ResidualSums& weights) {
  const TagSamples& samples = edges_->samples;
  const TagRows& rows = edges_->rows;
  constexpr int kLeast_px = 3;
  const int size = std::max(samples.width, samples.height);
  block_px_ = std::max(kLeast_px, (size + kMostAcross - 1) / kMostAcross);
  const int across = (samples.width + block_px_ - 1) / block_px_;
  const int down = (samples.height + block_px_ - 1) / block_px_;
  ResidualSums along_u = ResidualSums::Zero(across * down, 16), along_v = along_u;
  Eigen::Array<float, 1, 16> alone = Eigen::Array<float, 1, 16>::Zero();
  for (Eigen::Index i = 0; i < samples.count; ++i) {
    const auto k = static_cast<size_t>(i);
    const Eigen::Index block = samples.v[k] / block_px_ * across + samples.u[k] / block_px_;
    along_u.row(block) += rows.gradient_u[i] * weights.row(i);
    along_v.row(block) += rows.gradient_v[i] * weights.row(i);
    alone += (rows.slope[i] * weights.row(i)).array().square();
  }
  alone_ = alone.transpose().cast<double>();
  by_offset_.setZero(kMostAcross * kMostAcross, 16);
  for (int a = 0; a < across * down; ++a)
    for (int b = a; b < across * down; ++b) {
      const int offset =
          (b / across - a / across) * kMostAcross + std::abs(b % across - a % across);
      by_offset_.row(offset) +=
          (a == b ? 1.0F : 2.0F) * (along_u.row(a).cwiseProduct(along_u.row(b)) +
                                    along_v.row(a).cwiseProduct(along_v.row(b)));
    }
}

ResidualCovariance::AllVariances ResidualCovariance::shift_variances() const {
  const double within = shift_at(0.5 * block_px_);
  AllVariances all = (shift_[0] - within) * alone_;
  for (int v = 0; v < kMostAcross; ++v)
    for (int u = 0; u < kMostAcross; ++u) {
      const double shift = u == 0 && v == 0 ? within : shift_at(block_px_ * std::hypot(u, v));
      all += shift * by_offset_.row(v * kMostAcross + u).transpose().cast<double>().array();
    }
  return all.max(shift_[0] * alone_);
}

ResidualCovariance::Variances ResidualCovariance::variance(const ResidualSums& sums) {
  add_blocks(sums);
  const AllVariances by_noise = noise_variances(sums);
  constexpr int kRounds = 3;
  // The harmonic mean leaves places out that hardly any pixel tells, since something hides them.
  for (int i = 0; i < kRounds; ++i)
    set_taken_up(1 / (by_noise + shift_variances()).head<8>().inverse().mean());
  return (by_noise + shift_variances()).tail<8>();
}

}  // namespace clothfit
