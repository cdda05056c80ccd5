#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "vision/detect/dot_pattern.h"

namespace clothfit {

/// A dot that a picture shows on a square lattice.
struct SeenDot {
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Zero();
  double sigma_px = 0;        ///< standard deviation per coordinate
  double width_px = 0;        ///< diameter of a circle of its area
  int row = -1, column = -1;  ///< in the pattern that names it; -1 where none does
  bool named() const { return row >= 0; }
};

/// What footage shows of dots.
struct DotsShown {
  bool any = false;                   ///< some picture shows a lattice of them
  std::optional<DotPattern> pattern;  ///< that names them
};

/// Looks at a few pictures of a folder or a video, spread over it, for dots on a square lattice and
/// for the printed pattern (vision/detect/dot_pattern.h) that they make. Its size is found where
/// one of these pictures shows the whole sheet. Throws InputError for pictures that cannot be read.
DotsShown dots_shown(const std::filesystem::path& images);

/// Lists the dots of a picture that lie on one lattice, by row and column of the pattern or, where
/// nothing names them, of the lattice. Empty where too few do.
std::vector<SeenDot> find_seen_dots(const cv::Mat& grey, const std::optional<DotPattern>& pattern);

}  // namespace clothfit
