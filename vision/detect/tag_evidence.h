#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "vision/detect/tag_pattern.h"

namespace clothfit {

class TagFit;

/// What a converged fit shows of the tag's cells and corners. Each printed cell is asked alone
/// whether the picture wants it as printed or the other way round, with its neighbours as printed:
/// the amplitude of that change is 0 where the print is right and 1 where it is wrong. Something in
/// front of a cell gives other amplitudes.
struct TagEvidence {
  int printed_cells = 0;  ///< within reach of the samples (tag_samples.h)
  int cells = 0;          ///< with enough pixels to tell
  int right_cells = 0;    ///< as printed
  int wrong_cells = 0;    ///< the other way round
  /// Of each cell, as in TagPattern::white: 1 right, -1 wrong, 0 where the picture does not tell.
  std::vector<signed char> verdict;
  /// What is least at each corner: the mean robust weights along the two edges that meet there, by
  /// slope, or the share that is as printed of the cells around it. About 0.9 where nothing hides
  /// it. Flat places do not count by themselves, since something in front may be as bright or dark.
  std::array<double, 4> corner_seen{};

  /// Says whether the print is there at all, border and white around it included. A tag of another
  /// border shows wrong cells, a place without a tag hardly any right one.
  bool shows_tag() const {
    // Higher and lower let more through.
    constexpr double kMostWrong = 0.08, kLeastRight = 0.4, kLeastTold = 0.5;
    return cells > 0 && cells >= kLeastTold * printed_cells && wrong_cells <= kMostWrong * cells &&
           right_cells >= kLeastRight * cells;
  }
};

/// Says whether the cells speak for `own` rather than for another print of the same family: of
/// those in which the two differ, at least 4 more are right than wrong.
bool speaks_for(const TagEvidence& evidence, const TagPattern& own, const TagPattern& rival);

/// Reads the cells and corners. `pixel_by_tag` maps small steps from tag coordinates to pixels.
TagEvidence tag_evidence(const TagFit& fit, const TagPattern& pattern,
                         const Eigen::Matrix2d& pixel_by_tag);

}  // namespace clothfit
