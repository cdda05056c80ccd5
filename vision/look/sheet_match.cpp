#include "vision/look/sheet_match.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

namespace clothfit {
namespace {

/// Corners of tags, on the sheet or in a picture.
using TagCorners = std::map<int, std::array<Eigen::Vector2d, 4>>;

TagCorners corners_on_sheet(const MarkerSet& sheet) {
  TagCorners corners;
  for (const Marker& marker : sheet.markers)
    if (marker.tag && marker.corner)
      corners[*marker.tag].at(static_cast<size_t>(*marker.corner)) = {marker.s_m, marker.t_m};
  return corners;
}

/// Returns the place of a tag's centre in the axes of another: along its lower side, up its left
/// side, in their lengths.
Eigen::Vector2d place_by(const std::array<Eigen::Vector2d, 4>& axes,
                         const std::array<Eigen::Vector2d, 4>& tag) {
  const auto middle = [](const auto& c) {
    return Eigen::Vector2d((c[0] + c[1] + c[2] + c[3]) / 4);
  };
  Eigen::Matrix2d sides;
  sides << (axes[1] + axes[2] - axes[0] - axes[3]) / 2, (axes[3] + axes[2] - axes[0] - axes[1]) / 2;
  return sides.partialPivLu().solve(middle(tag) - middle(axes));
}

/// Returns for each tag those that are nearest to it on the sheet, up to a fifth farther.
std::map<int, std::vector<int>> nearest_tags(const TagCorners& sheet) {
  constexpr double kAlike = 1.2;
  std::map<int, std::vector<int>> nearest;
  for (const auto& [id, corners] : sheet) {
    std::vector<std::pair<double, int>> distances;
    for (const auto& [other, others] : sheet)
      if (other != id) distances.emplace_back((others[0] - corners[0]).norm(), other);
    if (distances.empty()) continue;
    const double limit = kAlike * std::ranges::min(distances).first;
    for (const auto& [distance, other] : distances)
      if (distance <= limit) nearest[id].push_back(other);
  }
  return nearest;
}

/// Counts the tags of a picture whose neighbours lie elsewhere than on the sheet.
void count_misplaced(const SeenPicture& picture, const std::string& family, const TagCorners& sheet,
                     const std::map<int, std::vector<int>>& nearest, SheetMatch& match) {
  // A fold, or another depth, moves a neighbour by less than this share of its distance.
  constexpr double kElsewhere = 0.6;
  TagCorners seen;
  for (const SeenTag& tag : picture.tags)
    if (tag.family == family && tag.reading.good() && sheet.contains(tag.reading.tag.id))
      seen[tag.reading.tag.id] = tag.reading.tag.corner_px;
  for (const auto& [id, corners] : seen) {
    const auto neighbours = nearest.find(id);
    if (neighbours == nearest.end()) continue;
    for (const int other : neighbours->second) {
      if (!seen.contains(other)) continue;
      const Eigen::Vector2d expected = place_by(sheet.at(id), sheet.at(other)),
                            found = place_by(corners, seen.at(other));
      ++match.pairs;
      if (!((found - expected).norm() <= kElsewhere * expected.norm())) ++match.misplaced;
    }
  }
}

}  // namespace

bool SheetMatch::is_another() const {
  constexpr int kFewest = 8;
  constexpr double kMisplaced = 0.3;
  const auto others_seen = static_cast<int>(others.size());
  return (pairs >= kFewest && misplaced > kMisplaced * pairs) ||
         (2 * shown < listed && others_seen > shown);
}

SheetMatch match_sheet(const LookResult& seen, const MarkerSet& sheet) {
  SheetMatch match;
  const TagCorners on_sheet = corners_on_sheet(sheet);
  const std::map<int, std::vector<int>> nearest = nearest_tags(on_sheet);
  const bool of_dots = sheet.kind == MarkerKind::dots;
  match.listed = of_dots ? static_cast<int>(std::ranges::count_if(
                               sheet.markers, [](const Marker& one) { return !one.tag; }))
                         : static_cast<int>(on_sheet.size());
  std::set<int> shown;
  for (const SeenPicture& picture : seen.pictures) {
    for (const SeenMarker& dot : picture.markers) shown.insert(dot.marker);
    for (const SeenTag& tag : picture.tags) {
      if (tag.family != sheet.family || !tag.reading.good()) continue;
      const int id = tag.reading.tag.id;
      if (!on_sheet.contains(id))
        match.others.insert(id);
      else if (!of_dots)
        shown.insert(id);
    }
    if (!of_dots) count_misplaced(picture, sheet.family, on_sheet, nearest, match);
  }
  match.shown = static_cast<int>(shown.size());
  return match;
}

}  // namespace clothfit
