#pragma once

#include <optional>
#include <vector>

#include "vision/detect/dot_refine.h"
#include "vision/track/dot_layout.h"

namespace clothfit {

/// The dots of one picture by site, and the places that sites are known by.
struct PlacedDots {
  SitePlaces places;                     ///< of dots and tag corners, px
  std::vector<std::optional<Dot>> dots;  ///< of sites that are dots and placed

  explicit PlacedDots(size_t sites) : places(sites), dots(sites) {}
  void place(int site, const Dot& dot);
  void remove(int site);
  int count() const;  ///< of dots
};

/// Radius of the smallest size of dot, in spacings of the layout. Found from the dots of a picture.
struct DotScale {
  std::optional<double> radius;
};

/// Returns the map around each placed dot, itself included; unset for other sites.
std::vector<LocalMap> survey(const DotLayout& layout, const PlacedDots& placed);

/// Returns the radius of the smallest size of dot in spacings by the median of the placed dots;
/// nothing with fewer than 5 that have a map around them.
DotScale measure_dot_scale(const DotLayout& layout, const PlacedDots& placed,
                           const std::vector<LocalMap>& maps);

/// Returns the squared outline that a dot of `radius` spacings has under a map, px^2.
Eigen::Matrix2d expected_shape_px2(const LocalMap& map, double radius);

/// Returns by how much two outlines differ: the larger ratio of their sizes along any axis, >= 1.
double shape_ratio(const Eigen::Matrix2d& a_px2, const Eigen::Matrix2d& b_px2);

/// Says whether a dot may be the one that a map expects: its place within the map's own error, and
/// its outline's size and turn where the scale is known.
bool agrees(const LocalMap& map, const Dot& dot, const DotScale& scale, double size);

/// Says whether nothing but cloth may lie between a dot and a place `apart` spacings from it: the
/// way between them, measured by the dot's own outline, is as long as on the sheet. Across a fold
/// it is not, where the outline is thin or some of the sheet is hidden. `other`, if any, is the dot
/// at that place; both outlines then count.
struct DotEnd {
  const Dot* dot = nullptr;
  double radius = 0;  ///< in spacings
};
bool is_linked(const DotEnd& from, const Eigen::Vector2d& place_px, double apart,
               const DotEnd& other = {});

/// Says whether most of the placed neighbours within 1.5 spacings are linked with a dot put at a
/// site. True where the scale is not known.
bool has_links(const DotLayout& layout, const PlacedDots& placed, const DotScale& scale, int site,
               const Dot& dot);

/// Names found dots from the sites that are placed already (corners of tags, dots): dot by dot, the
/// best predicted first, each by the neighbours placed before it. A dot is taken where it alone
/// lies where its neighbours expect it, and is linked with them.
void grow_identities(const DotLayout& layout, const std::vector<Dot>& found, PlacedDots& placed);

/// Groups placed dots that links connect. Returns a group's number per site, -1 where no dot is.
std::vector<int> linked_groups(const DotLayout& layout, const PlacedDots& placed,
                               const DotScale& scale);

/// Says for each placed dot whether it is linked with a placed corner of a tag.
std::vector<bool> linked_with_tags(const DotLayout& layout, const PlacedDots& placed,
                                   const DotScale& scale);

/// Leaves out dots that their neighbours contradict, the worst first, and dots that two sites
/// claim. A dot with fewer than 3 placed neighbours is left out, as nothing speaks for it. Returns
/// the sites that were left out.
std::vector<int> leave_out_conflicts(const DotLayout& layout, PlacedDots& placed);

}  // namespace clothfit
