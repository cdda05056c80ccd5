#include "vision/track/dot_layout.h"

#include <fmt/core.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "data/input_error.h"
#include "data/median.h"

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
constexpr Eigen::Index kQuadratic = 6;

/// The normal equations of a site's map; both coordinates share the matrix.
struct MapEquations {
  Eigen::Matrix<double, kQuadratic, kQuadratic> information =
      Eigen::Matrix<double, kQuadratic, kQuadratic>::Zero();
  Eigen::Matrix<double, kQuadratic, 2> sums = Eigen::Matrix<double, kQuadratic, 2>::Zero();
  int count = 0;

  void add(const Eigen::Vector2d& from_site, const Eigen::Vector2d& place_px) {
    constexpr double kNear = 0.02;   // spacings; what a dot's place errs
    constexpr double kThird = 0.01;  // spacings at a distance of one, by third derivatives
    const double square = from_site.squaredNorm();
    const double weight = 1 / (kNear * kNear + kThird * kThird * square * square * square);
    const double x = from_site.x(), y = from_site.y();
    const Eigen::Matrix<double, kQuadratic, 1> terms({1, x, y, 0.5 * x * x, x * y, 0.5 * y * y});
    information += (weight * terms) * terms.transpose();
    sums += (weight * terms) * place_px.transpose();
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
  const Eigen::Array<double, kQuadratic - 1, 1> prior_sd = {kFree, kFree, kBend, kBend, kBend};
  equations.information.diagonal().tail<kQuadratic - 1>() += prior_sd.square().inverse().matrix();
  const Eigen::LLT<Eigen::Matrix<double, kQuadratic, kQuadratic>> solver(equations.information);
  const Eigen::Matrix<double, kQuadratic, 2> solution = solver.solve(equations.sums);
  map.sigma = std::sqrt(solver.solve(Eigen::Matrix<double, kQuadratic, 1>::Unit(0))[0]);
  map.place_px = origin_px + solution.row(0).transpose();
  map.jacobian_px = solution.middleRows<2>(1).transpose();
  for (Eigen::Index c = 0; c < 2; ++c)
    map.bend_px[static_cast<size_t>(c)] << solution(3, c), solution(4, c), solution(4, c),
        solution(5, c);
  // The larger singular value, in closed form.
  const Eigen::Matrix2d& j = map.jacobian_px;
  const double sum = j.squaredNorm(), product = std::abs(j(0, 0) * j(1, 1) - j(0, 1) * j(1, 0));
  map.scale_px =
      std::sqrt(0.5 * (sum + std::sqrt(std::max(sum * sum - 4 * product * product, 0.0))));
  return map;
}

}  // namespace clothfit
