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

constexpr int kMostHeldFrames = 200, kFewestHeldFrames = 30;
constexpr double kMostHeldPlaces = 1e6;  // a marker in a frame each: a second's work

/// Returns a marker's places in frames that show it, each the median over three neighbouring ones
/// by coordinate: one bad row is no motion.
std::vector<Eigen::VectorXd> steady_track(const std::vector<Eigen::MatrixXd>& frames, int marker) {
  std::vector<Eigen::VectorXd> seen, steady;
  for (const Eigen::MatrixXd& place : frames)
    if (place.col(marker).allFinite()) seen.emplace_back(place.col(marker));
  for (size_t k = 0; k + 2 < seen.size(); ++k) {
    Eigen::VectorXd place(seen[k].size());
    for (Eigen::Index c = 0; c < place.size(); ++c)
      place[c] = median({seen[k][c], seen[k + 1][c], seen[k + 2][c]});
    steady.push_back(std::move(place));
  }
  return steady;
}

/// Returns the place of a track that is farthest from another.
Eigen::VectorXd farthest(const std::vector<Eigen::VectorXd>& track, const Eigen::VectorXd& from) {
  return *std::ranges::max_element(
      track, {}, [&](const Eigen::VectorXd& place) { return (place - from).norm(); });
}

/// Returns about the largest distance between two places of a track.
double reach_of(const std::vector<Eigen::VectorXd>& track) {
  const Eigen::VectorXd end = farthest(track, track.front());
  return (farthest(track, end) - end).norm();
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

/// Returns frames to look at, from the first that shows enough markers.
std::vector<Eigen::MatrixXd> places_in(const RecordedMotion& motion, int s) {
  std::vector<Eigen::MatrixXd> frames;
  const auto affordable =
      static_cast<int>(kMostHeldPlaces / static_cast<double>(motion.tracked().size()));
  for (const int f :
       motion.sampled_frames(std::clamp(affordable, kFewestHeldFrames, kMostHeldFrames)))
    if (f >= motion.first_frame(s)) frames.push_back(motion.places(s, f));
  return frames;
}

/// How far a marker goes that no fixed point so near would let it go.
struct BeyondReach {
  double way_m = 0;  ///< 0 where it keeps to the point
  int marker = -1;
};

/// Looks at the markers nearest to a place that is said to rest; nothing where there are none. All
/// places of a marker beside it lie in a ball around it, as wide as they are apart on the cloth.
std::optional<BeyondReach> beyond_reach(const RecordedMotion& motion, int s,
                                        const std::vector<Eigen::MatrixXd>& frames,
                                        const HeldPlace& held) {
  constexpr double kStretch = 1.25;  // cloth between the point and the marker, and perspective
  constexpr int kNear = 2;
  constexpr double kThere_m = 1e-6;
  const double units_per_m = motion.units_per_m(s);
  std::optional<BeyondReach> result;
  for (const int m : motion.nearest(held.at_m, kNear)) {
    const double flat_m = (motion.marker_m().col(m) - held.at_m).norm();
    if (flat_m > kPreflight.near_held * motion.size_m()) continue;
    const std::vector<Eigen::VectorXd> track = steady_track(frames, m);
    if (track.empty()) continue;
    if (!result) result = BeyondReach{};
    const double way = flat_m < kThere_m ? (farthest(track, track.front()) - track.front()).norm()
                                         : 0.5 * reach_of(track);
    const double noise = kPreflight.held_sigmas * motion.set(s).noise;
    const double beyond_m = (way - noise) / units_per_m - kStretch * flat_m;
    if (beyond_m > result->way_m) *result = {.way_m = beyond_m + noise / units_per_m, .marker = m};
  }
  return result;
}

/// Returns markers that rest in all frames, and are seen in most, of a cloth that moves.
std::vector<int> resting_markers(const RecordedMotion& motion, int s,
                                 const std::vector<Eigen::MatrixXd>& frames) {
  const double limit = kPreflight.still_sigmas * motion.set(s).noise;
  std::vector<int> resting;
  std::vector<double> ways;
  for (const int m : motion.tracked()) {
    const std::vector<Eigen::VectorXd> track = steady_track(frames, m);
    if (track.empty()) continue;
    const double way = (farthest(track, track.front()) - track.front()).norm();
    ways.push_back(way);
    if (way < limit && 2 * track.size() > frames.size()) resting.push_back(m);
  }
  constexpr double kMoves = 5;  // times what rests may
  if (ways.empty() || median(ways) < kMoves * limit) return {};
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
  bool all_rest = true, looked = false;
  for (const HeldPlace& held : fixed) {
    const auto beyond = beyond_reach(motion, s, frames, held);
    looked = looked || beyond.has_value();
    if (!beyond || beyond->way_m < kPreflight.held_share * motion.size_m()) continue;
    const auto [way_m, marker] = *beyond;
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
    // A track that is another marker's may be to blame.
    if (is_free && !list.warns_of("markers"))
      list.refuse("held points", found, "a point that stays where it is", remedy);
    else
      list.warn("held points", found, "a point that stays where it is", remedy);
    if (is_free) return;  // what holds the cloth is elsewhere
  }
  if (all_rest && looked) list.pass("held points", "markers keep to the points that are fixed");
}

/// Median way of the markers between two frames, m; infinite where none is seen in both.
double median_way_m(const RecordedMotion& motion, int s, const Eigen::MatrixXd& from,
                    const Eigen::MatrixXd& to) {
  std::vector<double> ways;
  for (int m = 0; m < motion.markers(); ++m) {
    const Eigen::VectorXd way = to.col(m) - from.col(m);
    if (way.allFinite()) ways.push_back(way.norm() / motion.units_per_m(s));
  }
  return ways.empty() ? INFINITY : median(std::move(ways));
}

/// A cloth that nothing holds falls, a light one slowly, and does not stop in the air.
void check_nothing_held(const RecordedMotion& motion, int s,
                        const std::vector<Eigen::MatrixXd>& frames, const std::vector<int>& resting,
                        CheckList& list) {
  const Recording& recording = motion.recording();
  if (is_carried(motion) || frames.size() < 3) return;
  const double t_s = motion.time_s().back() - motion.time_s().front();
  const double fall_m = 0.5 * recording.gravity_m_per_s2.norm() * t_s * t_s;
  const double moved_m = median_way_m(motion, s, frames.front(), frames.back()),
               later_m = median_way_m(motion, s, frames[frames.size() / 2], frames.back());
  if (!std::isfinite(moved_m)) return;
  constexpr double kFar = 2, kShareOfFall = 0.3, kStops = 0.1;
  const bool hardly_falls =
      fall_m > kFar * motion.size_m() && moved_m < kShareOfFall * fall_m && !motion.set(s).camera;
  const bool stops = later_m < kStops * motion.size_m();
  const std::string found =
      fmt::format("nothing is held, and half of the markers move by less than {:.3g} m in {:.3g} s",
                  moved_m, t_s);
  const std::string remedy =
      "say under `held` what holds the cloth" +
      (resting.empty() ? std::string() : ": at rest are " + names_of(motion, resting));
  // A few places that rest are clips; many lie on something that is not declared.
  const bool by_clips =
      !resting.empty() && static_cast<double>(resting.size()) <
                              kPreflight.clips * static_cast<double>(motion.tracked().size());
  if (hardly_falls && by_clips && recording.declared.empty())
    list.refuse("held points", found, fmt::format("a fall by {:.3g} m", fall_m), remedy);
  else if (hardly_falls && (stops || !resting.empty()))
    list.warn("held points", found, fmt::format("a fall by {:.3g} m", fall_m), remedy);
  else if (!resting.empty())
    list.warn("held points", "nothing is held, but markers rest", "a cloth that falls", remedy);
}

/// Markers far from what is held that rest while the cloth moves are held by something.
void check_others(const RecordedMotion& motion, const std::vector<int>& resting, CheckList& list) {
  if (is_carried(motion)) return;
  std::vector<int> others;
  for (const int m : resting)
    if (distance_to_held_m(motion.recording(), motion.marker_m().col(m)) >
        kPreflight.beside_held * motion.size_m())
      others.push_back(m);
  if (others.empty()) return;
  list.warn("held points",
            fmt::format("markers rest that are not held: {}", names_of(motion, others)),
            "cloth that is free", "is it held there, or did the tracker lose them?");
}

}  // namespace

void check_held_points(const RecordedMotion& motion, CheckList& list) {
  // A support that is declared to move, or to slip, does so.
  const bool supports_move = std::ranges::any_of(
      motion.recording().declared,
      [](const DeclaredEffect& effect) { return effect.name.starts_with("support_"); });
  if (supports_move) return;
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
