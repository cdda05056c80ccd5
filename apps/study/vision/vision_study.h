#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/study/vision/tag_score.h"
#include "apps/study/vision/vision_row.h"
#include "data/progress.h"

namespace clothfit {

/// Options of the study of what the detector reads of pictures, spoiled in known ways or not.
struct VisionStudyOptions {
  std::filesystem::path data;     ///< folder with recordings/ and vision/ in it
  std::vector<std::string> rows;  ///< names of vision_rows(); empty: all
  int stride = 1;                 ///< >= 1: every so many-th picture of a recording is tracked
  unsigned long long seed = 1;    ///< of noise, hands, textures and lost pictures
  void validate() const;          ///< throws InputError
};

/// Returns all rows, those that chain_study.h measures at the end.
const std::vector<VisionRow>& vision_rows();

/// What was measured for one row in one recording or set.
struct VisionResult {
  std::string row;
  std::string set;
  TagScore score;
  std::string reason;  ///< why nothing was measured; empty where something was
  double seconds = 0;
};

/// A number that the program should reach.
struct VisionTarget {
  std::string name;
  std::string target;  ///< "<= 0.125"
  double value = 0;    ///< NaN where it was not measured
  std::string unit;
  bool met = false;
  std::string note;
};

/// Measures the rows that read pictures, in the order of vision_rows(). Sets that are not below
/// `data` have their reason. The result does not depend on the number of threads. Throws InputError
/// for options that make no sense, Cancelled when `progress` asks to stop.
std::vector<VisionResult> study_vision(const VisionStudyOptions& options,
                                       const ProgressCallback& progress);

/// Compares results, recordings together, with the targets of the rows that were measured.
std::vector<VisionTarget> vision_targets(const std::vector<VisionResult>& results);

}  // namespace clothfit
