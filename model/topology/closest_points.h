#pragma once

#include <Eigen/Core>
#include <array>

namespace clothfit {

/// Two parts of a surface that may meet: of four points, the first against the triangle of the
/// others, or the first two, an edge, against the edge of the last two.
struct PartPair {
  enum Kind { point_triangle, edge_edge } kind = point_triangle;
  std::array<int, 4> point{};
};
using FourPlaces = Eigen::Matrix<double, 3, 4>;

/// The shortest connection of two parts: to the first from the second.
struct Connection {
  /// Of the four points in the connection: those of the first part sum to 1, of the second to -1.
  Eigen::Vector4d weight;
  Eigen::Vector3d connection_m;  ///< places * weight
  double distance_m = 0;
};
Connection shortest_connection(PartPair::Kind kind, const FourPlaces& place_m);

/// How far two parts can go without meeting.
struct FreeWay {
  double share = 1;             ///< of the way, 0 to 1
  double least_distance_m = 0;  ///< they come no nearer on all of it
};

/// Returns the share of a straight move of the four points over which their distance keeps at
/// least the share `kept` (0 to 1) of what it is at first: additive continuous collision detection
/// [li2021]. Each advance is as long as the fastest points need to close the gap, once the move
/// that all share is taken out. It may stop before the distance has fallen so far.
FreeWay free_way(PartPair::Kind kind, const FourPlaces& place_m, const FourPlaces& move_m,
                 double kept);

}  // namespace clothfit
