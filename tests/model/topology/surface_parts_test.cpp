// Checks that near parts and crossings of a surface with itself are all found.

#include "model/topology/surface_parts.h"

#include <gtest/gtest.h>

#include <numeric>
#include <random>
#include <set>

namespace clothfit {
namespace {

/// Two sheets of n x n squares, each cut in two, of one metre.
struct TwoSheets {
  Eigen::Matrix3Xi triangle;
  Eigen::Matrix3Xd flat_m, centre_m;

  explicit TwoSheets(int n) {
    const int side = n + 1, points = side * side;
    flat_m.resize(3, 2 * points);
    std::vector<Eigen::Vector3i> all;
    for (int sheet = 0; sheet < 2; ++sheet)
      for (int i = 0; i <= n; ++i)
        for (int j = 0; j <= n; ++j) {
          const int v = sheet * points + i * side + j;
          flat_m.col(v) << j / double(n) + 2 * sheet, i / double(n), 0;
          if (i == n || j == n) continue;
          all.emplace_back(v, v + 1, v + side);
          all.emplace_back(v + 1, v + side + 1, v + side);
        }
    triangle.resize(3, static_cast<Eigen::Index>(all.size()));
    centre_m.resize(3, triangle.cols());
    for (size_t t = 0; t < all.size(); ++t) {
      triangle.col(static_cast<Eigen::Index>(t)) = all[t];
      centre_m.col(static_cast<Eigen::Index>(t)) = flat_m(Eigen::all, all[t]).rowwise().mean();
    }
  }
  Eigen::Index points_of_one() const { return flat_m.cols() / 2; }
  SurfaceParts parts() const {
    std::vector<int> apart(static_cast<size_t>(flat_m.cols()));
    std::iota(apart.begin(), apart.end(), 0);
    return {triangle, centre_m, apart};
  }
};

using Key = std::pair<int, std::array<int, 4>>;

TEST(SurfaceParts, FindAllThatComeNear) {
  const TwoSheets sheets(4);
  SurfaceParts parts = sheets.parts();
  std::mt19937 random(4);
  const auto scattered = [&](double by_m) {
    Eigen::Matrix3Xd offset(3, sheets.flat_m.cols());
    for (double& x : offset.reshaped()) x = by_m * (static_cast<double>(random()) / 0x1p31 - 1);
    return offset;
  };
  Eigen::Matrix3Xd from = sheets.flat_m + scattered(0.2);
  from.row(0).tail(sheets.points_of_one()).array() -= 2;  // one upon the other
  const Eigen::Matrix3Xd move = scattered(0.1);
  constexpr double kReach_m = 0.05;
  std::set<Key> found;
  for (const PartPair& pair : parts.near(from, move, kReach_m))
    EXPECT_TRUE(found.insert({pair.kind, pair.point}).second) << "once each";

  size_t near = 0;
  const auto expect = [&](PartPair pair) {
    for (size_t a = 0; a < 4; ++a)
      for (size_t b = 0; b < a; ++b)
        if (pair.point[a] == pair.point[b]) return;
    FourPlaces places, moves;
    for (size_t k = 0; k < 4; ++k) {
      places.col(static_cast<Eigen::Index>(k)) = from.col(pair.point[k]);
      moves.col(static_cast<Eigen::Index>(k)) = move.col(pair.point[k]);
    }
    double least = INFINITY;
    for (const double t : {0.0, 0.25, 0.5, 0.75, 1.0})
      least = std::min(least, shortest_connection(pair.kind, places + t * moves).distance_m);
    if (least > kReach_m) return;
    ++near;
    Key turned{pair.kind, {pair.point[2], pair.point[3], pair.point[0], pair.point[1]}};
    EXPECT_TRUE(found.contains({pair.kind, pair.point}) ||
                (pair.kind == PartPair::edge_edge && found.contains(turned)));
  };
  for (int p = 0; p < from.cols(); ++p)
    for (const auto& [i, j, k] : parts.triangles())
      expect({PartPair::point_triangle, {p, i, j, k}});
  for (size_t e = 0; e < parts.edges().size(); ++e)
    for (size_t f = 0; f < e; ++f) {
      const auto &one = parts.edges()[e], &other = parts.edges()[f];
      expect({PartPair::edge_edge, {one[0], one[1], other[0], other[1]}});
    }
  EXPECT_GT(near, 150U);
}

TEST(SurfaceParts, CountCrossingsExactly) {
  const TwoSheets sheets(1);
  SurfaceParts parts = sheets.parts();
  Eigen::Matrix3Xd position = sheets.flat_m;
  // The second square stands upright on the first one's middle, and goes down through it.
  const auto stand = [&](double lowest_m) {
    position.rightCols<4>() << 0.2, 0.4, 0.2, 0.4, 0.3, 0.3, 0.3, 0.3, lowest_m, lowest_m, 1, 1;
  };
  stand(-0.5);
  EXPECT_EQ(parts.crossings(position), 3) << "two sides and the diagonal";
  stand(0.5);
  EXPECT_EQ(parts.crossings(position), 0);
  stand(0);
  EXPECT_EQ(parts.crossings(position), 0) << "it touches";
  stand(-1e-300);
  EXPECT_EQ(parts.crossings(position), 3) << "below rounding";
  stand(1e-300);
  EXPECT_EQ(parts.crossings(position), 0);
}

TEST(SurfaceParts, LeaveOutWhatIsJoined) {
  const TwoSheets sheets(1);
  std::vector<int> joined(8);
  std::iota(joined.begin(), joined.end(), 0);
  for (int v = 0; v < 4; ++v) joined[static_cast<size_t>(v + 4)] = v;
  SurfaceParts parts(sheets.triangle, sheets.centre_m, joined);
  Eigen::Matrix3Xd position = sheets.flat_m;
  position.row(0).tail<4>().array() -= 2;
  for (const PartPair& pair : parts.near(position, 0 * position, 0.1)) {
    const size_t second = pair.kind == PartPair::point_triangle ? 1 : 2;
    for (size_t a = 0; a < second; ++a)
      for (size_t b = second; b < 4; ++b)
        EXPECT_NE(joined[static_cast<size_t>(pair.point[a])],
                  joined[static_cast<size_t>(pair.point[b])]);
  }
  EXPECT_EQ(parts.crossings(position), 0);
}

}  // namespace
}  // namespace clothfit
