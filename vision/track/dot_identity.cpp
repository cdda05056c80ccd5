#include "vision/track/dot_identity.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <set>

#include "data/median.h"
#include "data/parallel.h"

namespace clothfit {
namespace {

// What a dot may deviate from its neighbours' prediction. The map's sigma is what smooth cloth
// does; a sharper fold deviates more, and a wrong neighbour by a whole spacing.
constexpr double kGateSigmas = 4;
constexpr double kLeastGate = 0.08;  // spacings as they appear where nothing is foreshortened
constexpr double kMostGate = 0.35;   // of the spacing as it appears in that direction

constexpr double kNoRatio = 1e9;  // of an outline without area

/// Returns how far a place is from the expected one: 1 is as far as is let through.
double gate_distance(const LocalMap& map, const Eigen::Vector2d& place_px) {
  const Eigen::Vector2d off_px = place_px - map.place_px;
  const double own = std::max(kGateSigmas * map.sigma, kLeastGate) * map.scale_px;
  const Eigen::Matrix2d& j = map.jacobian_px;
  const double determinant = j(0, 0) * j(1, 1) - j(0, 1) * j(1, 0);
  Eigen::Matrix2d inverse;
  inverse << j(1, 1), -j(0, 1), -j(1, 0), j(0, 0);
  const double in_spacings = (inverse * off_px).norm() / std::max(std::abs(determinant), 1e-9);
  return std::max(off_px.norm() / own, in_spacings / kMostGate);
}

/// A site that may be placed next.
struct Frontier {
  double sigma = 0;
  int site = 0;
  bool operator<(const Frontier& other) const {
    return sigma != other.sigma ? sigma < other.sigma : site < other.site;
  }
};

/// Grows the placed set over found dots.
class Growth {
 public:
  Growth(const DotLayout& layout, const std::vector<Dot>& found, PlacedDots& placed)
      : layout_(layout), found_(found), placed_(placed), taken_(found.size(), false) {
    for (size_t i = 0; i < found.size(); ++i)
      for (const std::optional<Dot>& dot : placed.dots)
        if (dot && dot->outline.centre_px == found[i].outline.centre_px) taken_[i] = true;
  }

  void run();

 private:
  /// Puts an unplaced dot into the queue with its present prediction.
  void consider(int site);
  /// Index of the only found dot that agrees with the site's neighbours; -1 without one.
  int only_match(int site, const LocalMap& map) const;

  static constexpr double kSureEnough = 0.45;  // spacings; two rows in line, and no more, give 0.4
  const DotLayout& layout_;
  const std::vector<Dot>& found_;
  PlacedDots& placed_;
  std::vector<bool> taken_;
  std::set<Frontier> queue_;
  DotScale scale_;
};

void Growth::consider(int site) {
  const DotSite& here = layout_.sites[static_cast<size_t>(site)];
  if (!here.is_dot || placed_.places[static_cast<size_t>(site)]) return;
  const LocalMap map = fit_local_map(layout_, site, placed_.places, false);
  if (map.neighbours >= 3 && map.sigma < kSureEnough)
    queue_.insert({.sigma = map.sigma, .site = site});
}

int Growth::only_match(int site, const LocalMap& map) const {
  const double size = layout_.sites[static_cast<size_t>(site)].size;
  int match = -1;
  for (size_t i = 0; i < found_.size(); ++i) {
    const Dot& dot = found_[i];
    if (taken_[i] || !agrees(map, dot, scale_, size) ||
        !has_links(layout_, placed_, scale_, site, dot))
      continue;
    if (match >= 0) return -1;
    match = static_cast<int>(i);
  }
  return match;
}

void Growth::run() {
  for (size_t site = 0; site < layout_.sites.size(); ++site) consider(static_cast<int>(site));
  int placed = 0;
  while (!queue_.empty()) {
    const int site = queue_.begin()->site;
    queue_.erase(queue_.begin());
    if (placed_.places[static_cast<size_t>(site)]) continue;
    const LocalMap map = fit_local_map(layout_, site, placed_.places, false);
    const int match = only_match(site, map);
    if (match < 0) continue;
    taken_[static_cast<size_t>(match)] = true;
    placed_.place(site, found_[static_cast<size_t>(match)]);
    constexpr int kSettled = 30;  // dots after which the scale no longer changes much
    if (layout_.sizes_known && ++placed <= kSettled && placed % 5 == 0)
      scale_ = measure_dot_scale(layout_, placed_, survey(layout_, placed_));
    for (const int other : layout_.sites[static_cast<size_t>(site)].neighbours) consider(other);
  }
}

/// Removes both of two sites whose dots lie within each other.
void remove_shared_dots(const DotLayout& layout, PlacedDots& placed, std::vector<int>& left_out) {
  std::vector<int> shared;
  for (size_t i = 0; i < layout.sites.size(); ++i) {
    if (!placed.dots[i]) continue;
    const double radius = placed.dots[i]->outline.radii_px()[0];
    for (size_t j = i + 1; j < layout.sites.size(); ++j) {
      if (!placed.dots[j]) continue;
      if ((*placed.places[i] - *placed.places[j]).squaredNorm() > radius * radius) continue;
      shared.push_back(static_cast<int>(i));
      shared.push_back(static_cast<int>(j));
    }
  }
  for (const int site : shared) {
    if (!placed.dots[static_cast<size_t>(site)]) continue;
    placed.remove(site);
    left_out.push_back(site);
  }
}

}  // namespace

void PlacedDots::place(int site, const Dot& dot) {
  dots[static_cast<size_t>(site)] = dot;
  places[static_cast<size_t>(site)] = dot.outline.centre_px;
}

void PlacedDots::remove(int site) {
  dots[static_cast<size_t>(site)].reset();
  places[static_cast<size_t>(site)].reset();
}

int PlacedDots::count() const {
  return static_cast<int>(
      std::ranges::count_if(dots, [](const std::optional<Dot>& dot) { return dot.has_value(); }));
}

std::vector<LocalMap> survey(const DotLayout& layout, const PlacedDots& placed) {
  std::vector<LocalMap> maps(layout.sites.size());
  for_each_index(maps.size(), [&](size_t site) {
    if (placed.dots[site])
      maps[site] = fit_local_map(layout, static_cast<int>(site), placed.places, true);
  });
  return maps;
}

DotScale measure_dot_scale(const DotLayout& layout, const PlacedDots& placed,
                           const std::vector<LocalMap>& maps) {
  std::vector<double> radii;
  for (size_t site = 0; site < layout.sites.size(); ++site) {
    const LocalMap& map = maps[site];
    constexpr double kSure = 0.1;
    if (!placed.dots[site] || map.neighbours < 4 || map.sigma > kSure) continue;
    const double area = std::abs(map.jacobian_px.determinant());
    radii.push_back(std::sqrt(placed.dots[site]->outline.area_px2() / (M_PI * area)) /
                    layout.sites[site].size);
  }
  constexpr size_t kFewest = 5;
  if (radii.size() < kFewest) return {};
  return {.radius = median(std::move(radii))};
}

Eigen::Matrix2d expected_shape_px2(const LocalMap& map, double radius) {
  return radius * radius * map.jacobian_px * map.jacobian_px.transpose();
}

double shape_ratio(const Eigen::Matrix2d& a_px2, const Eigen::Matrix2d& b_px2) {
  const double determinant = b_px2.determinant();
  if (!(determinant > 0)) return kNoRatio;
  // Eigenvalues of b^-1 a: squared ratios along the axes that both have in common.
  const double mean =
      0.5 *
      (b_px2(1, 1) * a_px2(0, 0) + b_px2(0, 0) * a_px2(1, 1) - 2 * b_px2(0, 1) * a_px2(0, 1)) /
      determinant;
  const double product = a_px2.determinant() / determinant;
  const double half = std::sqrt(std::max(mean * mean - product, 0.0));
  if (!(mean - half > 0)) return kNoRatio;
  return std::sqrt(std::max(mean + half, 1 / (mean - half)));
}

bool agrees(const LocalMap& map, const Dot& dot, const DotScale& scale, double size) {
  if (gate_distance(map, dot.outline.centre_px) > 1) return false;
  if (!scale.radius) return true;
  // Folds bend the map within a spacing, so that outlines differ from those of its slope. A dot
  // that placed ones do not surround may be one beyond a fold, which has another outline.
  constexpr double kSurrounded = 0.1;  // spacings
  const double largest_ratio = map.sigma < kSurrounded ? 1.6 : 1.45;
  const double thick_px = 0.5 + dot.blur_px;  // what a thin outline may err by
  Eigen::Matrix2d expected = expected_shape_px2(map, *scale.radius * size);
  expected.diagonal().array() += 0.25 * thick_px * thick_px;
  Eigen::Matrix2d shape = dot.outline.shape_px2;
  shape.diagonal().array() += 0.25 * thick_px * thick_px;
  return shape_ratio(shape, expected) < largest_ratio;
}

bool is_linked(const DotEnd& from, const Eigen::Vector2d& place_px, double apart,
               const DotEnd& other) {
  // Where foreshortening changes by a factor r over the way, the outlines at its ends see it
  // (1 + r) / 2 and (1 + 1 / r) / 2 times as long: 2 and 0.67 for r = 3, 1.15 in the mean.
  constexpr double kMostOff = 1.25, kMostOffAlone = 1.9;
  const Eigen::Vector2d way = place_px - from.dot->outline.centre_px;
  const auto length = [&](const DotEnd& end) {
    const double thick_px = 0.3 + 0.3 * end.dot->blur_px;  // what a thin outline may err by
    Eigen::Matrix2d shape = end.dot->outline.shape_px2;
    shape.diagonal().array() += thick_px * thick_px;
    const double determinant = shape.determinant();
    const double square = (shape(1, 1) * way.x() * way.x() - 2 * shape(0, 1) * way.x() * way.y() +
                           shape(0, 0) * way.y() * way.y()) /
                          determinant;
    return end.radius * std::sqrt(square) / apart;
  };
  if (!other.dot) {
    const double off = length(from);
    return off < kMostOffAlone && off > 1 / kMostOffAlone;
  }
  const double one = length(from), two = length(other);
  const double off = std::sqrt(one * two);
  return off < kMostOff && off > 1 / kMostOff && std::max(one, two) < kMostOffAlone &&
         std::min(one, two) > 1 / kMostOffAlone;
}

namespace {

constexpr double kLinkReach = 1.5;  // spacings: the eight around

/// Calls `each(neighbour, linked)` for the placed dots around a dot put at a site.
template <class Each>
void for_each_link(const DotLayout& layout, const PlacedDots& placed, double scale, int site,
                   const Dot& dot, Each each) {
  const DotSite& here = layout.sites[static_cast<size_t>(site)];
  for (const int other : here.neighbours) {
    const DotSite& there = layout.sites[static_cast<size_t>(other)];
    const double apart = (there.place_m - here.place_m).norm() / layout.spacing_m;
    if (apart > kLinkReach) return;
    const std::optional<Dot>& neighbour = placed.dots[static_cast<size_t>(other)];
    if (!neighbour) continue;
    each(other, is_linked({.dot = &dot, .radius = scale * here.size}, neighbour->outline.centre_px,
                          apart, {.dot = &*neighbour, .radius = scale * there.size}));
  }
}

}  // namespace

bool has_links(const DotLayout& layout, const PlacedDots& placed, const DotScale& scale, int site,
               const Dot& dot) {
  if (!scale.radius) return true;
  int good = 0, bad = 0;
  for_each_link(layout, placed, *scale.radius, site, dot,
                [&](int, bool linked) { ++(linked ? good : bad); });
  return good + bad == 0 || (good > 1 && good > 4 * bad);
}

std::vector<int> linked_groups(const DotLayout& layout, const PlacedDots& placed,
                               const DotScale& scale) {
  std::vector<int> group(layout.sites.size(), -1);
  int count = 0;
  std::vector<int> stack;
  for (size_t seed = 0; seed < group.size(); ++seed) {
    if (!placed.dots[seed] || group[seed] >= 0) continue;
    group[seed] = count;
    stack.assign(1, static_cast<int>(seed));
    while (!stack.empty()) {
      const int site = stack.back();
      stack.pop_back();
      for_each_link(layout, placed, scale.radius.value_or(0), site,
                    *placed.dots[static_cast<size_t>(site)], [&](int other, bool linked) {
                      if (!linked || group[static_cast<size_t>(other)] >= 0) return;
                      group[static_cast<size_t>(other)] = count;
                      stack.push_back(other);
                    });
    }
    ++count;
  }
  return group;
}

std::vector<bool> linked_with_tags(const DotLayout& layout, const PlacedDots& placed,
                                   const DotScale& scale) {
  std::vector<bool> linked(layout.sites.size(), false);
  for (size_t site = 0; site < linked.size(); ++site) {
    if (!placed.dots[site]) continue;
    const DotSite& here = layout.sites[site];
    for (const int other : here.neighbours) {
      const DotSite& there = layout.sites[static_cast<size_t>(other)];
      const double apart = (there.place_m - here.place_m).norm() / layout.spacing_m;
      if (apart > kLinkReach) break;
      if (there.is_dot || !placed.places[static_cast<size_t>(other)]) continue;
      if (is_linked({.dot = &*placed.dots[site], .radius = scale.radius.value_or(0) * here.size},
                    *placed.places[static_cast<size_t>(other)], apart))
        linked[site] = true;
    }
  }
  return linked;
}

void grow_identities(const DotLayout& layout, const std::vector<Dot>& found, PlacedDots& placed) {
  Growth(layout, found, placed).run();
}

std::vector<int> leave_out_conflicts(const DotLayout& layout, PlacedDots& placed) {
  std::vector<int> left_out;
  remove_shared_dots(layout, placed, left_out);
  std::vector<double> conflict(layout.sites.size(), 0);
  const auto judge = [&](size_t site) {
    if (!placed.dots[site]) return 0.0;
    const LocalMap map = fit_local_map(layout, static_cast<int>(site), placed.places, false);
    if (map.neighbours < 3) return 1e6;
    return gate_distance(map, *placed.places[site]);
  };
  for_each_index(conflict.size(), [&](size_t site) { conflict[site] = judge(site); });
  while (true) {
    const auto worst = std::max_element(conflict.begin(), conflict.end());
    if (*worst <= 1) return left_out;
    const int site = static_cast<int>(worst - conflict.begin());
    placed.remove(site);
    left_out.push_back(site);
    *worst = 0;
    for (const int other : layout.sites[static_cast<size_t>(site)].neighbours)
      conflict[static_cast<size_t>(other)] = judge(static_cast<size_t>(other));
  }
}

}  // namespace clothfit
