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
inline constexpr const char* kHidden = "hidden";         ///< the cloth turns away there
inline constexpr const char* kBlurred = "blurred";       ///< cells run into one another
inline constexpr const char* kCovered = "covered";       ///< the picture shows something else there
inline constexpr const char* kUnread = "unread";         ///< nothing tells where it would be
}  // namespace missing

/// What there is of a frame.
enum class FramePicture { none, damaged, dark, whole };

/// Returns why a tag was not read where its neighbours expect it. `size` is the picture's.
const char* why_unread(const PredictedTag& tag, const cv::Size& size);

/// Counts the frames in which each of a tag's corners is not found, by reason. `history` holds a
/// reading for each frame that shows the tag, `reasons` why it was not read in others, by frame.
/// Where nothing is known of it, the tag's place is interpolated between the readings before and
/// after, and continued with their last motion at the ends.
std::map<std::string, int> missing_frames_of(const TagHistory& history,
                                             const std::map<int, const char*>& reasons,
                                             const std::vector<FramePicture>& frames,
                                             const cv::Size& size);

}  // namespace clothfit
