#include "vision/look/seen_motion.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/calib3d.hpp>
#include <vector>

#include "data/median.h"

namespace clothfit {
namespace {

/// Centres by tag, or dots by marker.
using Centres = std::map<int, Eigen::Vector2d>;

/// Returns where tags or dots lie on the cloth.
Centres places_on_cloth(const MarkerSet& markers) {
  Centres places;
  std::map<int, int> corners;
  for (size_t m = 0; m < markers.markers.size(); ++m) {
    const Marker& marker = markers.markers[m];
    const Eigen::Vector2d place_m(marker.s_m, marker.t_m);
    if (markers.kind == MarkerKind::dots && !marker.tag) {
      places[static_cast<int>(m)] = place_m;
    } else if (markers.kind != MarkerKind::dots && marker.tag) {
      places.try_emplace(*marker.tag, Eigen::Vector2d::Zero()).first->second += place_m;
      ++corners[*marker.tag];
    }
  }
  for (const auto& [id, count] : corners) places[id] /= count;
  return places;
}

/// Returns where each picture shows them.
std::vector<Centres> centres_of(const LookResult& seen, const MarkerSet& markers,
                                const Centres& on_cloth) {
  std::vector<Centres> pictures;
  for (const SeenPicture& picture : seen.pictures) {
    Centres centres;
    for (const SeenMarker& dot : picture.markers)
      if (on_cloth.contains(dot.marker)) centres[dot.marker] = dot.pixel_px;
    for (const SeenTag& tag : picture.tags)
      if (markers.kind != MarkerKind::dots && tag.family == markers.family && tag.reading.good() &&
          on_cloth.contains(tag.reading.tag.id))
        centres[tag.reading.tag.id] = tag.reading.centre_px();
    pictures.push_back(std::move(centres));
  }
  return pictures;
}

/// Returns the median way of what both pictures show; nothing where they share nothing.
std::optional<double> median_way_px(const Centres& from, const Centres& to) {
  std::vector<double> ways_px;
  for (const auto& [id, centre] : from)
    if (const auto other = to.find(id); other != to.end())
      ways_px.push_back((other->second - centre).norm());
  if (ways_px.empty()) return std::nullopt;
  return median(ways_px);
}

std::optional<double> distance_from_flat(const SeenPicture& picture, const MarkerSet& markers) {
  std::map<std::pair<int, int>, const Marker*> by_corner;
  for (const Marker& marker : markers.markers)
    if (marker.tag && marker.corner) by_corner[{*marker.tag, *marker.corner}] = &marker;
  std::vector<cv::Point2d> sheet, pixels;
  for (const SeenTag& tag : picture.tags)
    for (int c = 0; c < 4; ++c) {
      const auto found = by_corner.find({tag.reading.tag.id, c});
      const auto corner = static_cast<size_t>(c);
      if (tag.family != markers.family || found == by_corner.end() ||
          !tag.reading.rejected[corner].empty())
        continue;
      sheet.emplace_back(found->second->s_m, found->second->t_m);
      pixels.emplace_back(tag.reading.tag.corner_px[corner].x(),
                          tag.reading.tag.corner_px[corner].y());
    }
  for (const SeenMarker& dot : picture.markers) {
    const Marker& marker = markers.markers[static_cast<size_t>(dot.marker)];
    sheet.emplace_back(marker.s_m, marker.t_m);
    pixels.emplace_back(dot.pixel_px.x(), dot.pixel_px.y());
  }
  constexpr size_t kFewest = 12;  // three tags
  if (sheet.size() < kFewest) return std::nullopt;
  const cv::Mat homography = cv::findHomography(sheet, pixels, 0);
  if (homography.empty()) return std::nullopt;
  std::vector<cv::Point2d> flat;
  cv::perspectiveTransform(sheet, flat, homography);
  double square_px2 = 0, size_px = 0;
  for (size_t i = 0; i < flat.size(); ++i) {
    square_px2 += (flat[i] - pixels[i]).dot(flat[i] - pixels[i]);
    size_px = std::max(size_px, cv::norm(pixels[i] - pixels[0]));
  }
  return std::sqrt(square_px2 / static_cast<double>(flat.size())) / size_px;
}

}  // namespace

SeenMotion measure_motion(const LookResult& seen, const MarkerSet& markers) {
  SeenMotion motion;
  const Centres on_cloth = places_on_cloth(markers);
  const std::vector<Centres> pictures = centres_of(seen, markers, on_cloth);
  Centres first;
  std::map<int, double> way_px;
  for (const Centres& centres : pictures)
    for (const auto& [id, centre] : centres) {
      first.emplace(id, centre);
      way_px[id] = std::max(way_px[id], (centre - first[id]).norm());
    }
  std::vector<double> ways_px;
  for (const auto& [id, way] : way_px) {
    motion.ways.push_back({.place_m = on_cloth.at(id), .way_px = way});
    ways_px.push_back(way);
  }
  if (!ways_px.empty()) motion.typical_px = median(ways_px);

  const bool in_a_row = seen.pictures.size() > 2 && seen.pictures[1].frame == 1 &&
                        seen.pictures[2].frame == 2 && seen.pictures[0].frame == 0;
  if (in_a_row) {
    constexpr double kStays_px = 0.3;  // beyond the noise of a median
    const auto first_px = median_way_px(pictures[0], pictures[1]),
               second_px = median_way_px(pictures[1], pictures[2]);
    if (first_px && second_px)
      motion.first_step = *second_px < kStays_px ? 0 : *first_px / *second_px;
  }
  if (!seen.pictures.empty()) motion.not_flat = distance_from_flat(seen.pictures[0], markers);
  return motion;
}

}  // namespace clothfit
