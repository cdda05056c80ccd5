#pragma once

// Private to calib/: finds the tags among surveyed reference points.

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

#include "calib/bundle/placed_pixel.h"
#include "calib/camera/rigid3.h"

namespace clothfit {

/// The four corners of one tag, in the order round the square that the survey shows.
struct TagSquare {
  std::array<size_t, 4> corners{};  ///< indices into the reference points
  Rigid3 world_from_square;         ///< origin in the middle, sides along x and y
  double side_m = 0;
  double misfit2_m2 = 0;  ///< sum of squared distances of the survey from this square
  size_t alike = 0;       ///< tags of one size share this number
};

/// Returns corner `k` (0 to 3, going round) of a square of side 1 about the origin.
Eigen::Vector3d unit_square_corner(size_t k);

/// Finds the groups of four reference points that are squares by their survey. If the sides of tags
/// differ by less than 4 sigma of the survey, they are taken to be of one size; `common_sides_m`
/// becomes the mean side of each size.
std::vector<TagSquare> find_tag_squares(const std::vector<PlacedPixel>& reference,
                                        std::vector<double>& common_sides_m);

}  // namespace clothfit
