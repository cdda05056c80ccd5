#include "model/topology/closest_points.h"

#include <algorithm>
#include <cmath>

namespace clothfit {
namespace {

/// Returns the share at which the line from `from` along `along` comes nearest to `place`, 0 to 1.
double nearest_share(const Eigen::Vector3d& place, const Eigen::Vector3d& from,
                     const Eigen::Vector3d& along) {
  const double squared = along.squaredNorm();
  return squared > 0 ? std::clamp((place - from).dot(along) / squared, 0.0, 1.0) : 0.0;
}

Connection connection_of(const FourPlaces& place_m, const Eigen::Vector4d& weight) {
  const Eigen::Vector3d connection_m = place_m * weight;
  return {weight, connection_m, connection_m.norm()};
}

/// Inside the triangle's prism the plane's foot is nearest, elsewhere a place of one of its sides.
Connection to_triangle(const FourPlaces& x) {
  const Eigen::Vector3d ab = x.col(2) - x.col(1), ac = x.col(3) - x.col(1),
                        ap = x.col(0) - x.col(1);
  const double bb = ab.squaredNorm(), cc = ac.squaredNorm(), bc = ab.dot(ac);
  const double determinant = bb * cc - bc * bc;
  if (determinant > 1e-14 * bb * cc) {
    const double b = (cc * ap.dot(ab) - bc * ap.dot(ac)) / determinant,
                 c = (bb * ap.dot(ac) - bc * ap.dot(ab)) / determinant;
    if (b >= 0 && c >= 0 && b + c <= 1) return connection_of(x, {1, b + c - 1, -b, -c});
  }
  Connection best{.weight = {}, .connection_m = {}, .distance_m = INFINITY};
  for (int side = 0; side < 3; ++side) {
    const int from = 1 + side, to = 1 + (side + 1) % 3;
    const double share = nearest_share(x.col(0), x.col(from), x.col(to) - x.col(from));
    Eigen::Vector4d weight{1, 0, 0, 0};
    weight[from] = share - 1;
    weight[to] = -share;
    const Connection found = connection_of(x, weight);
    if (found.distance_m < best.distance_m) best = found;
  }
  return best;
}

/// Where both lines come nearest inside both edges, that is the place; else it is at an end.
Connection between_edges(const FourPlaces& x) {
  const Eigen::Vector3d a = x.col(1) - x.col(0), b = x.col(3) - x.col(2), ab = x.col(0) - x.col(2);
  const double aa = a.squaredNorm(), bb = b.squaredNorm(), cross = a.dot(b);
  const double determinant = aa * bb - cross * cross;
  double s = 0;
  if (determinant > 1e-14 * aa * bb)
    s = std::clamp((cross * b.dot(ab) - bb * a.dot(ab)) / determinant, 0.0, 1.0);
  const double t = nearest_share(x.col(0) + s * a, x.col(2), b);
  s = nearest_share(x.col(2) + t * b, x.col(0), a);
  return connection_of(x, {1 - s, s, t - 1, -t});
}

}  // namespace

Connection shortest_connection(PartPair::Kind kind, const FourPlaces& place_m) {
  return kind == PartPair::point_triangle ? to_triangle(place_m) : between_edges(place_m);
}

FreeWay free_way(PartPair::Kind kind, const FourPlaces& place_m, const FourPlaces& move_m,
                 double kept) {
  const FourPlaces apart_m = move_m.colwise() - move_m.rowwise().mean();
  const Eigen::Vector4d way_m = apart_m.colwise().norm().transpose();
  const double fastest_m = kind == PartPair::point_triangle
                               ? way_m[0] + way_m.tail<3>().maxCoeff()
                               : way_m.head<2>().maxCoeff() + way_m.tail<2>().maxCoeff();
  const double first_m = shortest_connection(kind, place_m).distance_m;
  FreeWay free{.share = 1, .least_distance_m = std::max(first_m - fastest_m, 0.0)};
  if (fastest_m <= (1 - kept) * first_m) return free;
  // An advance keeps this share of what is above the least distance; the search ends a little
  // above it.
  constexpr double kReserve = 0.1;
  constexpr int kMostAdvances = 50;
  double distance_m = first_m;
  free.share = 0;
  for (int n = 0; n < kMostAdvances; ++n) {
    const double above_m = distance_m - kept * first_m;
    if (above_m <= kReserve * (1 - kept) * first_m) break;
    free.share += (1 - kReserve) * above_m / fastest_m;
    if (free.share >= 1) break;
    distance_m = shortest_connection(kind, place_m + free.share * apart_m).distance_m;
  }
  free.share = std::min(free.share, 1.0);
  return free;
}

}  // namespace clothfit
