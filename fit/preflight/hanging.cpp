#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "calib/camera/rigid3.h"
#include "fit/preflight/checks.h"
#include "fit/preflight/criteria.h"
#include "fit/preflight/gravity_candidates.h"

namespace clothfit {
namespace {

constexpr int kMostHangingFrames = 60;
constexpr double kAtHeld = 0.1;  // of the cloth's size: markers beside what is held

/// Where cloth hangs, seen from what holds it: means over frames, in units of the first set.
struct Hanging {
  Eigen::VectorXd below;               ///< from the held markers to the middle of all
  std::vector<Eigen::VectorXd> spots;  ///< of the held markers in one frame
};

/// Returns nothing where no marker is near a held point.
std::optional<Hanging> hanging(const RecordedMotion& motion, int most_frames) {
  const auto dimension = motion.set(0).dimension;
  Eigen::VectorXd middle = Eigen::VectorXd::Zero(dimension), held = middle;
  int seen = 0, holding = 0;
  Hanging result;
  for (const int f : motion.sampled_frames(most_frames)) {
    const Eigen::MatrixXd place = motion.places(0, f);
    result.spots.clear();
    for (const int m : motion.tracked()) {
      if (!place.col(m).allFinite()) continue;
      middle += place.col(m);
      ++seen;
      if (distance_to_held_m(motion.recording(), motion.marker_m().col(m)) >
          kAtHeld * motion.size_m())
        continue;
      held += place.col(m);
      result.spots.emplace_back(place.col(m));
      ++holding;
    }
  }
  if (holding == 0 || seen == holding) return std::nullopt;
  result.below = middle / seen - held / holding;
  return result;
}

/// Returns how far the held markers reach along a direction, in units of the set.
double reach(const std::vector<Eigen::VectorXd>& spots, const Eigen::VectorXd& along) {
  double least = INFINITY, most = -INFINITY;
  for (const Eigen::VectorXd& spot : spots) {
    least = std::min(least, spot.dot(along));
    most = std::max(most, spot.dot(along));
  }
  return spots.empty() ? 0 : most - least;
}

/// The direction along which cloth hangs in the mean, of one or two places that hold it.
std::optional<GravityCandidate> gravity_it_hangs_along(const Eigen::Vector3d& below,
                                                       const Eigen::Vector3d& declared) {
  constexpr double kAlong = 0.85, kNotAlong = 0.6;  // cosines
  if (declared.normalized().dot(below.normalized()) > kNotAlong) return std::nullopt;
  for (const GravityCandidate& other : gravity_candidates(declared))
    if (other.m_per_s2.normalized().dot(below.normalized()) > kAlong) return other;
  return std::nullopt;
}

/// Returns gravity's direction as the first set sees it; nothing where it hardly does.
std::optional<Eigen::VectorXd> seen_down(const RecordedMotion& motion) {
  const Eigen::Vector3d down = motion.recording().gravity_m_per_s2.stableNormalized();
  if (!motion.set(0).camera) return down;
  if (!motion.flat_sheet()) return std::nullopt;
  const ClothDescription& cloth = motion.recording().cloth;
  const Eigen::Vector3d middle(0.5 * cloth.width_m, 0.5 * cloth.height_m, 0);
  Eigen::Matrix3d by_position;
  if (!motion.set(0).predict(*motion.flat_sheet() * middle, &by_position)) return std::nullopt;
  const Eigen::VectorXd seen = (by_position * down).head(motion.set(0).dimension);
  // A camera that looks along gravity does not see it.
  if (seen.norm() < 0.5 * motion.units_per_m(0)) return std::nullopt;
  return seen.normalized();
}

/// Says whether all that holds the cloth lies to one side of its middle.
bool is_held_at_one_side(const RecordedMotion& motion) {
  constexpr double kAside = 0.25;  // of the cloth's size
  const ClothDescription& cloth = motion.recording().cloth;
  Eigen::Vector2d mean_m = Eigen::Vector2d::Zero();
  int near = 0;
  for (const int m : motion.tracked()) {
    const Eigen::Vector2d at_m = motion.marker_m().col(m);
    if (distance_to_held_m(motion.recording(), at_m) > kAtHeld * motion.size_m()) continue;
    mean_m += at_m;
    ++near;
  }
  if (near == 0) return false;
  const Eigen::Vector2d middle_m(0.5 * cloth.width_m, 0.5 * cloth.height_m);
  return (mean_m / near - middle_m).norm() > kAside * motion.size_m();
}

}  // namespace

std::optional<GravityCandidate> hangs_along(const RecordedMotion& motion) {
  if (motion.recording().held.empty() || motion.set(0).camera) return std::nullopt;
  const auto hangs = hanging(motion, kMostHangingFrames);
  if (!hangs) return std::nullopt;
  return gravity_it_hangs_along(hangs->below, motion.recording().gravity_m_per_s2);
}

void check_hanging(const RecordedMotion& motion, CheckList& list) {
  const Recording& recording = motion.recording();
  // A sheet that is let go says more by how it starts.
  if (recording.start == StartKind::released_flat || recording.held.empty() || is_carried(motion) ||
      motion.first_frame(0) < 0 || !(motion.units_per_m(0) > 0))
    return;
  const bool at_rest = recording.start == StartKind::at_rest;
  const auto hangs = hanging(motion, at_rest ? 1 : kMostHangingFrames);
  const auto down = seen_down(motion);
  if (!hangs || !down) return;
  // A flag is held at its side: its middle may lie anywhere.
  const double size = motion.size_m() * motion.units_per_m(0);
  if (reach(hangs->spots, *down) > kPreflight.held_at_side * size) return;
  const double share = hangs->below.dot(*down) / size;
  const std::string found =
      fmt::format("the markers' middle lies {:.3g} mm {} what holds the cloth",
                  1e3 * std::abs(share) * motion.size_m(), share < 0 ? "above" : "below");
  const Eigen::Vector3d& gravity = recording.gravity_m_per_s2;
  const std::string expected =
      "a cloth that hangs below it, along the declared gravity " + vector_text(gravity);
  std::optional<GravityCandidate> other;
  if (!motion.set(0).camera) other = gravity_it_hangs_along(hangs->below, gravity);
  const std::string remedy =
      other ? gravity_text(*other) + " would explain it; a wind or a stiff cloth would too"
            : "look at gravity's sign and axis, and at the held points";
  // Stiff cloth may stick out at a side while it rests, or be an arch between two; it does not
  // stand on one.
  const bool stands = share < -kPreflight.above_held;
  if (stands && at_rest && is_held_at_one_side(motion) && !moves_by_effects(recording))
    list.refuse("gravity", found, expected, remedy);
  else if (stands || other)
    list.warn("gravity", found, expected, remedy);
  else if (share > kPreflight.above_held)
    list.pass("gravity", found);
}

}  // namespace clothfit
