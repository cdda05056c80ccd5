#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "data/median.h"
#include "fit/preflight/checks.h"
#include "fit/preflight/criteria.h"

namespace clothfit {
namespace {

constexpr int kMostHeldFrames = 200;

/// The largest way of a marker from a place, of the medians over three neighbouring frames: one bad
/// row is no motion. In units of the set; NaN where it was hardly seen.
double largest_way(const std::vector<Eigen::MatrixXd>& frames, int marker,
                   const Eigen::VectorXd& from) {
  std::vector<double> ways;
  for (const Eigen::MatrixXd& place : frames)
    if (place.col(marker).allFinite()) ways.push_back((place.col(marker) - from).norm());
  if (ways.size() < 3) return NAN;
  double largest = 0;
  for (size_t k = 0; k + 2 < ways.size(); ++k)
    largest = std::max(largest, median({ways[k], ways[k + 1], ways[k + 2]}));
  return largest;
}

struct HeldPlace {
  std::string name;
  Eigen::Vector2d at_m;
};

/// Returns the places that are said to rest.
std::vector<HeldPlace> fixed_places(const Recording& recording) {
  std::vector<HeldPlace> places;
  const double width_m = recording.cloth.width_m, height_m = recording.cloth.height_m;
  for (const HeldPoint& point : recording.held) {
    if (point.motion != HeldMotion::fixed) continue;
    if (!point.edge) {
      places.push_back(
          {fmt::format("the held point ({:g}, {:g})", point.at_m.x(), point.at_m.y()), point.at_m});
      continue;
    }
    const std::string name = fmt::format("the held edge {}", to_string(*point.edge));
    for (const double along : {0.0, 0.5, 1.0}) {
      switch (*point.edge) {
        case ClothEdge::top:
          places.push_back({name, {along * width_m, 0}});
          break;
        case ClothEdge::bottom:
          places.push_back({name, {along * width_m, height_m}});
          break;
        case ClothEdge::left:
          places.push_back({name, {0, along * height_m}});
          break;
        case ClothEdge::right:
          places.push_back({name, {width_m, along * height_m}});
          break;
      }
    }
  }
  return places;
}

std::vector<Eigen::MatrixXd> places_in(const RecordedMotion& motion, int s) {
  std::vector<Eigen::MatrixXd> frames;
  for (const int f : motion.sampled_frames(kMostHeldFrames)) frames.push_back(motion.places(s, f));
  return frames;
}

/// The way of a marker that no fixed point so near would let it go, m; 0 where it keeps to it.
double beyond_reach_m(const RecordedMotion& motion, int s,
                      const std::vector<Eigen::MatrixXd>& frames, const HeldPlace& held,
                      int* nearest) {
  constexpr int kNear = 12;
  constexpr double kStretch = 1.25;  // cloth between the point and the marker, and perspective
  const std::vector<int> near = motion.nearest(held.at_m, kNear);
  const auto from = place_among(motion.marker_m(), frames.front(), near, held.at_m);
  if (!from) return 0;
  const double units_per_m = motion.units_per_m(s);
  double most_m = 0;
  for (size_t k = 0; k < std::min<size_t>(2, near.size()); ++k) {
    const int m = near[k];
    const double flat_m = (motion.marker_m().col(m) - held.at_m).norm();
    if (flat_m > 0.3 * motion.size_m()) continue;
    const bool is_there = flat_m < 1e-6;
    const Eigen::VectorXd begin = is_there && frames.front().col(m).allFinite()
                                      ? Eigen::VectorXd(frames.front().col(m))
                                      : *from;
    const double way = largest_way(frames, m, begin);
    const double noise = kPreflight.held_sigmas * motion.set(s).noise;
    if (!std::isfinite(way)) continue;
    const double beyond_m = (way - noise) / units_per_m - kStretch * flat_m;
    if (beyond_m <= most_m) continue;
    most_m = beyond_m + noise / units_per_m;
    *nearest = m;
  }
  return most_m;
}

/// Returns markers that rest in all frames, of a cloth that moves.
std::vector<int> resting_markers(const RecordedMotion& motion, int s,
                                 const std::vector<Eigen::MatrixXd>& frames) {
  const double limit = kPreflight.still_sigmas * motion.set(s).noise;
  std::vector<int> resting;
  std::vector<double> ways;
  for (const int m : motion.tracked()) {
    const auto first = std::ranges::find_if(
        frames, [&](const Eigen::MatrixXd& place) { return place.col(m).allFinite(); });
    if (first == frames.end()) continue;
    const double way = largest_way(frames, m, first->col(m));
    if (!std::isfinite(way)) continue;
    ways.push_back(way);
    if (way < limit) resting.push_back(m);
  }
  if (ways.empty() || median(ways) < 5 * limit) return {};
  return resting;
}

std::string names_of(const RecordedMotion& motion, const std::vector<int>& markers) {
  constexpr size_t kShown = 4;
  std::string text;
  for (size_t k = 0; k < std::min(kShown, markers.size()); ++k) {
    const Marker& marker = motion.recording().markers.markers[static_cast<size_t>(markers[k])];
    text +=
        fmt::format("{}{} at ({:g}, {:g})", k > 0 ? ", " : "", marker.name, marker.s_m, marker.t_m);
  }
  return text + (markers.size() > kShown ? ", ..." : "");
}

/// Other ways to lay s and t on the cloth; x and y are shares of its width and height.
struct Layout {
  const char* name;
  Eigen::Vector2d (*place)(const Eigen::Vector2d& share);
};

constexpr Layout kLayouts[] = {
    {"with s mirrored", [](const Eigen::Vector2d& p) { return Eigen::Vector2d(1 - p.x(), p.y()); }},
    {"with t mirrored", [](const Eigen::Vector2d& p) { return Eigen::Vector2d(p.x(), 1 - p.y()); }},
    {"with the sheet turned upside down",
     [](const Eigen::Vector2d& p) { return Eigen::Vector2d(1 - p.x(), 1 - p.y()); }},
    {"with s and t exchanged",
     [](const Eigen::Vector2d& p) { return Eigen::Vector2d(p.y(), p.x()); }},
    {"with the sheet turned by a quarter",
     [](const Eigen::Vector2d& p) { return Eigen::Vector2d(p.y(), 1 - p.x()); }},
    {"with the sheet turned by a quarter",
     [](const Eigen::Vector2d& p) { return Eigen::Vector2d(1 - p.y(), p.x()); }},
    {"with s and t exchanged and mirrored",
     [](const Eigen::Vector2d& p) { return Eigen::Vector2d(1 - p.y(), 1 - p.x()); }}};

/// Says how s and t would have to lie for the held points to rest; empty where that does not help.
std::string resting_layout(const RecordedMotion& motion, const std::vector<HeldPlace>& fixed,
                           const std::vector<int>& resting) {
  constexpr double kNear = 0.1;
  const Eigen::Vector2d size_m(motion.recording().cloth.width_m, motion.recording().cloth.height_m);
  const auto rests = [&](const Eigen::Vector2d& share) {
    return std::ranges::any_of(resting, [&](int m) {
      return (motion.marker_m().col(m).cwiseQuotient(size_m) - share).norm() < kNear;
    });
  };
  for (const Layout& layout : kLayouts)
    if (std::ranges::all_of(fixed, [&](const HeldPlace& held) {
          return rests(layout.place(held.at_m.cwiseQuotient(size_m)));
        }))
      return fmt::format("; {} they would be the held points", layout.name);
  return "";
}

void check_fixed(const RecordedMotion& motion, int s, const std::vector<Eigen::MatrixXd>& frames,
                 const std::vector<int>& resting, CheckList& list) {
  const std::vector<HeldPlace> fixed = fixed_places(motion.recording());
  bool all_rest = !fixed.empty();
  for (const HeldPlace& held : fixed) {
    int marker = -1;
    const double way_m = beyond_reach_m(motion, s, frames, held, &marker);
    if (way_m < kPreflight.held_share * motion.size_m()) continue;
    all_rest = false;
    const std::string found = fmt::format(
        "{} is fixed, but by marker {} it moves by up to {:.3g} mm", held.name,
        motion.recording().markers.markers[static_cast<size_t>(marker)].name, 1e3 * way_m);
    const bool is_free = way_m > kPreflight.held_refused * motion.size_m();
    std::string remedy = is_free ? "say what holds the cloth: is s or t mirrored, or are they "
                                   "exchanged? does it move along (motion: tracked or path)?"
                                 : "give motion: tracked, or fit support_move or support_slip";
    if (is_free && !resting.empty())
      remedy +=
          " At rest are " + names_of(motion, resting) + resting_layout(motion, fixed, resting);
    if (is_free)
      list.refuse("held points", found, "a point that stays where it is", remedy);
    else
      list.warn("held points", found, "a point that stays where it is", remedy);
    if (is_free) return;  // what holds the cloth is elsewhere
  }
  if (all_rest) list.pass("held points", "markers keep to the points that are fixed");
}

/// A cloth that nothing holds falls.
void check_nothing_held(const RecordedMotion& motion, int s,
                        const std::vector<Eigen::MatrixXd>& frames, const std::vector<int>& resting,
                        CheckList& list) {
  const Recording& recording = motion.recording();
  if (is_carried(recording)) return;
  const double t_s = motion.time_s().back() - motion.time_s().front();
  const double fall_m = 0.5 * recording.gravity_m_per_s2.norm() * t_s * t_s;
  std::vector<double> ways;
  for (int m = 0; m < motion.markers(); ++m) {
    const Eigen::VectorXd way = frames.back().col(m) - frames.front().col(m);
    if (way.allFinite()) ways.push_back(way.norm() / motion.units_per_m(s));
  }
  if (ways.empty()) return;
  const double moved_m = median(ways);
  const std::string found =
      fmt::format("nothing is held, and half of the markers move by less than {:.3g} m in {:.3g} s",
                  moved_m, t_s);
  if (fall_m > 2 * motion.size_m() && moved_m < 0.3 * fall_m && !motion.set(s).camera)
    list.refuse(
        "held points", found, fmt::format("a fall by {:.3g} m", fall_m),
        "say under `held` what holds the cloth" +
            (resting.empty() ? std::string() : ": at rest are " + names_of(motion, resting)));
  else if (!resting.empty())
    list.warn("held points",
              fmt::format("nothing is held, but markers rest: {}", names_of(motion, resting)),
              "a cloth that falls", "say under `held` what holds the cloth");
}

/// Markers far from what is held that rest while the cloth moves are held by something.
void check_others(const RecordedMotion& motion, const std::vector<int>& resting, CheckList& list) {
  if (is_carried(motion.recording())) return;
  std::vector<int> others;
  for (const int m : resting) {
    double nearest_m = INFINITY;
    for (const HeldPoint& point : motion.recording().held)
      nearest_m =
          std::min(nearest_m, point.edge ? 0 : (point.at_m - motion.marker_m().col(m)).norm());
    if (nearest_m > 0.15 * motion.size_m()) others.push_back(m);
  }
  if (others.empty()) return;
  list.warn("held points",
            fmt::format("markers rest that are not held: {}", names_of(motion, others)),
            "cloth that is free", "is it held there, or did the tracker lose them?");
}

}  // namespace

void check_held_points(const RecordedMotion& motion, CheckList& list) {
  for (int s = 0; s < motion.sets(); ++s) {
    if (!(motion.units_per_m(s) > 0)) continue;
    const std::vector<Eigen::MatrixXd> frames = places_in(motion, s);
    const std::vector<int> resting = resting_markers(motion, s, frames);
    const CheckList before = list;
    if (motion.recording().held.empty()) {
      check_nothing_held(motion, s, frames, resting, list);
    } else {
      check_fixed(motion, s, frames, resting, list);
      if (!list.refused()) check_others(motion, resting, list);
    }
    // One observer's finding is enough.
    if (list.findings().size() > before.findings().size() &&
        list.findings().back().state != FindingState::passed)
      return;
  }
}

}  // namespace clothfit
