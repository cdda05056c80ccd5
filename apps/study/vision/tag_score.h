#pragma once

#include <set>
#include <vector>

#include "apps/study/vision/judged_recording.h"
#include "vision/detect/tag_detector.h"

namespace clothfit {

/// What is judged of corners that a tracker would accept in some pictures.
struct TagScore {
  int visible = 0;                       ///< corners that the pictures truly show
  int found = 0;                         ///< of these, accepted
  int hidden_reported = 0;               ///< accepted, and truly hidden
  int false_tags = 0;                    ///< tags accepted that are none of the recording's
  std::vector<double> error_px;          ///< distance of each found corner from its true place
  std::vector<double> error_over_sigma;  ///< the same over the stated sigma of a coordinate

  void add(const TagScore& other);
  double found_share() const;
  /// Returns the error that a share (0 to 1) of the corners stays below; NaN without any.
  double error_quantile_px(double share) const;
  /// Returns the root of the mean squared error of a coordinate over its sigma: 1 where sigma is
  /// honest.
  double error_over_sigma_rms() const;
  /// Returns the same from the median, which outliers do not move.
  double error_over_sigma_robust() const;
};

/// How a corner of a degraded picture is judged.
struct JudgedCorner {
  TrueCorner truth;
  bool judged = true;  ///< false: half hidden, so that neither report nor silence is wrong
};

/// Judges the tags that a picture's detections hold after what tracking rejects (track/rejection.h)
/// in a single picture. Tags that are neither in `truth` nor among `other_tags` are false.
TagScore score_tags(const std::vector<TagDetection>& tags, const std::vector<JudgedCorner>& truth,
                    const std::set<int>& other_tags, const cv::Size& picture);

}  // namespace clothfit
