#include "model/laboratory/shadow.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace clothfit {
namespace {

struct Interval {
  double from_m, to_m;
};

/// Returns the length that intervals cover together.
double covered_m(std::vector<Interval>& intervals) {
  std::ranges::sort(intervals, {}, &Interval::from_m);
  double length_m = 0, reached_m = -std::numeric_limits<double>::infinity();
  for (const Interval& interval : intervals) {
    if (interval.to_m <= reached_m) continue;
    length_m += interval.to_m - std::max(interval.from_m, reached_m);
    reached_m = interval.to_m;
  }
  return length_m;
}

}  // namespace

double shadow_area_m2(const Eigen::Matrix3Xd& position_m, const Eigen::Matrix3Xi& triangle,
                      double row_m) {
  const double low_m = position_m.row(1).minCoeff(), high_m = position_m.row(1).maxCoeff();
  const auto rows = static_cast<size_t>(std::ceil((high_m - low_m) / row_m));
  std::vector<std::vector<Interval>> intervals(rows);
  for (const auto& corners : triangle.colwise()) {
    Eigen::Matrix<double, 2, 3> at;
    for (int k = 0; k < 3; ++k) at.col(k) = position_m.col(corners[k]).head<2>();
    const auto first =
        static_cast<size_t>(std::max(0.0, std::ceil((at.row(1).minCoeff() - low_m) / row_m - 0.5)));
    for (size_t row = first; row < rows; ++row) {
      const double y = low_m + (static_cast<double>(row) + 0.5) * row_m;
      if (y > at.row(1).maxCoeff()) break;
      Interval interval{std::numeric_limits<double>::infinity(),
                        -std::numeric_limits<double>::infinity()};
      for (int k = 0; k < 3; ++k) {
        const Eigen::Vector2d a = at.col(k), b = at.col((k + 1) % 3);
        if ((a.y() <= y) == (b.y() <= y)) continue;
        const double x = a.x() + (y - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
        interval = {std::min(interval.from_m, x), std::max(interval.to_m, x)};
      }
      if (interval.from_m < interval.to_m) intervals[row].push_back(interval);
    }
  }
  double area_m2 = 0;
  for (std::vector<Interval>& row : intervals) area_m2 += row_m * covered_m(row);
  return area_m2;
}

}  // namespace clothfit
