#pragma once

#include <set>

#include "data/markers.h"
#include "vision/look/look.h"

namespace clothfit {

/// How well footage agrees with the sheet that it is said to show.
struct SheetMatch {
  int listed = 0;        ///< tags of the sheet, or its dots
  int shown = 0;         ///< of them, in any picture
  std::set<int> others;  ///< tags of the family that it does not list
  /// Neighbouring tags, over all pictures, and those among them whose distance in sides of a tag is
  /// another than on the sheet.
  int pairs = 0, misplaced = 0;

  /// Says whether the cloth must carry another sheet: its tags lie otherwise, or more tags are seen
  /// that it does not list than such that it lists, and half of these are missing.
  bool is_another() const;
};

/// Compares the whole tags, or the dots, that were seen with those of a sheet.
SheetMatch match_sheet(const LookResult& seen, const MarkerSet& sheet);

}  // namespace clothfit
