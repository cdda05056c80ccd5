#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "calib/camera/projection.h"
#include "calib/camera/rigid3.h"
#include "data/median.h"
#include "fit/observe/sheet_placement.h"
#include "fit/preflight/checks.h"
#include "fit/preflight/criteria.h"

namespace clothfit {
namespace {

/// Another assignment of markers to places: the marker m lies where `of[m]` is declared to lie.
struct Order {
  std::string name;
  std::vector<int> of;
};

/// Returns the marker of each corner of each tag.
std::map<int, std::map<int, int>> tags_of(const MarkerSet& markers) {
  std::map<int, std::map<int, int>> tags;
  for (size_t m = 0; m < markers.markers.size(); ++m) {
    const Marker& marker = markers.markers[m];
    if (marker.tag && marker.corner) tags[*marker.tag][*marker.corner] = static_cast<int>(m);
  }
  return tags;
}

/// The seven other orders of the corners of all tags: turned, and mirrored.
std::vector<Order> corner_orders(const MarkerSet& markers) {
  std::vector<Order> orders;
  const auto tags = tags_of(markers);
  if (tags.empty()) return orders;
  const auto add = [&](const std::string& name, const auto& corner_of) {
    Order order{.name = name, .of = std::vector<int>(markers.markers.size())};
    for (size_t m = 0; m < order.of.size(); ++m) order.of[m] = static_cast<int>(m);
    for (const auto& [tag, corners] : tags)
      for (const auto& [corner, marker] : corners)
        if (const auto found = corners.find(corner_of(corner)); found != corners.end())
          order.of[static_cast<size_t>(marker)] = found->second;
    orders.push_back(std::move(order));
  };
  constexpr const char* kTurned[] = {"", "a quarter turn to the left", "upside down",
                                     "a quarter turn to the right"};
  for (int k = 1; k < 4; ++k)
    add(fmt::format("the corners of every tag are numbered {}", kTurned[k]),
        [k](int corner) { return (corner + k) % 4; });
  for (int k = 0; k < 4; ++k)
    add(fmt::format("the corners of every tag are numbered the other way round, with corner 0 "
                    "where corner {} belongs",
                    k),
        [k](int corner) { return (k - corner + 4) % 4; });
  return orders;
}

/// Row by row in place of column by column, or the other way, for markers that fill a grid.
std::vector<Order> grid_orders(const Eigen::Matrix2Xd& marker_m) {
  std::set<double> s, t;
  for (Eigen::Index m = 0; m < marker_m.cols(); ++m) {
    s.insert(marker_m(0, m));
    t.insert(marker_m(1, m));
  }
  const auto columns = static_cast<int>(s.size()), rows = static_cast<int>(t.size());
  const auto count = static_cast<int>(marker_m.cols());
  if (columns * rows != count || columns < 2 || rows < 2 || columns == rows) return {};
  std::vector<Order> orders;
  for (const bool by_rows : {true, false}) {
    Order order{.name = by_rows ? "rows and columns are exchanged: markers are listed row by row, "
                                  "and tracked column by column"
                                : "rows and columns are exchanged: markers are listed column by "
                                  "column, and tracked row by row",
                .of = std::vector<int>(static_cast<size_t>(count))};
    for (int m = 0; m < count; ++m)
      order.of[static_cast<size_t>(m)] =
          by_rows ? m % rows * columns + m / rows : m % columns * rows + m / columns;
    orders.push_back(std::move(order));
  }
  return orders;
}

Eigen::Matrix2Xd reordered(const Eigen::Matrix2Xd& marker_m, const Order& order) {
  return marker_m(Eigen::all, order.of);
}

/// Returns by how much markers lie beside where their neighbours on the cloth put them: the median,
/// as a share of the distance to the nearest one. Empty where that cannot be told.
std::optional<double> disorder(const Eigen::Matrix2Xd& marker_m, const RecordedMotion& motion,
                               int s) {
  constexpr int kNear = 12;
  // The place among neighbours is hardly noisy, so that one end of the distance is.
  constexpr double kOfNoise = 0.7, kClear = 4;
  constexpr int kFewest = 8, kMost = 400;
  const std::vector<int>& tracked = motion.tracked();
  const Eigen::MatrixXd place = motion.places(s, motion.first_frame(s));
  const double noise_m = motion.noise_m(s);
  const size_t stride = std::max<size_t>(1, tracked.size() / kMost);
  std::vector<double> shares;
  for (size_t k = 0; k < tracked.size(); k += stride) {
    const int m = tracked[k];
    if (!place.col(m).allFinite()) continue;
    std::vector<int> near = nearest_markers(marker_m, tracked, marker_m.col(m), kNear + 1);
    std::erase(near, m);
    if (near.empty()) continue;
    const auto expected = place_among(marker_m, place, near, marker_m.col(m));
    const double spacing_m = (marker_m.col(near.front()) - marker_m.col(m)).norm();
    // Markers nearer to each other than their noise lie in no order.
    if (expected && spacing_m > kClear * noise_m)
      shares.push_back(
          distance_less_noise(place.col(m) - *expected, kOfNoise * motion.set(s).noise) /
          (motion.units_per_m(s) * spacing_m));
  }
  if (std::ssize(shares) < kFewest) return std::nullopt;
  return median(std::move(shares));
}

/// Finds out whether markers lie in the order that is declared. Returns whether they do.
bool check_order(const RecordedMotion& motion, int s, CheckList& list) {
  const int frame = motion.first_frame(s);
  if (frame < 0) return true;
  if (!(motion.units_per_m(s) > 0)) return true;
  const auto as_declared = disorder(motion.marker_m(), motion, s);
  if (!as_declared) return true;
  const MarkerSet& markers = motion.recording().markers;
  std::vector<Order> orders = corner_orders(markers);
  std::ranges::move(grid_orders(motion.marker_m()), std::back_inserter(orders));
  double least = *as_declared;
  const Order* best = nullptr;
  for (const Order& order : orders) {
    const auto found = disorder(reordered(motion.marker_m(), order), motion, s);
    if (found && *found < kPreflight.better_order * *as_declared && *found < least) {
      least = *found;
      best = &order;
    }
  }
  const std::string file = motion.recording().markers_file.empty()
                               ? list.file()
                               : motion.recording().markers_file.string();
  const std::string found = fmt::format(
      "in frame {} half of the markers of {} lie more than {:.2g} of a marker's distance beside "
      "where their neighbours put them",
      frame, motion.set(s).kind, *as_declared);
  if (best != nullptr && *as_declared > kPreflight.ordered) {
    list.add("first sheet", FindingState::refused, file, found,
             fmt::format("{:.2g} if {}", least, best->name), "correct the order in that file");
    return false;
  }
  // Crumpled cloth may look like that.
  const bool is_flat = motion.recording().start == StartKind::released_flat;
  if (*as_declared > (is_flat ? kPreflight.disordered : kPreflight.disordered_folded)) {
    list.add("first sheet", is_flat ? FindingState::refused : FindingState::warning, file, found,
             "markers that lie in the tracks as they lie on the cloth",
             "look at names, s and t of the markers: none of the usual exchanges explains it");
    return false;
  }
  return true;
}

/// Tags are read from their printed side. Where that turns away, s, t or both are mirrored.
bool check_side(const RecordedMotion& motion, int s, const Rigid3& world_from_sheet,
                CheckList& list) {
  const ObservationSet& set = motion.set(s);
  if (!set.camera || motion.recording().markers.kind != MarkerKind::apriltag) return true;
  const ClothDescription& cloth = motion.recording().cloth;
  const Rigid3 camera_from_sheet = camera_from_world(*set.camera) * world_from_sheet;
  const Eigen::Vector3d middle =
      camera_from_sheet * Eigen::Vector3d(0.5 * cloth.width_m, 0.5 * cloth.height_m, 0);
  // Axes s and t and the line of sight are right-handed where the printed side is seen.
  if ((camera_from_sheet.rotation * Eigen::Vector3d::UnitZ()).dot(middle) > 0) return true;
  list.add("first sheet", FindingState::refused, motion.recording().markers_file.string(),
           fmt::format("by s and t of the markers camera '{}' sees the back of the sheet, where no "
                       "tags are",
                       set.kind),
           "s to the right and t down, as seen from the printed side",
           "s or t is mirrored, or they are exchanged: correct them in that file");
  return false;
}

/// How far a marker lies beside the flat sheet in the first frame.
struct OffSheet {
  double distance_m = 0;
  int marker = 0;
};

/// Returns that of all markers, over all sets.
std::vector<OffSheet> off_sheet(const RecordedMotion& motion, const Rigid3& world_from_sheet,
                                double& noise_m) {
  std::vector<OffSheet> off;
  noise_m = 0;
  for (int s = 0; s < motion.sets(); ++s) {
    const ObservationSet& set = motion.set(s);
    const double units_per_m = motion.units_per_m(s);
    if (!(units_per_m > 0)) continue;
    noise_m = std::max(noise_m, set.noise / units_per_m);
    for (const Observation& row : set.rows) {
      if (row.frame > 0) break;
      const Eigen::Vector2d flat = motion.marker_m().col(row.marker);
      const auto expected = set.predict(world_from_sheet * Eigen::Vector3d(flat.x(), flat.y(), 0));
      if (expected)
        off.push_back(
            {.distance_m = (row.observed - *expected).norm() / units_per_m, .marker = row.marker});
    }
  }
  return off;
}

/// Names a few markers that lie far beside the sheet where all others lie in it: s and t are wrong,
/// or the row is.
void check_strays(const RecordedMotion& motion, const std::vector<OffSheet>& off, double usual_m,
                  CheckList& list) {
  std::vector<std::string> strays;
  for (const OffSheet& one : off) {
    if (motion.neighbours(one.marker).empty()) continue;
    const int nearest = motion.neighbours(one.marker).front();
    const double spacing_m =
        (motion.marker_m().col(nearest) - motion.marker_m().col(one.marker)).norm();
    if (one.distance_m > std::max(kPreflight.stray * usual_m, kPreflight.out_of_place * spacing_m))
      strays.push_back(
          fmt::format("{} by {:.3g} mm",
                      motion.recording().markers.markers[static_cast<size_t>(one.marker)].name,
                      1e3 * one.distance_m));
  }
  constexpr size_t kMost = 6;
  if (strays.empty() || strays.size() > kMost || 10 * strays.size() > off.size()) return;
  list.add("markers", FindingState::warning, motion.recording().markers_file.string(),
           fmt::format("in frame 0 markers lie beside their place in the sheet: {}",
                       fmt::join(strays, ", ")),
           "markers where s and t say", "correct s and t, or leave out the row");
}

/// Returns how far a camera is from the middle of the sheet that it sees.
double camera_distance_m(const RecordedMotion& motion, int s, const Rigid3& world_from_sheet) {
  const ClothDescription& cloth = motion.recording().cloth;
  const Eigen::Vector3d middle(0.5 * cloth.width_m, 0.5 * cloth.height_m, 0);
  return (camera_from_world(*motion.set(s).camera) * (world_from_sheet * middle)).norm();
}

/// Returns the distance of the farthest of several cameras. Their poses are off by angles, which
/// matter where one sheet is to be seen in one place. It is 0 of a single one.
double farthest_camera_m(const RecordedMotion& motion) {
  double farthest_m = 0;
  for (int s = 0; s < motion.sets() && motion.sets() > 1; ++s)
    if (motion.set(s).camera && motion.flat_sheet())
      farthest_m = std::max(farthest_m, camera_distance_m(motion, s, *motion.flat_sheet()));
  return farthest_m;
}

void check_flat(const RecordedMotion& motion, const Rigid3& world_from_sheet, CheckList& list) {
  double noise_m = 0;
  std::vector<OffSheet> off = off_sheet(motion, world_from_sheet, noise_m);
  if (off.empty()) return;
  std::ranges::sort(off, {}, &OffSheet::distance_m);
  const double most_m = off[(9 * off.size() + 9) / 10 - 1].distance_m;
  check_strays(motion, off, most_m, list);
  constexpr double kNineOfTen = 2.5;  // sigmas, of distances in space
  const double noise = kNineOfTen * noise_m + kPreflight.pose_off * farthest_camera_m(motion);
  const double size_m = motion.size_m();
  const std::string found =
      fmt::format("nine of ten of {} markers in frame 0 lie within {:.2g} mm of a flat sheet",
                  off.size(), 1e3 * most_m);
  const std::string expected =
      fmt::format("start: released_flat says that it is flat (noise {:.2g} mm)", 1e3 * noise_m);
  const char* remedy =
      "give start: unknown, or cut the recording to where it is flat; if it is flat, look at the "
      "cloth's size, the camera and the markers";
  if (most_m > noise + kPreflight.sheet_refused * size_m)
    list.refuse("first sheet", found, expected, remedy);
  else if (most_m > noise + kPreflight.sheet_warned * size_m)
    list.warn("first sheet", found, expected, remedy);
  else
    list.pass("first sheet", found);
}

/// Cameras must see the sheet in one place of the world.
void check_cameras(const RecordedMotion& motion, CheckList& list) {
  const ClothDescription& cloth = motion.recording().cloth;
  const Eigen::Vector3d middle(0.5 * cloth.width_m, 0.5 * cloth.height_m, 0);
  std::vector<std::pair<std::string, Eigen::Vector3d>> seen;
  double camera_m = 0;
  for (int s = 0; s < motion.sets() && motion.sets() > 1; ++s)
    if (const auto sheet = place_flat_sheet(std::vector{motion.set(s)}, motion.marker_m(), 1)) {
      seen.emplace_back(motion.set(s).kind, *sheet * middle);
      camera_m = std::max(camera_m, camera_distance_m(motion, s, *sheet));
    }
  for (size_t k = 1; k < seen.size(); ++k) {
    const double apart_m = (seen[k].second - seen[0].second).norm();
    if (apart_m < std::max(kPreflight.cameras_apart * motion.size_m(),
                           kPreflight.cameras_apart_far * camera_m))
      continue;
    const bool far = apart_m > kPreflight.cameras_refused * camera_m;
    list.add("cameras", far ? FindingState::refused : FindingState::warning, list.file(),
             fmt::format("cameras '{}' and '{}' see the sheet's middle in frame 0 {:.3g} mm apart",
                         seen[0].first, seen[k].first, 1e3 * apart_m),
             "one place in the world",
             "look at their poses (metres, camera_from_world), the cloth's size, and whether they "
             "show one moment");
  }
}

}  // namespace

void check_first_sheet(const RecordedMotion& motion, CheckList& list) {
  bool in_order = true;
  for (int s = 0; s < motion.sets(); ++s) in_order = check_order(motion, s, list) && in_order;
  if (in_order) check_proportions(motion, list);
  if (list.refused() || motion.recording().start != StartKind::released_flat) return;
  const std::optional<Rigid3>& world_from_sheet = motion.flat_sheet();
  if (!world_from_sheet) return;
  for (int s = 0; s < motion.sets(); ++s)
    if (!check_side(motion, s, *world_from_sheet, list)) return;
  check_cameras(motion, list);
  check_flat(motion, *world_from_sheet, list);
}

}  // namespace clothfit
