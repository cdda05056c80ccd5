#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "model/effects/number.h"

namespace clothfit {

/// Finds points that are near each other by cells as wide as the distance, kept in a hash table.
/// Holds its memory between calls, so that nothing is allocated once it has seen as many points.
class NearPairs {
 public:
  /// Calls `visit(a, b, vector from a to b, squared distance)` once for every pair closer than
  /// `distance_m` > 0. There are `count` points; those that are not finite have no pairs. The order
  /// of the calls depends on the positions alone.
  template <class Positions, class Visit>
  void for_pairs(int count, const Positions& position_m, double distance_m, const Visit& visit) {
    sort_into_cells(count, position_m, distance_m);
    const double square_m2 = distance_m * distance_m;
    for (int a = 0; a < count; ++a) {
      const Point& from = points_[static_cast<size_t>(a)];
      if (!from.finite) continue;
      // Visited are the own cell and, of the 26 around it, the half that comes after: the others
      // see this one.
      for (size_t c = 0; c < kCells.size(); ++c) {
        const size_t bucket = bucket_of(from.hash + step_hash_[c]);
        for (int n = first_[bucket]; n < first_[bucket + 1]; ++n) {
          const int b = members_[static_cast<size_t>(n)];
          const Point& to = points_[static_cast<size_t>(b)];
          // Other cells share the bucket. In its own cell each point sees those after it.
          const Cell& step = kCells[c];
          if (to.cell[0] - from.cell[0] != step[0] || to.cell[1] - from.cell[1] != step[1] ||
              to.cell[2] - from.cell[2] != step[2] || (c == 0 && b <= a))
            continue;
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
    std::uint64_t hash;
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

  /// Hashes by a sum, so that a neighbouring cell's hash is the own one's plus that of the step
  /// there. The factors are odd, so that neighbouring cells fall into different buckets.
  static constexpr std::uint64_t hash_of(const Cell& cell) {
    return static_cast<std::uint64_t>(cell[0]) * 0x9E3779B97F4A7C15u +
           static_cast<std::uint64_t>(cell[1]) * 0xC2B2AE3D27D4EB4Fu +
           static_cast<std::uint64_t>(cell[2]) * 0x165667B19E3779F9u;
  }
  size_t bucket_of(std::uint64_t hash) const { return static_cast<size_t>(hash >> shift_); }

  template <class Positions>
  void sort_into_cells(int count, const Positions& position_m, double distance_m) {
    size_t buckets = 2;
    shift_ = 63;
    for (; buckets < static_cast<size_t>(2 * count); buckets *= 2) --shift_;
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
      point.hash = hash_of(point.cell);
      ++first_[bucket_of(point.hash)];
    }
    // This is a counting sort: each bucket's end comes first, then members are filled in from
    // there, in order.
    for (size_t bucket = 1; bucket < first_.size(); ++bucket) first_[bucket] += first_[bucket - 1];
    for (int k = count - 1; k >= 0; --k) {
      const Point& point = points_[static_cast<size_t>(k)];
      if (point.finite) members_[static_cast<size_t>(--first_[bucket_of(point.hash)])] = k;
    }
  }

  const std::array<std::uint64_t, kCells.size()> step_hash_ = [] {
    std::array<std::uint64_t, kCells.size()> hashes;
    for (size_t c = 0; c < kCells.size(); ++c) hashes[c] = hash_of(kCells[c]);
    return hashes;
  }();
  int shift_ = 63;  ///< leaves as many of a hash's upper bits as number the buckets
  std::vector<Point> points_;
  std::vector<int> first_;    ///< of each bucket among the members, and the end
  std::vector<int> members_;  ///< points by bucket, rising in each
};

}  // namespace clothfit
