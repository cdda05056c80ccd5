#include "fit/observe/cloud_errors.h"

#include <boost/geometry.hpp>
#include <boost/geometry/geometries/point.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <vector>

#include "fit/jobs/draws.h"
#include "model/topology/surface.h"

namespace clothfit {
namespace {

namespace geometry = boost::geometry;
using Point = geometry::model::point<double, 3, geometry::cs::cartesian>;
using Tree = geometry::index::rtree<Point, geometry::index::linear<8>>;

std::vector<Point> points_of(const Eigen::Matrix3Xd& position_m) {
  std::vector<Point> points;
  points.reserve(static_cast<size_t>(position_m.cols()));
  for (const auto& column : position_m.colwise())
    points.emplace_back(column.x(), column.y(), column.z());
  return points;
}

double mean_square_to_nearest(const std::vector<Point>& from, const Tree& to) {
  double sum = 0;
  for (const Point& point : from) {
    const auto nearest = to.qbegin(geometry::index::nearest(point, 1));
    sum += geometry::comparable_distance(point, *nearest);
  }
  return sum / static_cast<double>(from.size());
}

/// The mean over frames; 0 for none.
struct Mean {
  double sum = 0;
  int count = 0;
  void add(double value) {
    sum += value;
    ++count;
  }
  CloudErrors::Summary summary() const {
    return {.chamfer_m2 = count > 0 ? sum / count : 0, .frames = count};
  }
};

}  // namespace

double mean_square_to_nearest_m2(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to) {
  return mean_square_to_nearest(points_of(from), Tree(points_of(to)));
}

double chamfer_distance_m2(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) {
  const std::vector<Point> first = points_of(a), second = points_of(b);
  return mean_square_to_nearest(first, Tree(second)) + mean_square_to_nearest(second, Tree(first));
}

CloudErrors cloud_errors(const PointClouds& clouds, const Mesh& mesh,
                         std::span<const Eigen::Matrix3Xd> position_m, int first_held_out) {
  constexpr int kSeries = 0xc10d;
  Mean fitted, held_out, all;
  for (const auto& [frame, cloud_m] : clouds) {
    if (frame >= static_cast<int>(position_m.size())) continue;
    Draws draws(0, kSeries, frame);
    Eigen::Matrix2Xd places_m(2, cloud_m.cols());
    for (auto place : places_m.colwise())
      place << mesh.width_m * draws.uniform(), mesh.height_m * draws.uniform();
    const Surface surface =
        make_surface(mesh.columns, mesh.rows, mesh.width_m, mesh.height_m, places_m);
    const double distance_m2 =
        chamfer_distance_m2(cloud_m, surface.evaluate(position_m[static_cast<size_t>(frame)]));
    (frame < first_held_out ? fitted : held_out).add(distance_m2);
    all.add(distance_m2);
  }
  return {.fitted = fitted.summary(), .held_out = held_out.summary(), .all = all.summary()};
}

}  // namespace clothfit
