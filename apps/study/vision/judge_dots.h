#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "data/markers.h"
#include "data/tracks.h"

namespace clothfit {

/// Where a marker truly is in a picture, and whether the camera sees it.
struct TrueSighting {
  int frame = 0;
  int marker = 0;
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Zero();
  bool visible = false;
};

/// Reads the columns frame, marker, u, v, visible of a CSV, gzip-compressed when the name ends in
/// .gz. Throws InputError with file and line.
std::vector<TrueSighting> read_true_sightings(const std::filesystem::path& file,
                                              const MarkerSet& markers);

/// Tracks of dots held against the truth.
struct DotJudgement {
  int visible = 0;             ///< true sightings
  int found = 0;               ///< of these, those with a row within `kFalse_px`
  int false_identities = 0;    ///< rows further from their marker's truth
  int invisible_reported = 0;  ///< rows of markers that the camera does not see
  double median_px = 0;        ///< of the distances of the found ones
  double percentile95_px = 0;
  double rms_px = 0;                    ///< per coordinate
  double mean_u_px = 0, mean_v_px = 0;  ///< mean offset
  double error_over_sigma = 0;  ///< root of the mean squared coordinate error over sigma squared
  double robust_error_over_sigma = 0;  ///< by the median, 1 for normal errors

  double share_found() const { return visible > 0 ? static_cast<double>(found) / visible : 0; }
};

/// Judges rows of dots: those that carry no tag. Rejected rows do not count as found.
DotJudgement judge_dots(const Tracks2d& tracks, const std::vector<TrueSighting>& truth,
                        const MarkerSet& markers);

}  // namespace clothfit
