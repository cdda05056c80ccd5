#include "calib/placement/tag_squares.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <map>

namespace clothfit {
namespace {

/// Fits the best square through four surveyed points, in whatever order they come.
TagSquare fit_square(const std::vector<PlacedPixel>& reference,
                     const std::array<size_t, 4>& points) {
  TagSquare best;
  best.misfit2_m2 = std::numeric_limits<double>::infinity();
  constexpr std::array<std::array<size_t, 4>, 3> kRounds{
      {{0, 1, 2, 3}, {0, 1, 3, 2}, {0, 2, 1, 3}}};
  for (const auto& round : kRounds) {
    TagSquare square;
    Eigen::Matrix3Xd unit(3, 4), surveyed(3, 4);
    for (size_t k = 0; k < 4; ++k) {
      square.corners[k] = points[round[k]];
      unit.col(static_cast<Eigen::Index>(k)) = unit_square_corner(k);
      surveyed.col(static_cast<Eigen::Index>(k)) = reference[square.corners[k]].point_m;
    }
    // Turning and scaling separate: the best scale for the best rotation is a projection.
    square.world_from_square = fit_rigid(unit, surveyed);
    const Eigen::Matrix3Xd turned = square.world_from_square.rotation.toRotationMatrix() * unit;
    const Eigen::Matrix3Xd centred = surveyed.colwise() - surveyed.rowwise().mean();
    square.side_m = turned.cwiseProduct(centred).sum() / turned.squaredNorm();
    square.misfit2_m2 = (centred - square.side_m * turned).squaredNorm();
    if (square.misfit2_m2 < best.misfit2_m2) best = square;
  }
  return best;
}

}  // namespace

Eigen::Vector3d unit_square_corner(size_t k) {
  static const std::array<Eigen::Vector3d, 4> corners{
      Eigen::Vector3d(-0.5, -0.5, 0), Eigen::Vector3d(0.5, -0.5, 0), Eigen::Vector3d(0.5, 0.5, 0),
      Eigen::Vector3d(-0.5, 0.5, 0)};
  return corners[k];
}

std::vector<TagSquare> find_tag_squares(const std::vector<PlacedPixel>& reference,
                                        std::vector<double>& common_sides_m) {
  constexpr double kLargestMisfit = 0.15;  // of the side, rms per corner: not a square
  std::map<int, std::vector<size_t>> groups;
  for (size_t i = 0; i < reference.size(); ++i)
    if (reference[i].group >= 0) groups[reference[i].group].push_back(i);
  std::vector<TagSquare> squares;
  for (const auto& [group, points] : groups) {
    if (points.size() != 4) continue;
    const TagSquare square = fit_square(reference, {points[0], points[1], points[2], points[3]});
    if (square.side_m > 0 && std::sqrt(square.misfit2_m2 / 4) < kLargestMisfit * square.side_m)
      squares.push_back(square);
  }
  // 12 coordinates less 7 of the square; the side of one square has the survey's sigma / sqrt 2.
  double misfit2_m2 = 0;
  for (const auto& square : squares) misfit2_m2 += square.misfit2_m2;
  const double survey_sigma_m =
      std::sqrt(misfit2_m2 / std::max(5.0 * static_cast<double>(squares.size()), 1.0));
  const double gap_m = 4 * survey_sigma_m + 1e-6;
  std::vector<TagSquare*> by_side;
  for (auto& square : squares) by_side.push_back(&square);
  std::sort(by_side.begin(), by_side.end(),
            [](const TagSquare* a, const TagSquare* b) { return a->side_m < b->side_m; });
  std::vector<double> members;
  for (size_t i = 0; i < by_side.size(); ++i) {
    if (i == 0 || by_side[i]->side_m - by_side[i - 1]->side_m > gap_m) {
      common_sides_m.push_back(0);
      members.push_back(0);
    }
    by_side[i]->alike = common_sides_m.size() - 1;
    members.back() += 1;
    common_sides_m.back() += (by_side[i]->side_m - common_sides_m.back()) / members.back();
  }
  return squares;
}

}  // namespace clothfit
