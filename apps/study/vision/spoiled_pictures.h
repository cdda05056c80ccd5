#pragma once

#include <functional>
#include <string>
#include <vector>

#include "apps/study/vision/judged_recording.h"
#include "apps/study/vision/tag_score.h"

namespace clothfit {

/// A picture to read, with what it truly shows.
struct SpoiledPicture {
  cv::Mat grey;
  std::vector<JudgedCorner> truth;
};

/// Spoils the pictures of a recording in one way; `frames` says which of them are asked for.
using Spoil = std::function<std::vector<SpoiledPicture>(
    const JudgedRecording& recording, const std::vector<size_t>& frames, unsigned long long seed)>;

std::vector<SpoiledPicture> as_they_are(const JudgedRecording& recording,
                                        const std::vector<size_t>& frames, unsigned long long seed);
/// Blurs along the tags' true motion, scaled so that its median over the picture is `length_px`;
/// the sensor's noise, which blur would take away, comes on top.
Spoil blurred_along_motion(double length_px);
/// Covers a quarter of the visible corners by a hand.
std::vector<SpoiledPicture> behind_a_hand(const JudgedRecording& recording,
                                          const std::vector<size_t>& frames,
                                          unsigned long long seed);
Spoil darkened(double factor, double noise_levels);
/// Shrinks pictures until the tags of the first one have that median width.
Spoil shrunk_to_tags(double width_px);
/// Sends all pictures, in their order, through H.264.
Spoil through_codec(int crf);

}  // namespace clothfit
