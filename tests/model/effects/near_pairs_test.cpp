// Checks the search for points that are near each other.

#include "model/effects/near_pairs.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/model/random_cloth.h"

namespace clothfit {
namespace {

using Pairs = std::set<std::pair<int, int>>;

TEST(NearPairs, AreAllThatTryingEveryTwoFindsEachOnce) {
  NearPairs search;
  for (const unsigned seed : {1u, 2u, 3u}) {
    SCOPED_TRACE(seed);
    Uniform uniform(seed);
    const int count = seed == 2 ? 150 : 300;  // memory that a larger search has left does no harm
    const Eigen::Matrix3Xd points = uniform.vectors(count, 1);
    const auto at = [&](int k) -> Vector3<double> {
      return {points(0, k), points(1, k), points(2, k)};
    };
    for (const double distance : {0.1, 0.3, 5.0}) {
      Pairs expected;
      for (int a = 0; a < count; ++a)
        for (int b = a + 1; b < count; ++b)
          if ((points.col(a) - points.col(b)).norm() < distance) expected.insert({a, b});

      Pairs found;
      int calls = 0;
      search.for_pairs(count, at, distance,
                       [&](int a, int b, const Vector3<double>& connection, double square) {
                         found.insert(std::minmax(a, b));
                         ++calls;
                         EXPECT_EQ(connection.x, points(0, b) - points(0, a));
                         EXPECT_EQ(square, dot(connection, connection));
                       });

      EXPECT_GT(expected.size(), 0u);
      EXPECT_EQ(found, expected);
      EXPECT_EQ(calls, static_cast<int>(expected.size()));
    }
  }
}

TEST(NearPairs, LeavesOutWhatIsNotFinite) {
  const std::vector<Vector3<double>> points = {{0, 0, 0},        {NAN, 0, 0},   {0.1, 0, 0},
                                               {0, INFINITY, 0}, {1e300, 0, 0}, {1e300, 0, 0}};
  Pairs found;
  NearPairs().for_pairs(
      6, [&](int k) { return points[static_cast<size_t>(k)]; }, 0.5,
      [&](int a, int b, const Vector3<double>&, double) {
        found.insert({a, b});
      });

  EXPECT_EQ(found, (Pairs{{0, 2}}));
}

}  // namespace
}  // namespace clothfit
