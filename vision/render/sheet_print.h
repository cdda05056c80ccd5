#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "data/markers.h"
#include "vision/render/cloth_texture.h"

namespace clothfit {

/// Reflectances, 0 (black) to 1 (returns all light).
struct PrintOptions {
  double paper = 0.85;         ///< the cloth where nothing is printed, and its back
  double ink = 0.08;           ///< of tags and dots
  double dot_radius_m = 4e-3;  ///< > 0; of the discs around markers of kind `dots`
  /// > 0; radius of each marker's disc, as a pattern has them (vision/detect/dot_pattern.h). Empty:
  /// all have `dot_radius_m`. Those of tags' corners are not used.
  std::vector<double> dot_radii_m;
  ClothTextureOptions texture;  ///< of markers of kind `texture`
  void validate() const;        ///< throws InputError
};

/// The printed side of a sheet, as reflectance over material coordinates (s to the right, t down,
/// metres).
///
/// Markers of kind `apriltag` are corners of tags: the printed tag, whose border ends at the four
/// corners, is laid out between them, with the cells outside the border that its family has. Ink
/// wins where white margins overlap a neighbour. Markers of kind `dots` are the centres of filled
/// circles, but for corners of anchor tags, which are printed as tags. Those of kind `texture` lie
/// on a texture that covers the sheet, with anchor tags and their white margins on top. Those of
/// kind `none` show nothing.
class SheetPrint {
 public:
  /// Throws InputError for a cloth without size and an unknown family. It also refuses a tag that
  /// the family lacks, that lacks one of its four corners, or whose corners are not a rectangle's
  /// in the order of data/markers.h.
  SheetPrint(const MarkerSet& markers, double width_m, double height_m,
             const PrintOptions& options = {});

  double width_m() const { return width_m_; }
  double height_m() const { return height_m_; }
  /// Returns the reflectance of the other side, which is blank.
  double back_reflectance() const { return options_.paper; }
  /// Returns the mean around a place over a parallelogram, whose middle the place is. The columns
  /// of `footprint_m` span it; zero stands for the place itself. Edges that cross it are weighed by
  /// their cover of a rectangle along the tag's own axes (of a dot: along its radius) with the same
  /// second moments. The apparent place of an edge is exact, its softness nearly so. Footprints
  /// reach no further than a hundredth of the sheet.
  double reflectance(const Eigen::Vector2d& place_m,
                     const Eigen::Matrix2d& footprint_m = Eigen::Matrix2d::Zero()) const;

 private:
  /// A square of cells. `cell_from_material` takes (s - s0, t - t0) to (column, row) counted from
  /// the top left of everything that is printed.
  struct Tag {
    Eigen::Vector2d origin_m;
    Eigen::Matrix2d cell_from_material;
    int cells = 0;            ///< across
    std::vector<bool> black;  ///< row by row from the top left

    double ink_share(const Eigen::Vector2d& place_m, const Eigen::Matrix2d& footprint_m) const;
    /// Returns the share of the footprint that its cells cover.
    double cover(const Eigen::Vector2d& place_m, const Eigen::Matrix2d& footprint_m) const;
  };
  struct Dot {
    Eigen::Vector2d centre_m;
    double radius_m = 0;

    double ink_share(const Eigen::Vector2d& place_m, const Eigen::Matrix2d& footprint_m) const;
  };
  /// The items that may cover a place. The sheet is divided into bins so that a look-up reads few
  /// items.
  struct Bin {
    std::vector<int> tags;
    std::vector<int> dots;
  };

  void add_tags(const MarkerSet& markers);
  void add_dots(const MarkerSet& markers);
  void list_in_bins(const Eigen::Vector2d& low_m, const Eigen::Vector2d& high_m, int item,
                    std::vector<int> Bin::*list);
  int bin_along(double x_m, double length_m) const;

  double width_m_ = 0;
  double height_m_ = 0;
  PrintOptions options_;
  std::vector<Tag> tags_;
  std::vector<Dot> dots_;
  std::vector<Bin> bins_;
  std::optional<ClothTexture> texture_;
};

}  // namespace clothfit
