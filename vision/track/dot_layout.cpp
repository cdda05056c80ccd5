#include "vision/track/dot_layout.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "data/input_error.h"
#include "data/median.h"
#include "vision/detect/small_system.h"

namespace clothfit {
namespace {

constexpr int kNoSite = -1;

/// Returns the median distance of a dot from the nearest one.
double dot_spacing_m(const std::vector<DotSite>& sites, const std::string& file) {
  std::vector<double> nearest;
  for (size_t i = 0; i < sites.size(); ++i) {
    if (!sites[i].is_dot) continue;
    double least = std::numeric_limits<double>::infinity();
    for (size_t j = 0; j < sites.size(); ++j)
      if (j != i && sites[j].is_dot)
        least = std::min(least, (sites[i].place_m - sites[j].place_m).norm());
    nearest.push_back(least);
  }
  constexpr size_t kFewest = 6;
  if (nearest.size() < kFewest)
    throw InputError(file, fmt::format("{} dots", nearest.size()),
                     fmt::format("{} or more dots on a sheet", kFewest));
  const double spacing_m = median(nearest);
  if (*std::min_element(nearest.begin(), nearest.end()) < 0.1 * spacing_m)
    throw InputError(file, "two dots lie in one place", "dots apart from each other");
  return spacing_m;
}

/// Sets columns and rows if the dots, which come without tags, fill a grid.
void recognise_grid(DotLayout& layout) {
  if (!layout.corner_sites_by_tag.empty()) return;
  Eigen::Vector2d low = layout.sites[0].place_m, high = low;
  for (const DotSite& site : layout.sites) {
    low = low.cwiseMin(site.place_m);
    high = high.cwiseMax(site.place_m);
  }
  const Eigen::Vector2d steps = (high - low) / layout.spacing_m;
  const int columns = static_cast<int>(std::lround(steps.x())) + 1;
  const int rows = static_cast<int>(std::lround(steps.y())) + 1;
  if (static_cast<size_t>(columns * rows) != layout.sites.size()) return;
  std::vector<bool> filled(layout.sites.size(), false);
  for (const DotSite& site : layout.sites) {
    const Eigen::Vector2d at = (site.place_m - low) / layout.spacing_m;
    const Eigen::Vector2d rounded = at.array().round();
    constexpr double kOff = 0.05;  // spacings: rounding in the file
    if ((at - rounded).norm() > kOff) return;
    const auto index = static_cast<size_t>(rounded.y() * columns + rounded.x());
    if (filled[index]) return;
    filled[index] = true;
  }
  layout.columns = columns;
  layout.rows = rows;
}

/// Number of the polynomials to second order: value, first and second derivatives.
constexpr size_t kQuadratic = 6;

/// The normal equations of a site's map; both coordinates share the matrix. The third right side is
/// for the variance of the place.
struct MapEquations {
  SmallSystem<kQuadratic, 4> system;  // the last side stays empty: an even number is faster
  int count = 0;

  void add(const Eigen::Vector2d& from_site, const Eigen::Vector2d& place_px) {
    constexpr double kNear = 0.02;   // spacings; what a dot's place errs
    constexpr double kThird = 0.01;  // spacings at a distance of one, by third derivatives
    const double square = from_site.squaredNorm();
    const double weight = 1 / (kNear * kNear + kThird * kThird * square * square * square);
    const double x = from_site.x(), y = from_site.y();
    const std::array<double, kQuadratic + 2> terms = {
        1, x, y, 0.5 * x * x, x * y, 0.5 * y * y, place_px.x(), place_px.y()};
    for (size_t a = 0; a < kQuadratic; ++a) {
      const double weighed = weight * terms[a];
      for (size_t b = 0; b < terms.size(); ++b) system.rows[a][b] += weighed * terms[b];
    }
    ++count;
  }
};

}  // namespace

DotLayout make_dot_layout(const std::vector<Marker>& markers, const std::string& file) {
  DotLayout layout;
  for (size_t i = 0; i < markers.size(); ++i) {
    const Marker& marker = markers[i];
    const int site = static_cast<int>(layout.sites.size());
    if (marker.tag && marker.corner) {
      std::array<int, 4>& corners =
          layout.corner_sites_by_tag
              .try_emplace(*marker.tag, std::array{kNoSite, kNoSite, kNoSite, kNoSite})
              .first->second;
      corners.at(static_cast<size_t>(*marker.corner)) = site;
    }
    layout.sites.push_back({.marker = static_cast<int>(i),
                            .place_m = {marker.s_m, marker.t_m},
                            .is_dot = !marker.tag,
                            .size = 1,
                            .neighbours = {}});
  }
  for (const auto& [tag, corners] : layout.corner_sites_by_tag)
    if (std::ranges::find(corners, kNoSite) != corners.end())
      throw InputError(file, fmt::format("tag {} lacks a corner", tag),
                       "all four corners of every anchor tag");
  layout.spacing_m = dot_spacing_m(layout.sites, file);
  recognise_grid(layout);
  list_neighbours(layout);
  return layout;
}

void list_neighbours(DotLayout& layout) {
  constexpr double kReach = 2.9;  // spacings: two rings, and the corners of the second
  for (DotSite& site : layout.sites) {
    std::vector<std::pair<double, int>> near;
    for (size_t j = 0; j < layout.sites.size(); ++j) {
      const double distance = (layout.sites[j].place_m - site.place_m).norm() / layout.spacing_m;
      if (&layout.sites[j] != &site && distance < kReach)
        near.emplace_back(distance, static_cast<int>(j));
    }
    std::sort(near.begin(), near.end());
    site.neighbours.clear();
    for (const auto& [distance, index] : near) site.neighbours.push_back(index);
  }
}

LocalMap fit_local_map(const DotLayout& layout, int site, const SitePlaces& places,
                       bool with_site) {
  const DotSite& middle = layout.sites[static_cast<size_t>(site)];
  MapEquations equations;
  Eigen::Vector2d origin_px = Eigen::Vector2d::Zero();
  const auto add = [&](int other) {
    const std::optional<Eigen::Vector2d>& place = places[static_cast<size_t>(other)];
    if (!place) return;
    if (equations.count == 0) origin_px = *place;
    const Eigen::Vector2d from_site =
        (layout.sites[static_cast<size_t>(other)].place_m - middle.place_m) / layout.spacing_m;
    equations.add(from_site, *place - origin_px);
  };
  if (with_site) add(site);
  for (const int other : middle.neighbours) add(other);

  LocalMap map;
  map.neighbours = equations.count;
  constexpr int kFewest = 3;
  if (equations.count < kFewest) return map;
  // Everything but the bending is nearly free.
  constexpr double kFree = 3, kBend = 0.4;  // spacings
  const std::array<double, kQuadratic> prior_sd = {0, kFree, kFree, kBend, kBend, kBend};
  auto& system = equations.system;
  for (size_t k = 1; k < kQuadratic; ++k) system.rows[k][k] += 1 / (prior_sd[k] * prior_sd[k]);
  system.right(0, 2) = 1;
  system.eliminate();
  double variance = 0;
  for (size_t k = 0; k < kQuadratic; ++k) variance += system.right(k, 2) * system.right(k, 2);
  map.sigma = std::sqrt(variance);
  for (size_t c = 0; c < 2; ++c) {
    system.substitute(c);
    const auto row = static_cast<Eigen::Index>(c);
    map.place_px[row] = origin_px[row] + system.right(0, c);
    map.jacobian_px.row(row) << system.right(1, c), system.right(2, c);
    map.bend_px[c] << system.right(3, c), system.right(4, c), system.right(4, c),
        system.right(5, c);
  }
  // The larger singular value, in closed form.
  const Eigen::Matrix2d& j = map.jacobian_px;
  const double sum = j.squaredNorm(), product = std::abs(j(0, 0) * j(1, 1) - j(0, 1) * j(1, 0));
  map.scale_px =
      std::sqrt(0.5 * (sum + std::sqrt(std::max(sum * sum - 4 * product * product, 0.0))));
  return map;
}

}  // namespace clothfit
