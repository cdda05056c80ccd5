#pragma once

#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "data/markers.h"
#include "vision/detect/dot_detector.h"
#include "vision/detect/tag_detector.h"

namespace clothfit {

/// Why a dot that the sheet has is not found in a picture.
namespace dot_missing {
inline constexpr const char* kHidden = "hidden";    ///< the cloth turns away there or folds over it
inline constexpr const char* kCovered = "covered";  ///< the picture shows something else there
inline constexpr const char* kOutside = "outside";  ///< beyond the picture's border, or across it
inline constexpr const char* kBlurred = "blurred";  ///< its blur is wider than the dot
inline constexpr const char* kDark = "dark";        ///< too little light to tell it from the cloth
inline constexpr const char* kCut = "cut";          ///< seen in part: a fold, an edge, something
inline constexpr const char* kUnplaced = "unplaced";  ///< too few neighbours say where it would be
}  // namespace dot_missing

struct DotTrackOptions {
  DotDetectorOptions detector;
  /// A dot is reported cut where its outline is more wavy than this many times the picture's
  /// median. Higher values let cut dots through: at 2.5, in a sharp picture, those moved by less
  /// than 0.1 px.
  double cut_ratio = 2.5;
  /// The same by its outline: the largest ratio to what its neighbours expect. Lower values drop
  /// dots on sharp folds.
  double cut_shape_ratio = 1.35;
  void validate() const;  ///< throws InputError
};

/// A dot of the sheet in one picture.
struct DotRow {
  int marker = 0;                                      ///< index into the markers
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Zero();  ///< of the printed centre
  double sigma_px = 0;                                 ///< one standard deviation per coordinate
};

/// What one picture shows of a sheet of dots.
struct DotFrame {
  std::vector<DotRow> dots;                          ///< sorted by marker
  std::vector<TagDetection> tags;                    ///< of the sheet's anchors, and others seen
  std::vector<std::pair<int, const char*>> missing;  ///< marker and reason, sorted by marker
  bool searched_whole = false;                       ///< the whole picture was searched

  std::map<std::string, int> missing_counts() const;
};

/// Follows the dots of one sheet through the pictures of one camera, which come in order.
///
/// In the first picture all dots are found and named from the anchor tags by their neighbours, or,
/// without tags, from the printed pattern (vision/detect/dot_pattern.h). Later each dot is sought
/// where its motion takes it, then where its neighbours expect it. Every dot must lie where its
/// neighbours expect it. Where few are found, or a tag or the pattern contradicts them, the whole
/// picture is searched again. Dots are fitted in parallel; the result does not depend on the number
/// of threads.
class DotTracker {
 public:
  /// Throws InputError for fewer than 6 dots, an unknown family, and dots that nothing names: no
  /// tag, and no full grid that a pattern could fill. `file` is the markers' in messages.
  DotTracker(const MarkerSet& markers, const std::string& file,
             const DotTrackOptions& options = {});
  ~DotTracker();
  DotTracker(DotTracker&&) noexcept;
  DotTracker& operator=(DotTracker&&) noexcept;

  /// Takes the next picture, 8-bit grey, all of one size.
  DotFrame next(const cv::Mat& grey);

 private:
  class Follower;
  std::unique_ptr<Follower> follower_;
};

}  // namespace clothfit
