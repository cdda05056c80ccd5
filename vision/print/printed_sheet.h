#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "data/markers.h"
#include "data/recording.h"

namespace clothfit {

struct PrintedRectangle {
  Eigen::Vector2d low_m, high_m;  ///< top left, bottom right
};
struct PrintedDisc {
  Eigen::Vector2d centre_m = Eigen::Vector2d::Zero();
  double radius_m = 0;
};

/// A sheet to print in black, and the markers that it gives to a cloth. Material coordinates:
/// metres from the top left corner, s to the right and t down on the printed side.
struct PrintedSheet {
  std::string name;  ///< for file names and the margin
  double width_m = 0, height_m = 0;
  /// Pages may end at multiples of this and cut nothing that is printed; 0: anywhere.
  Eigen::Vector2d share_m = Eigen::Vector2d::Zero();
  std::vector<PrintedRectangle> rectangles;
  std::vector<PrintedDisc> discs;
  MarkerSet markers;  ///< none on a calibration board
};

/// A grid of tags over a cloth.
struct TagSheetOptions {
  double width_m = 0.4, height_m = 0.4;  ///< > 0
  int columns = 8, rows = 8;             ///< of tags, >= 1
  std::string family = "tag36h11";
  int first_id = 0;  ///< of the tag at the top left; ids rise along rows
  double tag_m = 0;  ///< side of a tag's border; 0: as large as its white margin allows, less 10 %
};

/// Lays out a grid of tags, each in the middle of its share of the cloth. Corners are markers named
/// tID_CORNER. Throws InputError for an unknown family, one that has too few tags, and tags whose
/// white margins would overlap.
PrintedSheet make_tag_sheet(const TagSheetOptions& options);

/// Lays out a chessboard with a narrow white margin. Throws InputError for an impossible one.
PrintedSheet make_board_sheet(const BoardDescription& board);

}  // namespace clothfit
