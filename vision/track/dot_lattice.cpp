#include "vision/track/dot_lattice.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace clothfit {
namespace {

/// A lattice without names: sites one apart, columns to the right and rows down in some turn.
DotLayout blank_lattice(int half) {
  DotLayout lattice;
  lattice.spacing_m = 1;
  lattice.sizes_known = false;
  const int side = 2 * half + 1;
  for (int row = 0; row < side; ++row)
    for (int column = 0; column < side; ++column) {
      DotSite site{.marker = row * side + column,
                   .place_m = Eigen::Vector2d(column, row),
                   .is_dot = true,
                   .size = 1,
                   .neighbours = {}};
      constexpr int kReach = 2;
      std::vector<std::pair<double, int>> near;
      for (int r = std::max(row - kReach, 0); r <= std::min(row + kReach, side - 1); ++r)
        for (int c = std::max(column - kReach, 0); c <= std::min(column + kReach, side - 1); ++c)
          if (r != row || c != column)
            near.emplace_back(std::hypot(r - row, c - column), r * side + c);
      std::sort(near.begin(), near.end());
      for (const auto& [distance, index] : near) site.neighbours.push_back(index);
      lattice.sites.push_back(std::move(site));
    }
  return lattice;
}

/// The four dots around one, to the right, down, left and up in some turn.
struct Cross {
  std::array<size_t, 4> arm{};
  double evenness =
      0;  ///< 0: opposite arms are equal and the two pairs upright in the dot's metric
};

/// Finds the cross of a dot: of its nearest dots, in the metric of its own outline, four that lie
/// opposite each other. Nothing where the outline and the places do not fit a lattice.
std::optional<Cross> cross_around(const std::vector<Dot>& dots, size_t middle) {
  const Eigen::Matrix2d metric = dots[middle].outline.shape_px2.inverse();
  const Eigen::Vector2d& centre = dots[middle].outline.centre_px;
  std::vector<std::pair<double, size_t>> near;
  for (size_t i = 0; i < dots.size(); ++i) {
    const Eigen::Vector2d from = dots[i].outline.centre_px - centre;
    if (i != middle) near.emplace_back(from.dot(metric * from), i);
  }
  constexpr size_t kArms = 4;
  if (near.size() < kArms) return std::nullopt;
  std::partial_sort(near.begin(), near.begin() + kArms, near.end());
  std::array<Eigen::Vector2d, kArms> way;
  for (size_t k = 0; k < kArms; ++k) way[k] = dots[near[k].second].outline.centre_px - centre;
  const auto turn = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() * b.y() - a.y() * b.x();
  };
  // The arm opposite the first is the one that cancels it best.
  size_t opposite = 1;
  for (size_t k = 2; k < kArms; ++k)
    if ((way[0] + way[k]).squaredNorm() < (way[0] + way[opposite]).squaredNorm()) opposite = k;
  std::array<size_t, 2> sides{};
  for (size_t k = 1, count = 0; k < kArms; ++k)
    if (k != opposite) sides[count++] = k;
  if (turn(way[0], way[sides[0]]) < 0) std::swap(sides[0], sides[1]);
  const double length = way[0].norm() + way[opposite].norm();
  const double width = way[sides[0]].norm() + way[sides[1]].norm();
  Cross cross{
      .arm = {near[0].second, near[sides[0]].second, near[opposite].second, near[sides[1]].second}};
  const Eigen::Vector2d x = way[0] - way[opposite], y = way[sides[0]] - way[sides[1]];
  cross.evenness = (way[0] + way[opposite]).norm() / length +
                   (way[sides[0]] + way[sides[1]]).norm() / width +
                   std::abs(x.dot(metric * y)) / std::sqrt(x.dot(metric * x) * y.dot(metric * y)) +
                   std::abs(std::log(x.dot(metric * x) / y.dot(metric * y)));
  return cross;
}

/// Dots on the lattice, grown from the cross of one.
PlacedDots grow_lattice(const DotLayout& lattice, int half, const std::vector<Dot>& dots,
                        size_t middle, const Cross& cross) {
  PlacedDots placed(lattice.sites.size());
  const int side = 2 * half + 1;
  const auto site = [&](int row, int column) { return (half + row) * side + half + column; };
  placed.place(site(0, 0), dots[middle]);
  placed.place(site(0, 1), dots[cross.arm[0]]);
  placed.place(site(1, 0), dots[cross.arm[1]]);
  placed.place(site(0, -1), dots[cross.arm[2]]);
  placed.place(site(-1, 0), dots[cross.arm[3]]);
  std::vector<Dot> others;
  for (size_t i = 0; i < dots.size(); ++i)
    if (i != middle && std::ranges::find(cross.arm, i) == cross.arm.end())
      others.push_back(dots[i]);
  grow_identities(lattice, others, placed);
  leave_out_conflicts(lattice, placed);
  return placed;
}

/// Reads the symbol of every placed dot by its area over that of a lattice cell; -1 where unread.
std::vector<int> read_symbols(const DotLayout& lattice, const PlacedDots& placed) {
  std::vector<int> symbols(lattice.sites.size(), -1);
  for (size_t i = 0; i < symbols.size(); ++i) {
    if (!placed.dots[i]) continue;
    const LocalMap map = fit_local_map(lattice, static_cast<int>(i), placed.places, true);
    constexpr double kSure = 0.1;
    if (map.neighbours < 4 || map.sigma > kSure) continue;
    const double cell = std::abs(map.jacobian_px.determinant());
    symbols[i] = nearest_dot_symbol(std::sqrt(placed.dots[i]->outline.area_px2() / (M_PI * cell)));
  }
  return symbols;
}

/// How a lattice lies on a pattern: the pattern's place of lattice site (0, 0), its top left.
struct LatticePose {
  int quarter_turns = 0;
  bool mirrored = false;
  int row = 0, column = 0;

  auto operator<=>(const LatticePose&) const = default;

  /// The pattern's (row, column) of a lattice site.
  std::pair<int, int> of(int lattice_row, int lattice_column) const {
    int r = lattice_row, c = lattice_column;
    if (mirrored) c = -c;
    for (int turn = 0; turn < quarter_turns; ++turn) {
      const int before = r;
      r = c;
      c = -before;
    }
    return {row + r, column + c};
  }
};

/// Every full neighbourhood's vote.
std::map<LatticePose, int> collect_votes(const std::vector<int>& symbols, int rows, int columns,
                                         const DotPatternIndex& index) {
  std::map<LatticePose, int> votes;
  for (int row = 1; row + 1 < rows; ++row)
    for (int column = 1; column + 1 < columns; ++column) {
      DotNeighbourhood around{};
      for (int i = 0; i < 9; ++i)
        around[static_cast<size_t>(i)] =
            symbols[static_cast<size_t>((row - 1 + i / 3) * columns + column - 1 + i % 3)];
      const std::optional<DotPatternPlace> place = index.find(around);
      if (!place) continue;
      LatticePose pose{.quarter_turns = place->quarter_turns, .mirrored = place->mirrored};
      const auto [r, c] = pose.of(row, column);
      pose.row = place->row - r;
      pose.column = place->column - c;
      ++votes[pose];
    }
  return votes;
}

/// Returns the pose that nearly all of enough neighbourhoods agree on.
std::optional<LatticePose> agreed_pose(const std::map<LatticePose, int>& votes) {
  int all = 0;
  auto most = votes.end();
  for (auto it = votes.begin(); it != votes.end(); ++it) {
    all += it->second;
    if (most == votes.end() || it->second > most->second) most = it;
  }
  constexpr int kFewest = 3;
  if (most == votes.end() || most->second < kFewest || 10 * most->second < 9 * all)
    return std::nullopt;
  return most->first;
}

/// A dot to grow a lattice from.
struct LatticeSeed {
  size_t middle = 0;
  Cross cross;
};

/// Returns the dots whose neighbours make the evenest crosses.
std::vector<LatticeSeed> lattice_seeds(const std::vector<Dot>& found) {
  std::vector<LatticeSeed> seeds;
  for (size_t i = 0; i < found.size(); ++i)
    if (const std::optional<Cross> cross = cross_around(found, i)) seeds.push_back({i, *cross});
  std::ranges::sort(seeds, {}, [](const LatticeSeed& seed) {
    return std::pair(seed.cross.evenness, seed.middle);
  });
  constexpr size_t kMostSeeds = 12;
  if (seeds.size() > kMostSeeds) seeds.resize(kMostSeeds);
  return seeds;
}

/// Returns the part of a lattice that its dots reach over.
SeenLattice cropped(const DotLayout& lattice, int side, const PlacedDots& placed) {
  int top = side, left = side, bottom = -1, right = -1;
  for (int i = 0; i < side * side; ++i) {
    if (!placed.dots[static_cast<size_t>(i)]) continue;
    top = std::min(top, i / side);
    bottom = std::max(bottom, i / side);
    left = std::min(left, i % side);
    right = std::max(right, i % side);
  }
  SeenLattice seen;
  if (bottom < 0) return seen;
  const std::vector<int> symbols = read_symbols(lattice, placed);
  seen.columns = right - left + 1;
  seen.rows = bottom - top + 1;
  seen.count = placed.count();
  for (int row = top; row <= bottom; ++row)
    for (int column = left; column <= right; ++column) {
      seen.dots.push_back(placed.dots[static_cast<size_t>(row * side + column)]);
      seen.symbols.push_back(symbols[static_cast<size_t>(row * side + column)]);
    }
  return seen;
}

}  // namespace

bool name_by_pattern(const DotLayout& layout, const DotPattern& pattern,
                     const DotPatternIndex& index, const std::vector<Dot>& found,
                     PlacedDots& placed) {
  const int half = std::max(pattern.columns, pattern.rows);
  const int side = 2 * half + 1;
  const DotLayout lattice = blank_lattice(half);
  for (const LatticeSeed& seed : lattice_seeds(found)) {
    const PlacedDots grown = grow_lattice(lattice, half, found, seed.middle, seed.cross);
    const std::optional<LatticePose> pose =
        agreed_pose(collect_votes(read_symbols(lattice, grown), side, side, index));
    if (!pose) continue;

    std::map<std::pair<int, int>, int> site_at;
    Eigen::Vector2d low = layout.sites[0].place_m;
    for (const DotSite& site : layout.sites) low = low.cwiseMin(site.place_m);
    for (size_t i = 0; i < layout.sites.size(); ++i) {
      const Eigen::Vector2d at = (layout.sites[i].place_m - low) / layout.spacing_m;
      site_at[{static_cast<int>(std::lround(at.y())), static_cast<int>(std::lround(at.x()))}] =
          static_cast<int>(i);
    }
    for (int i = 0; i < side * side; ++i) {
      if (!grown.dots[static_cast<size_t>(i)]) continue;
      const auto at = site_at.find(pose->of(i / side, i % side));
      if (at != site_at.end()) placed.place(at->second, *grown.dots[static_cast<size_t>(i)]);
    }
    return true;
  }
  return false;
}

std::optional<SeenLattice> find_lattice(const std::vector<Dot>& found) {
  // n dots reach over n columns at most; a larger half only takes time.
  const int half = std::min(kMostPatternDots, static_cast<int>(found.size()));
  const int side = 2 * half + 1;
  const DotLayout lattice = blank_lattice(half);
  std::optional<SeenLattice> best;
  for (const LatticeSeed& seed : lattice_seeds(found)) {
    SeenLattice seen =
        cropped(lattice, side, grow_lattice(lattice, half, found, seed.middle, seed.cross));
    if (!best || seen.count > best->count) best = std::move(seen);
    if (2 * static_cast<size_t>(best->count) > found.size()) break;
  }
  if (best && best->count == 0) best.reset();
  return best;
}

std::optional<std::vector<std::pair<int, int>>> places_in_pattern(const SeenLattice& lattice,
                                                                  const DotPatternIndex& index) {
  const std::optional<LatticePose> pose =
      agreed_pose(collect_votes(lattice.symbols, lattice.rows, lattice.columns, index));
  if (!pose) return std::nullopt;
  std::vector<std::pair<int, int>> places;
  for (int row = 0; row < lattice.rows; ++row)
    for (int column = 0; column < lattice.columns; ++column)
      places.push_back(pose->of(row, column));
  return places;
}

}  // namespace clothfit
