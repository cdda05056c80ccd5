#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "data/markers.h"

namespace clothfit {

/// A point of the cloth that a picture of dots shows: a dot, or a corner of an anchor tag.
struct DotSite {
  int marker = 0;  ///< index into the markers
  Eigen::Vector2d place_m = Eigen::Vector2d::Zero();
  bool is_dot = true;
  double size = 1;              ///< radius over that of the smallest dot
  std::vector<int> neighbours;  ///< sites near it, nearest first
};

/// The sites of a sheet.
struct DotLayout {
  std::vector<DotSite> sites;
  double spacing_m = 0;  ///< median distance of a dot from the nearest
  std::map<int, std::array<int, 4>> corner_sites_by_tag;
  bool sizes_known = true;    ///< `size` of the sites is what is printed
  int columns = 0, rows = 0;  ///< where the dots fill a grid, and there are no tags; else 0
};

/// Arranges markers. Throws InputError with fewer than 6 dots, for two dots in one place, and for a
/// tag that lacks a corner.
DotLayout make_dot_layout(const std::vector<Marker>& markers, const std::string& file);

/// Lists for each site those within 2.9 spacings, nearest first.
void list_neighbours(DotLayout& layout);

/// Places of sites in one picture; nothing where a site is not placed.
using SitePlaces = std::vector<std::optional<Eigen::Vector2d>>;

/// The map from cloth to picture around a site, to second order. Lengths on the cloth are in
/// spacings: a place x spacings from the site appears at
/// place + jacobian x + (x^T bend[0] x, x^T bend[1] x) / 2.
struct LocalMap {
  int neighbours = 0;  ///< that took part; without any the rest is unset
  Eigen::Vector2d place_px = Eigen::Vector2d::Zero();
  Eigen::Matrix2d jacobian_px = Eigen::Matrix2d::Zero();
  std::array<Eigen::Matrix2d, 2> bend_px{Eigen::Matrix2d::Zero(), Eigen::Matrix2d::Zero()};
  double sigma = 0;     ///< of the place, in spacings as they appear where nothing is foreshortened
  double scale_px = 0;  ///< such a spacing

  double sigma_px() const { return sigma * scale_px; }
};

/// Fits the map to the neighbours that are placed, and to the site itself where `with_site`. The
/// prior says that second derivatives are some 0.4 spacings per spacing^2; each neighbour's error
/// grows with the cube of its distance, which is what third derivatives do. sigma accounts for
/// both.
LocalMap fit_local_map(const DotLayout& layout, int site, const SitePlaces& places, bool with_site);

}  // namespace clothfit
