#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "fit/preflight/checks.h"
#include "fit/preflight/criteria.h"

namespace clothfit {
namespace {

constexpr int kMostExchangeFrames = 120, kFewestExchangeFrames = 10;
constexpr double kMostPlaces = 2e5;  // a marker in a frame each: a second's work
constexpr double kSigmas = 4;

/// Returns the frames to look at, fewer of many markers.
std::vector<int> frames_to_look_at(const RecordedMotion& motion) {
  const auto affordable =
      static_cast<int>(kMostPlaces / static_cast<double>(motion.tracked().size()));
  return motion.sampled_frames(std::clamp(affordable, kFewestExchangeFrames, kMostExchangeFrames));
}

/// The frames in which two markers lie where each other belong.
struct Exchange {
  int frames = 0, first = 0, last = 0;
};

using Pair = std::pair<int, int>;

/// Where each marker's neighbours put it, and by how much it lies elsewhere.
struct Expected {
  Eigen::MatrixXd place;
  std::vector<int> astray;  ///< markers that lie elsewhere by more than `out_of_place`
};

double spacing(const RecordedMotion& motion, int s, int m) {
  const int nearest = motion.neighbours(m).front();
  return motion.units_per_m(s) * (motion.marker_m().col(nearest) - motion.marker_m().col(m)).norm();
}

Expected expected_places(const RecordedMotion& motion, int s, const Eigen::MatrixXd& place) {
  Expected result{.place = Eigen::MatrixXd::Constant(place.rows(), place.cols(), NAN),
                  .astray = {}};
  for (const int m : motion.tracked()) {
    if (!place.col(m).allFinite()) continue;
    const auto expected =
        place_among(motion.marker_m(), place, motion.neighbours(m), motion.marker_m().col(m));
    if (!expected) continue;
    result.place.col(m) = *expected;
    const double noise =
        kSigmas * motion.set(s).noise * std::sqrt(static_cast<double>(place.rows()));
    if ((place.col(m) - *expected).norm() > kPreflight.out_of_place * spacing(motion, s, m) + noise)
      result.astray.push_back(m);
  }
  return result;
}

/// Adds the pairs of markers of one frame that lie in each other's places.
void add_exchanged(const RecordedMotion& motion, int s, int frame,
                   std::map<Pair, Exchange>& found) {
  const Eigen::MatrixXd place = motion.places(s, frame);
  const Expected expected = expected_places(motion, s, place);
  // Where many lie astray the cloth is folded, and its tracks are not exchanged.
  if (static_cast<double>(expected.astray.size()) >
      std::max(2.0, kPreflight.most_exchanged * static_cast<double>(motion.tracked().size())))
    return;
  const auto lies_at = [&](int m, int n) {
    const double near = kPreflight.in_place * spacing(motion, s, n);
    return (place.col(m) - expected.place.col(n)).norm() < near;
  };
  for (size_t a = 0; a < expected.astray.size(); ++a)
    for (size_t b = a + 1; b < expected.astray.size(); ++b) {
      const int m = expected.astray[a], n = expected.astray[b];
      if (!lies_at(m, n) || !lies_at(n, m)) continue;
      Exchange& exchange = found[{m, n}];
      if (exchange.frames++ == 0) exchange.first = frame;
      exchange.last = frame;
    }
}

std::string name_of(const RecordedMotion& motion, int m) {
  return motion.recording().markers.markers[static_cast<size_t>(m)].name;
}

/// Names at most a few of those found.
template <class Items, class Text>
std::string few(const Items& items, const Text& text) {
  constexpr size_t kShown = 4;
  std::string result;
  size_t shown = 0;
  for (const auto& item : items) {
    if (shown == kShown) return result + ", ...";
    result += (shown++ > 0 ? ", " : "") + text(item);
  }
  return result;
}

std::string tracks_file(const RecordedMotion& motion, int s) {
  const Recording& recording = motion.recording();
  if (!motion.set(s).camera) return recording.tracks3d ? recording.tracks3d->string() : "";
  const auto found = recording.tracks2d.find(motion.set(s).kind);
  return found != recording.tracks2d.end() ? found->second.string() : "";
}

bool check_exchanged(const RecordedMotion& motion, int s, CheckList& list) {
  std::map<Pair, Exchange> pairs;
  for (const int f : frames_to_look_at(motion)) add_exchanged(motion, s, f, pairs);
  std::erase_if(pairs,
                [](const auto& pair) { return pair.second.frames < kPreflight.exchanged_frames; });
  if (pairs.empty()) return false;
  list.add("markers", FindingState::warning, tracks_file(motion, s),
           "markers have each other's tracks: " +
               few(pairs,
                   [&](const auto& pair) {
                     return fmt::format(
                         "{} and {} (frames {} to {})", name_of(motion, pair.first.first),
                         name_of(motion, pair.first.second), pair.second.first, pair.second.last);
                   }),
           "markers between their neighbours on the cloth",
           "exchange them back there, or leave them out");
  return true;
}

/// Markers whose track does not change at all for some frames, while those about it move.
bool check_frozen(const RecordedMotion& motion, int s, CheckList& list) {
  std::vector<int> frozen;
  std::vector<int> same(static_cast<size_t>(motion.markers())),
      longest(static_cast<size_t>(motion.markers()));
  Eigen::MatrixXd last = motion.places(s, 0);
  for (int f = 1; f < motion.frames(); ++f) {
    const Eigen::MatrixXd place = motion.places(s, f);
    std::vector<double> steps;
    for (int m = 0; m < motion.markers(); ++m)
      if (const double step = (place.col(m) - last.col(m)).norm(); std::isfinite(step))
        steps.push_back(step);
    std::ranges::sort(steps);
    const bool moves = !steps.empty() && steps[steps.size() / 2] > motion.set(s).noise;
    for (int m = 0; m < motion.markers(); ++m) {
      int& count = same[static_cast<size_t>(m)];
      count = moves && place.col(m) == last.col(m) ? count + 1 : 0;
      longest[static_cast<size_t>(m)] = std::max(longest[static_cast<size_t>(m)], count);
    }
    last = place;
  }
  for (int m = 0; m < motion.markers(); ++m) {
    if (longest[static_cast<size_t>(m)] + 1 < kPreflight.frozen_frames) continue;
    // A held point may rest to the last digit.
    if (distance_to_held_m(motion.recording(), motion.marker_m().col(m)) >
        kPreflight.beside_held * motion.size_m())
      frozen.push_back(m);
  }
  if (frozen.empty()) return false;
  list.add("markers", FindingState::warning, tracks_file(motion, s),
           "tracks stand still to the last digit while the cloth moves: " +
               few(frozen,
                   [&](int m) {
                     return fmt::format("{} ({} frames)", name_of(motion, m),
                                        longest[static_cast<size_t>(m)] + 1);
                   }),
           "no row where a marker was not seen", "leave out what the tracker repeated");
  return true;
}

/// Pairs of markers that lie in one place in many frames: one was followed twice.
bool check_twice(const RecordedMotion& motion, int s, CheckList& list) {
  std::map<Pair, int> together;
  std::vector<int> seen(static_cast<size_t>(motion.markers()));
  const double near = 3 * motion.set(s).noise;
  for (const int f : frames_to_look_at(motion)) {
    const Eigen::MatrixXd place = motion.places(s, f);
    std::vector<int> order;
    for (int m = 0; m < motion.markers(); ++m)
      if (place.col(m).allFinite()) {
        order.push_back(m);
        ++seen[static_cast<size_t>(m)];
      }
    if (order.empty()) continue;
    // Along the coordinate in which they lie farthest apart few are near.
    Eigen::Index axis = 0;
    const Eigen::MatrixXd seen_place = place(Eigen::all, order);
    (seen_place.rowwise().maxCoeff() - seen_place.rowwise().minCoeff()).maxCoeff(&axis);
    std::ranges::sort(order, {}, [&](int m) { return place(axis, m); });
    for (size_t a = 0; a < order.size(); ++a)
      for (size_t b = a + 1;
           b < order.size() && place(axis, order[b]) - place(axis, order[a]) < near; ++b)
        if ((place.col(order[a]) - place.col(order[b])).norm() < near)
          ++together[std::minmax(order[a], order[b])];
  }
  std::erase_if(together, [&](const auto& pair) {
    const auto [m, n] = pair.first;
    const double flat =
        motion.units_per_m(s) * (motion.marker_m().col(m) - motion.marker_m().col(n)).norm();
    return flat < 3 * near || pair.second < kPreflight.frozen_frames ||
           pair.second < kPreflight.twice_share *
                             std::min(seen[static_cast<size_t>(m)], seen[static_cast<size_t>(n)]);
  });
  if (together.empty()) return false;
  list.add("markers", FindingState::warning, tracks_file(motion, s),
           "markers lie in one place: " +
               few(together,
                   [&](const auto& pair) {
                     return fmt::format("{} and {} ({} frames)", name_of(motion, pair.first.first),
                                        name_of(motion, pair.first.second), pair.second);
                   }),
           "markers as far apart as on the cloth", "one of them was followed twice: leave it out");
  return true;
}

/// Says that markers show little of the cloth.
void check_cover(const RecordedMotion& motion, CheckList& list) {
  const Eigen::Matrix2Xd seen = motion.marker_m()(Eigen::all, motion.tracked());
  const Eigen::Vector2d box_m = seen.rowwise().maxCoeff() - seen.rowwise().minCoeff();
  const ClothDescription& cloth = motion.recording().cloth;
  const double share = box_m.x() * box_m.y() / (cloth.width_m * cloth.height_m);
  if (share > kPreflight.covered) return;
  list.add("markers", FindingState::warning, list.file(),
           fmt::format("markers that were seen lie on {:.0f} % of the cloth", 100 * share),
           fmt::format("more than {:.0f} %: what the rest does is a guess of the model's",
                       100 * kPreflight.covered),
           "spread the markers, or give the size of the part that they lie on");
}

}  // namespace

void check_marker_tracks(const RecordedMotion& motion, CheckList& list) {
  constexpr int kFewest = 9;  // between fewer no place can be told
  check_cover(motion, list);
  bool found = false;
  for (int s = 0; s < motion.sets(); ++s) {
    if (std::ssize(motion.tracked()) < kFewest || !(motion.units_per_m(s) > 0)) continue;
    found = check_exchanged(motion, s, list) || found;
    found = check_frozen(motion, s, list) || found;
    found = check_twice(motion, s, list) || found;
  }
  if (!found && std::ssize(motion.tracked()) >= kFewest)
    list.pass("markers", "each marker lies between its neighbours on the cloth");
}

}  // namespace clothfit
