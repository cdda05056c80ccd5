// Checks shortest connections and free ways of points, edges and triangles against samples.

#include "model/topology/closest_points.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace clothfit {
namespace {

class Random {
 public:
  double number() { return static_cast<double>(generator_()) / 0x1p31 - 1; }
  FourPlaces places() {
    FourPlaces places;
    for (double& x : places.reshaped()) x = number();
    return places;
  }

 private:
  std::mt19937 generator_{11};
};

constexpr std::array kKinds{PartPair::point_triangle, PartPair::edge_edge};

/// Returns the least distance of a fine sample of places of both parts.
double sampled_distance(PartPair::Kind kind, const FourPlaces& x) {
  constexpr int kParts = 200;
  double least = INFINITY;
  for (int i = 0; i <= kParts; ++i)
    for (int j = 0; j <= (kind == PartPair::edge_edge ? kParts : kParts - i); ++j) {
      const double a = i / double{kParts}, b = j / double{kParts};
      const Eigen::Vector4d weight = kind == PartPair::edge_edge
                                         ? Eigen::Vector4d(1 - a, a, b - 1, -b)
                                         : Eigen::Vector4d(1, a + b - 1, -a, -b);
      least = std::min(least, (x * weight).norm());
    }
  return least;
}

TEST(ClosestPoints, AreAsNearAsTheNearestOfASample) {
  Random random;
  for (const PartPair::Kind kind : kKinds)
    for (int n = 0; n < 40; ++n) {
      const FourPlaces places = random.places();
      const Connection found = shortest_connection(kind, places);
      const double sampled = sampled_distance(kind, places);
      EXPECT_LE(found.distance_m, sampled + 1e-12);
      EXPECT_GT(found.distance_m, sampled - 0.02);
      EXPECT_NEAR(found.weight.sum(), 0, 1e-12);
      EXPECT_LT((places * found.weight - found.connection_m).norm(), 1e-12);
      const int first = kind == PartPair::edge_edge ? 2 : 1;
      EXPECT_NEAR(found.weight.head(first).sum(), 1, 1e-12);
      EXPECT_GE(found.weight.head(first).minCoeff(), -1e-12);
      EXPECT_LE(found.weight.tail(4 - first).maxCoeff(), 1e-12);
    }
}

TEST(ClosestPoints, KnowPartsWithoutExtent) {
  FourPlaces places;
  places << 0, 1, 1, 1, 0, 0, 0, 0, 2, 0, 0, 0;
  for (const PartPair::Kind kind : kKinds)
    EXPECT_NEAR(shortest_connection(kind, places).distance_m,
                kind == PartPair::edge_edge ? 0 : std::sqrt(5), 1e-12);
}

TEST(FreeWay, KeepsTheShareOfTheDistanceAllAlong) {
  Random random;
  constexpr double kKept = 0.2;
  int shortened = 0;
  for (const PartPair::Kind kind : kKinds)
    for (int n = 0; n < 300; ++n) {
      const FourPlaces from = random.places(), move = random.places();
      const FreeWay way = free_way(kind, from, move, kKept);
      const double first = shortest_connection(kind, from).distance_m;
      shortened += way.share < 1;
      for (int k = 0; k <= 50; ++k)
        EXPECT_GE(shortest_connection(kind, from + k / 50.0 * way.share * move).distance_m,
                  kKept * first - 1e-12);
      for (int k = 0; k <= 50; ++k)
        EXPECT_GE(shortest_connection(kind, from + k / 50.0 * move).distance_m,
                  way.least_distance_m - 1e-12);
    }
  EXPECT_GT(shortened, 50);
}

TEST(FreeWay, GoesUpToTheTriangleAndFreelyBesideIt) {
  FourPlaces from, towards, together;
  from << 0.2, 0, 1, 0, 0.2, 0, 0, 1, 0.1, 0, 0, 0;
  towards << 0, 0, 0, 0, 0, 0, 0, 0, -1, 0, 0, 0;
  together << 3, 3, 3, 3, 0, 0, 0, 0, -5, -5, -5, -5;
  const double share = free_way(PartPair::point_triangle, from, towards, 0.2).share;
  EXPECT_LE(share, 0.08);  // of 0.1, a fifth stays
  EXPECT_GE(share, 0.07);
  EXPECT_EQ(free_way(PartPair::point_triangle, from, together, 0.2).share, 1);
  EXPECT_EQ(free_way(PartPair::point_triangle, from, -towards, 0.2).share, 1);
}

}  // namespace
}  // namespace clothfit
