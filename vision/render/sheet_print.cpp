#include "vision/render/sheet_print.h"

#include <fmt/core.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include "data/input_error.h"
#include "vision/detect/tag_family.h"

namespace clothfit {
namespace {

constexpr int kBinsAcross = 64;

/// Material coordinates of a tag's corners in their order (data/markers.h).
using Corners = std::array<std::optional<Eigen::Vector2d>, 4>;

std::map<int, Corners> corners_by_tag(const MarkerSet& markers) {
  std::map<int, Corners> by_tag;
  for (const Marker& marker : markers.markers) {
    if (!marker.tag || !marker.corner) continue;
    by_tag[*marker.tag].at(static_cast<size_t>(*marker.corner)) =
        Eigen::Vector2d(marker.s_m, marker.t_m);
  }
  return by_tag;
}

/// The place of a tag's border: its top left corner and its edges to the right and down.
struct Border {
  Eigen::Vector2d top_left_m, right_m, down_m;
};

Border border_of(int tag, const Corners& corners) {
  for (size_t c = 0; c < 4; ++c) {
    if (!corners[c])
      throw InputError("markers", fmt::format("tag {} has no marker at its corner {}", tag, c),
                       "all four corners of every tag that is to be printed");
  }
  const Eigen::Vector2d &bottom_left = *corners[0], &bottom_right = *corners[1],
                        &top_right = *corners[2], &top_left = *corners[3];
  const Border border{top_left, top_right - top_left, bottom_left - top_left};
  constexpr double kOff = 0.01;  // of the side: what rounding in a marker file may leave
  const double side_m = std::sqrt(border.right_m.norm() * border.down_m.norm());
  const bool rectangle =
      (bottom_right - (top_left + border.right_m + border.down_m)).norm() <= kOff * side_m &&
      std::abs(border.right_m.dot(border.down_m)) <= kOff * side_m * side_m;
  // Seen from the printed side s runs to the right and t down, and so do a tag's columns and rows.
  const double turn =
      border.right_m.x() * border.down_m.y() - border.right_m.y() * border.down_m.x();
  if (!(side_m > 0) || !rectangle || !(turn > 0))
    throw InputError("markers", fmt::format("the corners of tag {} are not a rectangle's", tag),
                     "0 bottom left, 1 bottom right, 2 top right, 3 top left, as the tag is seen "
                     "upright from the printed side");
  return border;
}

/// Returns the share of [low, high] that lies in cell `index`, [index, index + 1]; of a point, all
/// of it.
double share(double low, double high, int index) {
  if (!(high > low)) return 1;
  return std::max(0.0, std::min(high, index + 1.0) - std::max(low, index + 0.0)) / (high - low);
}

}  // namespace

void PrintOptions::validate() const {
  const auto check = [](const char* name, double value) {
    if (!(value >= 0 && value <= 1))
      throw InputError(name, fmt::format("{}", value), "a reflectance, 0 to 1");
  };
  check("paper", paper);
  check("ink", ink);
  if (!(dot_radius_m > 0 && std::isfinite(dot_radius_m)))
    throw InputError("dot_radius_m", fmt::format("{}", dot_radius_m), "metres, > 0");
  for (const double radius_m : dot_radii_m)
    if (!(radius_m > 0 && std::isfinite(radius_m)))
      throw InputError("dot_radii_m", fmt::format("{}", radius_m), "metres, > 0");
}

SheetPrint::SheetPrint(const MarkerSet& markers, double width_m, double height_m,
                       const PrintOptions& options)
    : width_m_(width_m),
      height_m_(height_m),
      options_(options),
      bins_(static_cast<size_t>(kBinsAcross * kBinsAcross)) {
  options.validate();
  if (!(width_m > 0 && height_m > 0 && std::isfinite(width_m) && std::isfinite(height_m)))
    throw InputError("cloth", fmt::format("size = [{}, {}]", width_m, height_m), "metres, > 0");
  const bool has_tags = std::ranges::any_of(
      markers.markers, [](const Marker& marker) { return marker.tag.has_value(); });
  switch (markers.kind) {
    case MarkerKind::apriltag:
      add_tags(markers);
      return;
    case MarkerKind::dots:
      if (has_tags) add_tags(markers);
      add_dots(markers);
      return;
    case MarkerKind::none:
      return;
    case MarkerKind::texture:
      if (has_tags) add_tags(markers);
      texture_.emplace(width_m, height_m, options.texture);
      return;
  }
}

void SheetPrint::add_tags(const MarkerSet& markers) {
  const TagFamily family = make_tag_family(markers.family);
  for (const auto& [id, corners] : corners_by_tag(markers)) {
    const Border border = border_of(id, corners);
    const TagPattern pattern = printed_tag(*family, id);
    Eigen::Matrix2d material_from_cell;
    material_from_cell.col(0) = border.right_m / pattern.border_cells;
    material_from_cell.col(1) = border.down_m / pattern.border_cells;
    const double margin_cells = 0.5 * (pattern.total_cells - pattern.border_cells);
    const Eigen::Vector2d origin_m =
        border.top_left_m - material_from_cell * Eigen::Vector2d::Constant(margin_cells);
    Tag tag{.origin_m = origin_m,
            .cell_from_material = material_from_cell.inverse(),
            .cells = pattern.total_cells,
            .black = {}};
    for (const float white : pattern.white) tag.black.push_back(white < 0.5F);

    Eigen::Vector2d low_m = origin_m, high_m = origin_m;
    for (const double column : {0, tag.cells}) {
      for (const double row : {0, tag.cells}) {
        const Eigen::Vector2d corner_m =
            origin_m + material_from_cell * Eigen::Vector2d(column, row);
        low_m = low_m.cwiseMin(corner_m);
        high_m = high_m.cwiseMax(corner_m);
      }
    }
    list_in_bins(low_m, high_m, static_cast<int>(tags_.size()), &Bin::tags);
    tags_.push_back(std::move(tag));
  }
}

void SheetPrint::add_dots(const MarkerSet& markers) {
  const std::vector<double>& radii_m = options_.dot_radii_m;
  if (!radii_m.empty() && radii_m.size() != markers.markers.size())
    throw InputError("dot_radii_m", fmt::format("{} radii", radii_m.size()),
                     fmt::format("one for each of {} markers, or none", markers.markers.size()));
  for (size_t i = 0; i < markers.markers.size(); ++i) {
    const Marker& marker = markers.markers[i];
    if (marker.tag) continue;
    const double radius_m = radii_m.empty() ? options_.dot_radius_m : radii_m[i];
    const Eigen::Vector2d centre_m(marker.s_m, marker.t_m);
    const Eigen::Vector2d reach_m = Eigen::Vector2d::Constant(radius_m);
    list_in_bins(centre_m - reach_m, centre_m + reach_m, static_cast<int>(dots_.size()),
                 &Bin::dots);
    dots_.push_back({.centre_m = centre_m, .radius_m = radius_m});
  }
}

int SheetPrint::bin_along(double x_m, double length_m) const {
  return static_cast<int>(std::clamp(x_m / length_m, 0.0, 1.0) * (kBinsAcross - 1));
}

void SheetPrint::list_in_bins(const Eigen::Vector2d& low_m, const Eigen::Vector2d& high_m, int item,
                              std::vector<int> Bin::*list) {
  // Footprints reach over the item's edge, so a bin more on each side is taken.
  const auto first = [](int bin) { return std::max(bin - 1, 0); };
  const auto last = [](int bin) { return std::min(bin + 1, kBinsAcross - 1); };
  for (int row = first(bin_along(low_m.y(), height_m_));
       row <= last(bin_along(high_m.y(), height_m_)); ++row)
    for (int column = first(bin_along(low_m.x(), width_m_));
         column <= last(bin_along(high_m.x(), width_m_)); ++column)
      (bins_[static_cast<size_t>(row * kBinsAcross + column)].*list).push_back(item);
}

double SheetPrint::Tag::ink_share(const Eigen::Vector2d& place_m,
                                  const Eigen::Matrix2d& footprint_m) const {
  const Eigen::Vector2d cell = cell_from_material * (place_m - origin_m);
  const Eigen::Vector2d side = (cell_from_material * footprint_m).rowwise().norm();
  const Eigen::Vector2d low = cell - 0.5 * side, high = cell + 0.5 * side;
  if (!(high.minCoeff() > 0 && low.maxCoeff() < cells)) return 0;
  const auto clamped = [&](double x) {
    return static_cast<int>(std::clamp(std::floor(x), 0.0, cells - 1.0));
  };
  const int first_row = clamped(low.y()), first_column = clamped(low.x());
  if (high.x() <= first_column + 1 && high.y() <= first_row + 1 && low.minCoeff() >= 0)
    return black[static_cast<size_t>(first_row * cells + first_column)] ? 1 : 0;
  double ink = 0;
  for (int row = first_row; row <= clamped(high.y()); ++row) {
    const double down = share(low.y(), high.y(), row);
    for (int column = first_column; column <= clamped(high.x()); ++column)
      if (black[static_cast<size_t>(row * cells + column)])
        ink += down * share(low.x(), high.x(), column);
  }
  return ink;
}

double SheetPrint::Tag::cover(const Eigen::Vector2d& place_m,
                              const Eigen::Matrix2d& footprint_m) const {
  const Eigen::Vector2d cell = cell_from_material * (place_m - origin_m);
  const Eigen::Vector2d side = (cell_from_material * footprint_m).rowwise().norm();
  double covered = 1;
  for (int axis = 0; axis < 2; ++axis) {
    const double low = cell[axis] - 0.5 * side[axis], high = cell[axis] + 0.5 * side[axis];
    const double inside = std::min(high, cells + 0.0) - std::max(low, 0.0);
    covered *= high > low ? std::max(0.0, inside) / (high - low) : (inside >= 0 ? 1 : 0);
  }
  return covered;
}

double SheetPrint::Dot::ink_share(const Eigen::Vector2d& place_m,
                                  const Eigen::Matrix2d& footprint_m) const {
  const Eigen::Vector2d from_centre_m = place_m - centre_m;
  const double distance_m = from_centre_m.norm();
  if (distance_m == 0) return 1;
  const double side_m = (from_centre_m.transpose() / distance_m * footprint_m).norm();
  if (side_m == 0) return distance_m < radius_m ? 1 : 0;
  return std::clamp(0.5 + (radius_m - distance_m) / side_m, 0.0, 1.0);
}

double SheetPrint::reflectance(const Eigen::Vector2d& place_m,
                               const Eigen::Matrix2d& footprint_m) const {
  const int row = bin_along(place_m.y(), height_m_), column = bin_along(place_m.x(), width_m_);
  const Bin& bin = bins_[static_cast<size_t>(row * kBinsAcross + column)];
  double ink = 0;
  for (const int index : bin.tags)
    ink = std::max(ink, tags_[static_cast<size_t>(index)].ink_share(place_m, footprint_m));
  for (const int index : bin.dots)
    ink = std::max(ink, dots_[static_cast<size_t>(index)].ink_share(place_m, footprint_m));
  double ground = options_.paper;
  if (texture_) {
    double covered = 0;
    for (const int index : bin.tags)
      covered = std::max(covered, tags_[static_cast<size_t>(index)].cover(place_m, footprint_m));
    if (covered < 1)
      ground += (1 - covered) * (texture_->reflectance(place_m, footprint_m) - options_.paper);
  }
  return ground + ink * (options_.ink - options_.paper);
}

}  // namespace clothfit
