#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "model/effects/number.h"

namespace clothfit {

/// Finds points that are near each other: cells as wide as the distance, kept in a hash table.
/// Holds its memory between calls, so that nothing is allocated once it has seen as many points.
class NearPairs {
 public:
  /// Calls `visit(a, b, vector from a to b, squared distance)` once for every two of `count` points
  /// closer than `distance_m` > 0. Points that are not finite have no pairs. The order of the calls
  /// depends on the positions alone.
  template <class Positions, class Visit>
  void for_pairs(int count, const Positions& position_m, double distance_m, const Visit& visit) {
    sort_into_cells(count, position_m, distance_m);
    const double square_m2 = distance_m * distance_m;
    for (int a = 0; a < count; ++a) {
      const Point& from = points_[static_cast<size_t>(a)];
      if (!from.finite) continue;
      // The own cell, and of the 26 around it the half that comes after: the others see this one.
      for (const Cell& step : kCells) {
        const bool own = step == kCells[0];
        const Cell cell{from.cell[0] + step[0], from.cell[1] + step[1], from.cell[2] + step[2]};
        const size_t bucket = bucket_of(cell);
        for (int n = first_[bucket]; n < first_[bucket + 1]; ++n) {
          const int b = members_[static_cast<size_t>(n)];
          const Point& to = points_[static_cast<size_t>(b)];
          if (to.cell != cell || (own && b <= a)) continue;
          const Vector3<double> connection = to.place_m - from.place_m;
          const double distance_m2 = dot(connection, connection);
          if (distance_m2 < square_m2) visit(a, b, connection, distance_m2);
        }
      }
    }
  }

 private:
  using Cell = std::array<std::int64_t, 3>;
  struct Point {
    Vector3<double> place_m;
    Cell cell;
    bool finite;
  };
  static constexpr std::array<Cell, 14> kCells = {{{0, 0, 0},
                                                   {1, -1, -1},
                                                   {1, -1, 0},
                                                   {1, -1, 1},
                                                   {1, 0, -1},
                                                   {1, 0, 0},
                                                   {1, 0, 1},
                                                   {1, 1, -1},
                                                   {1, 1, 0},
                                                   {1, 1, 1},
                                                   {0, 1, -1},
                                                   {0, 1, 0},
                                                   {0, 1, 1},
                                                   {0, 0, 1}}};

  size_t bucket_of(const Cell& cell) const {
    std::uint64_t hash = 0;
    for (const std::int64_t number : cell) {
      hash = (hash ^ static_cast<std::uint64_t>(number)) * 0x9E3779B97F4A7C15u;
      hash ^= hash >> 29;
    }
    return static_cast<size_t>(hash) & (first_.size() - 2);
  }

  template <class Positions>
  void sort_into_cells(int count, const Positions& position_m, double distance_m) {
    size_t buckets = 1;
    while (buckets < static_cast<size_t>(2 * count)) buckets *= 2;
    first_.assign(buckets + 1, 0);
    points_.resize(static_cast<size_t>(count));
    members_.resize(static_cast<size_t>(count));
    const auto number = [&](double x) { return static_cast<std::int64_t>(std::floor(x)); };
    for (int k = 0; k < count; ++k) {
      Point& point = points_[static_cast<size_t>(k)];
      point.place_m = position_m(k);
      const Vector3<double> at = 1 / distance_m * point.place_m;
      constexpr double kFar = 1e15;  // cells that whole numbers still tell apart
      point.finite = std::abs(at.x) < kFar && std::abs(at.y) < kFar && std::abs(at.z) < kFar;
      if (!point.finite) continue;
      point.cell = {number(at.x), number(at.y), number(at.z)};
      ++first_[bucket_of(point.cell)];
    }
    // Counting sort: each bucket's end, then filled from there so that members come in order.
    for (size_t bucket = 1; bucket < first_.size(); ++bucket) first_[bucket] += first_[bucket - 1];
    for (int k = count - 1; k >= 0; --k) {
      const Point& point = points_[static_cast<size_t>(k)];
      if (point.finite) members_[static_cast<size_t>(--first_[bucket_of(point.cell)])] = k;
    }
  }

  std::vector<Point> points_;
  std::vector<int> first_;    ///< of each bucket among the members, and the end
  std::vector<int> members_;  ///< points by bucket, rising in each
};

}  // namespace clothfit
