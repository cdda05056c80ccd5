#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <opencv2/core.hpp>
#include <set>
#include <string>
#include <vector>

#include "vision/detect/tag_layout.h"

namespace clothfit {

/// Follows the tags of one sheet, and others beside it, through the pictures of one camera, which
/// come in order.
///
/// The first two pictures are searched whole. Later each tag is read where its motion takes it.
/// Some are read first and tell how far predictions are off this time. Tags that are not read there
/// are sought where their neighbours expect them. A picture is searched whole where many of the
/// tags of the last search are lost, after a gap, and every now and then while listed tags are
/// missing. Prediction alone places nothing: the cells of every tag are read in every picture. Tags
/// are read in parallel; the result does not depend on the number of threads.
class TagTracker {
 public:
  /// `listed` are the tags that are sought, those of the sheet among them. Throws InputError for an
  /// unknown family.
  TagTracker(const std::string& family, TagLayout layout, const std::set<int>& listed);

  /// Reads the next picture, 8-bit grey. Frames ascend.
  SheetTags next(const cv::Mat& grey, int frame);
  /// Says whether the picture read last was searched whole.
  bool searched() const { return since_search_ == 0; }

 private:
  /// A tag of the picture before, or of a little earlier where nothing else predicts it.
  struct Followed {
    TagDetection tag;
    bool moves = false;                            ///< its motion is known
    std::array<Eigen::Vector2d, 4> motion_px{};    ///< of its corners, per frame
    double black_levels = 0, contrast_levels = 0;  ///< when all of it was seen
    int unread = 0;                                ///< pictures since it was read
  };

  bool must_search(int frame) const;
  SheetTags follow(const cv::Mat& grey, int frame);
  std::vector<PredictedTag> predictions(int frame) const;
  SheetTags search(const cv::Mat& grey, const SheetTags& followed);
  bool lost_many(const SheetTags& tags) const;
  void remember(const SheetTags& tags, int frame);

  TagDetector detector_;
  TagLayout layout_;
  std::set<int> listed_;
  std::vector<int> sheet_ids_;
  std::map<int, Followed> followed_;  ///< by id
  int pictures_ = 0, frame_ = 0, since_search_ = 0;
  bool steady_ = false;                ///< the motion predicted the picture read last
  std::ptrdiff_t read_by_search_ = 0;  ///< tags read when a picture was searched last
};

}  // namespace clothfit
