#pragma once

#include <map>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "vision/track/tag_history.h"

namespace clothfit {

/// Why a marker that the sheet has is found in no row of a frame.
namespace missing {
inline constexpr const char* kNoPicture = "no_picture";  ///< none has the frame's number or time
inline constexpr const char* kDamaged = "damaged_picture";
inline constexpr const char* kDark = "dark";        ///< the picture is nearly black
inline constexpr const char* kOutside = "outside";  ///< beyond the picture's border, or across it
inline constexpr const char* kNeverSeen = "never_seen";  ///< its tag is in no picture
inline constexpr const char* kUnread = "unread";  ///< covered, blurred, folded or turned away
}  // namespace missing

/// What there is of a frame.
enum class FramePicture { none, damaged, dark, whole };

/// Counts the frames in which each of a tag's corners is not found, by reason. `history` holds a
/// reading for each frame that shows the tag. Where it would be in others is interpolated between
/// those before and after, and continued with their last motion at the ends.
std::map<std::string, int> missing_frames_of(const TagHistory& history,
                                             const std::vector<FramePicture>& frames,
                                             const cv::Size& size);

}  // namespace clothfit
