#include "fit/uncertainty/space_time_blocks.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <vector>

namespace clothfit {

namespace {

struct Extent {
  double least = 0, length = 0;

  static Extent of(const Eigen::VectorXd& places) {
    return {places.minCoeff(), places.maxCoeff() - places.minCoeff()};
  }
  /// Returns which of `count` parts a place lies in; the last includes its end.
  int part(double place, int count) const {
    if (length <= 0) return 0;
    return std::min(count - 1, static_cast<int>((place - least) / length * count));
  }
};

/// Means of one component of the residuals over the cells of a grid.
struct CellMeans {
  std::array<int, 3> cells;  // along s, t, time
  std::vector<double> sum;   // of residuals, then their mean
  std::vector<int> count;    // of residuals; 0: nothing is known there

  size_t index(const std::array<int, 3>& at) const {
    return static_cast<size_t>((at[0] * cells[1] + at[1]) * cells[2] + at[2]);
  }
};

/// Returns the separation in cells from which on, along `direction`, cells tell nothing of each
/// other.
int range_in_cells(const std::vector<CellMeans>& components, size_t direction) {
  double variance = 0;
  int known = 0;
  for (const CellMeans& means : components) {
    for (size_t c = 0; c < means.sum.size(); ++c) {
      if (means.count[c] == 0) continue;
      variance += means.sum[c] * means.sum[c];
      ++known;
    }
  }
  variance /= std::max(1, known);
  const std::array<int, 3> cells = components.front().cells;
  for (int lag = 1; lag < cells[direction]; ++lag) {
    double product = 0;
    int pairs = 0;
    for (const CellMeans& means : components) {
      std::array<int, 3> at;
      for (at[0] = 0; at[0] < cells[0]; ++at[0]) {
        for (at[1] = 0; at[1] < cells[1]; ++at[1]) {
          for (at[2] = 0; at[2] < cells[2]; ++at[2]) {
            std::array<int, 3> other = at;
            other[direction] += lag;
            if (other[direction] >= cells[direction]) continue;
            const size_t a = means.index(at), b = means.index(other);
            if (means.count[a] == 0 || means.count[b] == 0) continue;
            product += means.sum[a] * means.sum[b];
            ++pairs;
          }
        }
      }
    }
    // Sparse markers may give no pair at this separation; the next one decides then.
    if (pairs > 0 && product / pairs <= 2 * variance / std::sqrt(pairs)) return lag;
  }
  return cells[direction];
}

}  // namespace

bool ObservationPlaces::valid() const {
  const auto n = s_m.size();
  return n > 0 && t_m.size() == n && time_s.size() == n && component.size() == n &&
         s_m.allFinite() && t_m.allFinite() && time_s.allFinite() && component.minCoeff() >= 0 &&
         component.maxCoeff() <= 2;
}

SpaceTimeBlocks space_time_blocks(const ObservationPlaces& places, const BlockCounts& counts) {
  assert(places.valid() && counts.valid());
  const Extent s = Extent::of(places.s_m), t = Extent::of(places.t_m),
               time = Extent::of(places.time_s);

  SpaceTimeBlocks result;
  result.block.resize(places.s_m.size());
  for (Eigen::Index i = 0; i < result.block.size(); ++i)
    result.block[i] = (s.part(places.s_m[i], counts.along_s) * counts.along_t +
                       t.part(places.t_m[i], counts.along_t)) *
                          counts.in_time +
                      time.part(places.time_s[i], counts.in_time);

  std::vector<int> used(result.block.begin(), result.block.end());
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  for (int& block : result.block)
    block = static_cast<int>(std::lower_bound(used.begin(), used.end(), block) - used.begin());
  result.count = static_cast<int>(used.size());
  return result;
}

CorrelationRanges correlation_ranges(const ObservationPlaces& places,
                                     const Eigen::VectorXd& residual) {
  constexpr std::array<int, 3> kCells{8, 8, 32};
  assert(places.valid() && residual.size() == places.s_m.size());
  const Extent s = Extent::of(places.s_m), t = Extent::of(places.t_m),
               time = Extent::of(places.time_s);

  const size_t cells = static_cast<size_t>(kCells[0] * kCells[1] * kCells[2]);
  std::vector<CellMeans> components(
      static_cast<size_t>(places.component.maxCoeff()) + 1,
      {kCells, std::vector<double>(cells, 0.0), std::vector<int>(cells, 0)});
  for (Eigen::Index i = 0; i < residual.size(); ++i) {
    CellMeans& means = components[static_cast<size_t>(places.component[i])];
    const size_t cell =
        means.index({s.part(places.s_m[i], kCells[0]), t.part(places.t_m[i], kCells[1]),
                     time.part(places.time_s[i], kCells[2])});
    means.sum[cell] += residual[i];
    ++means.count[cell];
  }
  for (CellMeans& means : components)
    for (size_t c = 0; c < cells; ++c)
      if (means.count[c] > 0) means.sum[c] /= means.count[c];

  const auto length = [&](const Extent& extent, size_t direction) {
    return extent.length * range_in_cells(components, direction) / kCells[direction];
  };
  return {length(s, 0), length(t, 1), length(time, 2)};
}

BlockCounts choose_block_counts(const ObservationPlaces& places, const Eigen::VectorXd& residual,
                                const BlockLimits& limits) {
  assert(limits.least.valid() && limits.least.along_s <= limits.most.along_s &&
         limits.least.along_t <= limits.most.along_t &&
         limits.least.in_time <= limits.most.in_time);
  const CorrelationRanges ranges = correlation_ranges(places, residual);
  const auto count = [](const Eigen::VectorXd& along, double range, int least, int most) {
    const double length = Extent::of(along).length;
    if (range <= 0) return least;
    return static_cast<int>(std::clamp(std::floor(length / range * (1 + 1e-9)),
                                       static_cast<double>(least), static_cast<double>(most)));
  };
  return {
      .along_s = count(places.s_m, ranges.s_m, limits.least.along_s, limits.most.along_s),
      .along_t = count(places.t_m, ranges.t_m, limits.least.along_t, limits.most.along_t),
      .in_time = count(places.time_s, ranges.time_s, limits.least.in_time, limits.most.in_time)};
}

}  // namespace clothfit
