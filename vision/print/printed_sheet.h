#pragma once

#include <Eigen/Core>
#include <string>
#include <utility>
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
  /// Pages may end at multiples of this, from `bare_m` on, and cut nothing that is printed; 0:
  /// anywhere.
  Eigen::Vector2d share_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d bare_m = Eigen::Vector2d::Zero();  ///< beside the shares, left and right, above
                                                     ///< and below
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

/// A square grid of dots over a cloth, whose sizes make a pattern (vision/detect/dot_pattern.h).
struct DotSheetOptions {
  double width_m = 0.4, height_m = 0.4;  ///< > 0
  int columns = 16, rows = 16;           ///< of dots, 3 to 64
};

/// Returns the columns and rows of dots that fill a cloth, 16 along its longer side.
std::pair<int, int> usual_dot_grid(double width_m, double height_m);

/// Lays out a grid of dots, as far apart as the cloth allows, in its middle. Dots are markers named
/// dROW_COLUMN. Throws InputError where `make_dot_pattern` does, for dots too small to be printed,
/// and for a grid beside which another column or row would fit.
PrintedSheet make_dot_sheet(const DotSheetOptions& options);

/// Lays out a chessboard with a narrow white margin. Throws InputError for an impossible one.
PrintedSheet make_board_sheet(const BoardDescription& board);

}  // namespace clothfit
