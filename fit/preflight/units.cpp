#include <fmt/format.h>

#include <algorithm>
#include <cmath>
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

struct Unit {
  double per_m;
  const char* name;
};

/// Lengths that people write without saying so.
constexpr Unit kUnits[] = {{1000, "millimetres"},
                           {100, "centimetres"},
                           {10, "decimetres"},
                           {39.37, "inches"},
                           {3.281, "feet"}};

/// Asks whether lengths were given in another unit than metres; empty where none explains the
/// factor.
std::string asked_unit(double factor, const std::string& lengths) {
  for (const Unit& unit : kUnits)
    if (std::abs(std::log(factor / unit.per_m)) < std::log(1.15))
      return fmt::format("{} in {}?", lengths, unit.name);
  return "";
}

/// Median ratio of distances in space to those on the cloth, over neighbours of which the line
/// keeps within a few degrees to an axis of the cloth (0: s, 1: t). 0 where there are none.
double scale_along(const RecordedMotion& motion, int s, const Eigen::MatrixXd& place, int axis) {
  constexpr double kAlong = 0.1;
  std::vector<double> ratios;
  for (const int m : motion.tracked())
    for (const int n : motion.neighbours(m)) {
      const Eigen::Vector2d flat = motion.marker_m().col(n) - motion.marker_m().col(m);
      if (std::abs(flat[1 - axis]) > kAlong * std::abs(flat[axis])) continue;
      const Eigen::VectorXd step = place.col(n) - place.col(m);
      if (step.allFinite())
        ratios.push_back(distance_less_noise(step, motion.set(s).noise) / flat.norm());
    }
  return ratios.empty() ? 0 : median(ratios);
}

/// Ratio of the markers' spread in space to that on the cloth, whatever their order.
double spread_ratio(const RecordedMotion& motion, const Eigen::MatrixXd& place) {
  std::vector<int> seen;
  for (const int m : motion.tracked())
    if (place.col(m).allFinite()) seen.push_back(m);
  const auto spread = [](const Eigen::MatrixXd& points) {
    return (points.colwise() - points.rowwise().mean().eval()).norm();
  };
  return spread(place(Eigen::all, seen)) / spread(motion.marker_m()(Eigen::all, seen));
}

/// Returns what distances in space may be of those on the cloth, at least.
double least_scale(StartKind start) {
  switch (start) {
    case StartKind::released_flat:
      return 1 / kPreflight.scale_refused;
    case StartKind::at_rest:
      return kPreflight.folded;
    case StartKind::unknown:
      return kPreflight.crumpled;
  }
  return 0;
}

void check_scale(const RecordedMotion& motion, int s, CheckList& list) {
  const double scale = motion.units_per_m(s);
  if (!(scale > 0)) return;
  const double spread = spread_ratio(motion, motion.places(s, motion.first_frame(s)));
  // Markers in another order are far from their neighbours, and spread as far as ever.
  const double refused = kPreflight.scale_refused;
  const double least = least_scale(motion.recording().start);
  if (std::min(scale, spread) > refused || std::max(scale, spread) < least) {
    const std::string asked = scale > 1 ? asked_unit(scale, "are the tracks")
                                        : asked_unit(1 / scale, "are the cloth's size, s and t");
    return list.refuse("units",
                       fmt::format("distances in frame {} are {:.4g} times those on the cloth",
                                   motion.first_frame(s), scale),
                       "about 1: the cloth's size, s, t and 3D tracks are all in metres", asked);
  }
  const std::string found =
      fmt::format("neighbouring markers are {:.3f} times as far apart as on the cloth", scale);
  // Folds bring markers nearer to each other; nothing but a pull takes them apart.
  if (motion.recording().start != StartKind::released_flat && scale > 1 + kPreflight.scale_warned)
    return list.warn("units", found, "at most 1, for cloth that hardly stretches",
                     "measure the cloth's size and the print's scale");
  list.pass("units", found);
}

/// Holds a camera's distance from the sheet against that from the reference points.
void check_reference(const RecordedMotion& motion, int s, CheckList& list) {
  const Recording& recording = motion.recording();
  const ObservationSet& set = motion.set(s);
  if (recording.reference.empty() || !set.camera || !set.camera->camera_from_world) return;
  const auto sheet = place_flat_sheet(std::vector{set}, motion.marker_m(), 1);
  if (!sheet) return;
  const Rigid3 camera = camera_from_world(*set.camera);
  std::vector<double> distances_m;
  for (const ReferencePoint& point : recording.reference)
    distances_m.push_back((camera * Eigen::Vector3d(point.x_m, point.y_m, point.z_m)).norm());
  const Eigen::Vector3d middle(0.5 * recording.cloth.width_m, 0.5 * recording.cloth.height_m, 0);
  const double reference_m = median(distances_m), sheet_m = (camera * (*sheet * middle)).norm();
  const double ratio = reference_m / sheet_m;
  const std::string found = fmt::format(
      "camera '{}' is {:.3g} m from the reference points, and {:.3g} m from the cloth "
      "if that is as large as stated",
      set.kind, reference_m, sheet_m);
  if (ratio < kPreflight.reference_distance && ratio > 1 / kPreflight.reference_distance)
    return list.pass("units", found);
  const std::string asked = ratio > 1 ? asked_unit(ratio, "are the reference points")
                                      : asked_unit(1 / ratio, "are the cloth's size, s and t");
  list.refuse("units", found, "distances of one size", asked);
}

}  // namespace

void check_units(const RecordedMotion& motion, CheckList& list) {
  for (int s = 0; s < motion.sets(); ++s) {
    if (motion.set(s).camera)
      check_reference(motion, s, list);
    else
      check_scale(motion, s, list);
  }
}

void check_proportions(const RecordedMotion& motion, CheckList& list) {
  // A shape that is not flat shortens distances, and may do so along one side.
  if (motion.recording().start != StartKind::released_flat || motion.set(0).camera) return;
  if (motion.first_frame(0) < 0) return;
  const Eigen::MatrixXd place = motion.places(0, motion.first_frame(0));
  const double along_s = scale_along(motion, 0, place, 0),
               along_t = scale_along(motion, 0, place, 1);
  if (!(along_s > 0 && along_t > 0)) return;
  const ClothDescription& cloth = motion.recording().cloth;
  const double ratio = along_s / along_t;
  const double of_exchanged = std::pow(cloth.height_m / cloth.width_m, 2);
  const std::string found = fmt::format(
      "neighbouring markers are {:.3g} times as far apart along s as on the cloth, {:.3g} along t",
      along_s, along_t);
  if (std::max(ratio, 1 / ratio) > kPreflight.sides_alike) {
    const bool exchanged = std::abs(std::log(ratio / of_exchanged)) < std::log(1.1);
    list.refuse("units", found, "1 and 1",
                exchanged ? "size is [width along s, height along t]: are they exchanged?"
                          : "look at the cloth's size and at s and t of the markers");
  } else if (std::abs(motion.units_per_m(0) - 1) > kPreflight.scale_warned) {
    list.warn("units", found, "1 and 1 where the sheet is flat",
              "measure the cloth's size and the print's scale");
  }
}

}  // namespace clothfit
