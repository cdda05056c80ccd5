#include "vision/track/track_rows.h"

#include <algorithm>

#include "vision/detect/fixed_corner.h"
#include "vision/track/overlay.h"

namespace clothfit {

void sort_rows(Tracks2d& tracks) {
  std::sort(tracks.begin(), tracks.end(), [](const Position2d& a, const Position2d& b) {
    return a.frame != b.frame ? a.frame < b.frame : a.marker < b.marker;
  });
}

std::optional<ReferencePixel> average_corner(const TagHistory& history, size_t corner, int point) {
  std::vector<Eigen::Vector2d> pixels;
  std::vector<double> sigmas;
  for (const TagReading& reading : history) {
    if (!reading.rejected[corner].empty()) continue;
    pixels.push_back(reading.tag.corner_px[corner]);
    sigmas.push_back(reading.tag.sigma_px[corner]);
  }
  if (pixels.empty()) return std::nullopt;
  const FixedCorner mean = average_fixed_corner(pixels, sigmas);
  return ReferencePixel{
      .point = point, .pixel_px = mean.pixel_px, .sigma_px = mean.sigma_px, .frames = mean.frames};
}

std::vector<ReferencePixel> average_reference(const std::map<int, TagHistory>& by_tag,
                                              const std::vector<ReferencePoint>& points) {
  std::vector<ReferencePixel> result;
  for (size_t i = 0; i < points.size(); ++i) {
    if (!points[i].tag || !points[i].corner) continue;
    const auto history = by_tag.find(*points[i].tag);
    if (history == by_tag.end()) continue;
    if (const auto corner = average_corner(history->second, static_cast<size_t>(*points[i].corner),
                                           static_cast<int>(i)))
      result.push_back(*corner);
  }
  return result;
}

cv::Mat draw_rows(const cv::Mat& grey, int frame, const TrackResult& result) {
  std::vector<OverlayPoint> points;
  for (const ReferencePixel& pixel : result.reference)
    points.push_back(
        {.kind = OverlayPoint::Kind::reference, .pixel_px = pixel.pixel_px, .label = ""});
  for (const Position2d& row : result.tracks) {
    if (row.frame != frame) continue;
    points.push_back(
        {.kind = row.rejected.empty() ? OverlayPoint::Kind::good : OverlayPoint::Kind::rejected,
         .pixel_px = row.position_px,
         .label = row.rejected});
  }
  return draw_overlay(grey, points);
}

}  // namespace clothfit
