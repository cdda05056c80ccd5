#include "apps/study/vision/spoiled_pictures.h"

#include <algorithm>

#include "data/median.h"
#include "fit/jobs/draws.h"
#include "vision/degrade/brightness.h"
#include "vision/degrade/displacement_field.h"
#include "vision/degrade/h264.h"
#include "vision/degrade/hand.h"
#include "vision/degrade/motion_blur.h"
#include "vision/degrade/shrink.h"

namespace clothfit {
namespace {

constexpr double kSensorNoise = 1;  // grey levels

std::vector<JudgedCorner> judged_corners(const TrueCorners& truth) {
  std::vector<JudgedCorner> corners;
  for (const auto& [name, corner] : truth) corners.push_back({.truth = corner});
  return corners;
}

std::uint64_t seed_of(unsigned long long seed, size_t frame) {
  return derived_seed(seed, static_cast<int>(frame));
}

/// Returns how corners move around a frame: half of the way from the frame before to the one after.
std::vector<PointMotion> motions_at(const JudgedRecording& recording, size_t frame) {
  const size_t before = frame > 0 ? frame - 1 : frame;
  const size_t after = std::min(frame + 1, recording.truth.size() - 1);
  std::vector<PointMotion> motions;
  for (const auto& [name, corner] : recording.truth[frame]) {
    const auto from = recording.truth[before].find(name);
    const auto to = recording.truth[after].find(name);
    if (from == recording.truth[before].end() || to == recording.truth[after].end()) continue;
    motions.push_back(
        {.at_px = corner.pixel_px, .motion_px = (to->second.pixel_px - from->second.pixel_px) / 2});
  }
  return motions;
}

double median_tag_width(const TrueCorners& truth) {
  std::vector<double> widths;
  for (const auto& [name, corner] : truth) {
    const auto next = truth.find({name.first, (name.second + 1) % 4});
    if (next != truth.end()) widths.push_back((next->second.pixel_px - corner.pixel_px).norm());
  }
  return widths.empty() ? 1 : median(std::move(widths));
}

/// Places a hand and says which corners it hides, or half hides.
SpoiledPicture with_hand_over(const cv::Mat& grey, std::vector<JudgedCorner> corners,
                              std::uint64_t seed) {
  constexpr double kShare = 0.25;
  std::vector<Eigen::Vector2d> shown;
  for (const JudgedCorner& corner : corners)
    if (corner.truth.visible) shown.push_back(corner.truth.pixel_px);
  if (shown.empty()) return {.grey = grey, .truth = std::move(corners)};
  const Hand hand = hand_over(shown, kShare, seed);
  for (JudgedCorner& corner : corners) {
    const double cover = hand.cover(corner.truth.pixel_px);
    constexpr double kClear = 0.02, kHidden = 0.98;
    corner.judged = cover < kClear || cover > kHidden;
    corner.truth.visible = corner.truth.visible && cover < kClear;
  }
  return {.grey = with_hand(grey, hand, seed), .truth = std::move(corners)};
}

}  // namespace

std::vector<SpoiledPicture> as_they_are(const JudgedRecording& recording,
                                        const std::vector<size_t>& frames, unsigned long long) {
  std::vector<SpoiledPicture> spoiled;
  for (const size_t frame : frames)
    spoiled.push_back({recording.pictures[frame], judged_corners(recording.truth[frame])});
  return spoiled;
}

Spoil blurred_along_motion(double length_px) {
  return [length_px](const JudgedRecording& recording, const std::vector<size_t>& frames,
                     unsigned long long seed) {
    std::vector<SpoiledPicture> spoiled;
    for (const size_t frame : frames) {
      const cv::Mat& sharp = recording.pictures[frame];
      const auto motions = scaled_to_median(motions_at(recording, frame), length_px);
      const cv::Mat blurred = blur_along(sharp, displacement_field(motions, sharp.size()));
      spoiled.push_back({with_brightness(blurred, 1, kSensorNoise, seed_of(seed, frame)),
                         judged_corners(recording.truth[frame])});
    }
    return spoiled;
  };
}

std::vector<SpoiledPicture> behind_a_hand(const JudgedRecording& recording,
                                          const std::vector<size_t>& frames,
                                          unsigned long long seed) {
  std::vector<SpoiledPicture> spoiled;
  for (const size_t frame : frames)
    spoiled.push_back(with_hand_over(recording.pictures[frame],
                                     judged_corners(recording.truth[frame]), seed_of(seed, frame)));
  return spoiled;
}

Spoil darkened(double factor, double noise_levels) {
  return [=](const JudgedRecording& recording, const std::vector<size_t>& frames,
             unsigned long long seed) {
    std::vector<SpoiledPicture> spoiled;
    for (const size_t frame : frames)
      spoiled.push_back(
          {with_brightness(recording.pictures[frame], factor, noise_levels, seed_of(seed, frame)),
           judged_corners(recording.truth[frame])});
    return spoiled;
  };
}

Spoil shrunk_to_tags(double width_px) {
  return [width_px](const JudgedRecording& recording, const std::vector<size_t>& frames,
                    unsigned long long) {
    const double factor = std::min(1.0, width_px / median_tag_width(recording.truth.front()));
    std::vector<SpoiledPicture> spoiled;
    for (const size_t frame : frames) {
      const cv::Mat& large = recording.pictures[frame];
      SpoiledPicture picture{shrunk(large, factor), judged_corners(recording.truth[frame])};
      for (JudgedCorner& corner : picture.truth)
        corner.truth.pixel_px = {
            shrunk_place(corner.truth.pixel_px.x(), large.cols, picture.grey.cols),
            shrunk_place(corner.truth.pixel_px.y(), large.rows, picture.grey.rows)};
      spoiled.push_back(std::move(picture));
    }
    return spoiled;
  };
}

Spoil through_codec(int crf) {
  return [crf](const JudgedRecording& recording, const std::vector<size_t>& frames,
               unsigned long long) {
    const std::vector<cv::Mat> decoded = through_h264(recording.pictures, crf);
    std::vector<SpoiledPicture> spoiled;
    for (const size_t frame : frames)
      spoiled.push_back({decoded[frame], judged_corners(recording.truth[frame])});
    return spoiled;
  };
}

}  // namespace clothfit
