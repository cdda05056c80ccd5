#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "data/finding.h"

namespace clothfit {

/// What is wanted instead of interlaced footage, and how to get it.
inline constexpr const char* kProgressive = "progressive pictures, all lines of one instant";
inline constexpr const char* kDeinterlace =
    "make a picture of each field: ffmpeg -i IN -vf bwdif=mode=send_field -c:v ffv1 OUT.mkv";

/// Looks at pictures as they pass for faults that no file states.
class FootageWatch {
 public:
  /// Takes the next whole picture, CV_8UC1.
  void see(const cv::Mat& grey, int frame);

  /// Says whether the picture last taken is nearly black.
  bool dark() const { return last_dark_; }

  /// Says whether even and odd lines show different instants. Where they do, moving edges turn into
  /// combs: lines stick out in turn from those above and below.
  bool interlaced() const;
  /// Says how often that was seen, and how often columns do it, which only noise and prints can.
  std::string combing() const;

  /// Warns of pictures that are nearly black, and of such that repeat the one before though the
  /// footage moves before and after.
  Findings findings(const std::string& where) const;

 private:
  /// Lines that stick out in turn. Where a dark thing moves, even lines are the brighter ones at
  /// one of its edges and odd lines at the other. A print of fine lines has the same ones
  /// everywhere.
  struct Combs {
    long even_brighter = 0, odd_brighter = 0;  ///< pixels
    void add(int side, int line);
    long count() const;
  };

  void compare(const cv::Mat& grey, int frame);
  void count_combs(const cv::Mat& grey);

  cv::Mat last_;
  bool moves_ = false;      ///< the last picture that differed from the one before showed motion
  std::vector<int> equal_;  ///< frames equal to the one before, not yet followed by another
  std::vector<int> repeated_;
  std::vector<int> dark_;
  bool last_dark_ = false;
  int brightest_ = 0;  ///< grey level, over the dark pictures
  int pictures_ = 0;
  Combs combs_[2];   ///< of lines, of columns
  long moving_ = 0;  ///< pixels looked at
};

}  // namespace clothfit
