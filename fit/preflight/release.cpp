#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "calib/camera/rigid3.h"
#include "fit/observe/sheet_placement.h"
#include "fit/preflight/checks.h"
#include "fit/preflight/criteria.h"

namespace clothfit {
namespace {

/// The mean motion of the free part of a sheet along a direction since frame 0, by frame.
struct MotionAlong {
  std::vector<double> moved_m, sigma_m;  ///< sigma infinite where nothing was seen
  std::vector<double> explained;         ///< share of the markers' motion, as it is seen
};

/// Tells how far markers are from where frame 0 shows them, by frame: the root of their mean square
/// in any direction, less what noise makes of it. NaN where nothing was seen.
struct MovedMarkers {
  std::vector<double> distance_m;
  std::vector<double> seen_m;  ///< from so far on it is no noise
};

MovedMarkers moved_markers(const RecordedMotion& motion) {
  const auto frames = static_cast<size_t>(motion.frames());
  std::vector<double> square(frames), count(frames), variance(frames);
  for (int s = 0; s < motion.sets(); ++s) {
    const double units_per_m = motion.units_per_m(s);
    if (!(units_per_m > 0)) continue;
    const Eigen::MatrixXd first = motion.places(s, 0);
    for (const Observation& row : motion.set(s).rows) {
      const auto dimension = first.rows();
      const Eigen::VectorXd step = row.observed.head(dimension) - first.col(row.marker);
      if (!step.allFinite()) continue;
      const double noise = 2 * static_cast<double>(dimension) * row.sigma * row.sigma;
      const auto f = static_cast<size_t>(row.frame);
      square[f] += (step.squaredNorm() - noise) / (units_per_m * units_per_m);
      variance[f] += 2 * noise * noise / static_cast<double>(dimension) / std::pow(units_per_m, 4);
      count[f] += 1;
    }
  }
  constexpr double kDeviations = 4;
  MovedMarkers moved;
  for (size_t f = 0; f < frames; ++f) {
    const double n = count[f];
    moved.distance_m.push_back(n > 0 ? std::sqrt(std::max(0.0, square[f] / n)) : NAN);
    moved.seen_m.push_back(n > 0 ? std::sqrt(kDeviations * std::sqrt(variance[f]) / n) : NAN);
  }
  return moved;
}

/// Says how far a point of the cloth is from what is held; infinite where nothing is.
double distance_to_held_m(const Recording& recording, const Eigen::Vector2d& place_m) {
  double nearest_m = INFINITY;
  for (const HeldPoint& point : recording.held) {
    double distance_m = (point.at_m - place_m).norm();
    if (point.edge) {
      switch (*point.edge) {
        case ClothEdge::top:
          distance_m = place_m.y();
          break;
        case ClothEdge::bottom:
          distance_m = recording.cloth.height_m - place_m.y();
          break;
        case ClothEdge::left:
          distance_m = place_m.x();
          break;
        case ClothEdge::right:
          distance_m = recording.cloth.width_m - place_m.x();
          break;
      }
    }
    nearest_m = std::min(nearest_m, distance_m);
  }
  return nearest_m;
}

MotionAlong motion_along(const RecordedMotion& motion, const Rigid3& world_from_sheet,
                         const Eigen::Vector3d& direction) {
  constexpr double kFree = 0.3;  // of the cloth's size
  const auto frames = static_cast<size_t>(motion.frames());
  std::vector<double> information(frames), pull(frames), all(frames);
  std::vector<char> is_free;
  for (int m = 0; m < motion.markers(); ++m)
    is_free.push_back(distance_to_held_m(motion.recording(), motion.marker_m().col(m)) >
                      kFree * motion.size_m());
  for (int s = 0; s < motion.sets(); ++s)
    for (const Observation& row : motion.set(s).rows) {
      if (is_free[static_cast<size_t>(row.marker)] == 0) continue;
      const Eigen::Vector2d flat = motion.marker_m().col(row.marker);
      Eigen::Matrix3d by_position;
      const auto start = motion.set(s).predict(
          world_from_sheet * Eigen::Vector3d(flat.x(), flat.y(), 0), &by_position);
      if (!start) continue;
      const Eigen::Vector3d along = by_position * direction / row.sigma,
                            moved = (row.observed - *start) / row.sigma;
      information[static_cast<size_t>(row.frame)] += along.squaredNorm();
      pull[static_cast<size_t>(row.frame)] += along.dot(moved);
      all[static_cast<size_t>(row.frame)] += moved.squaredNorm();
    }
  MotionAlong result;
  for (size_t f = 0; f < frames; ++f) {
    const bool seen = information[f] > 0;
    result.moved_m.push_back(seen ? pull[f] / information[f] : 0);
    result.sigma_m.push_back(seen ? 1 / std::sqrt(information[f]) : INFINITY);
    result.explained.push_back(seen ? pull[f] * pull[f] / information[f] / all[f] : 0);
  }
  // What the placement of the sheet is off by is no motion.
  const double first_m = result.moved_m.front();
  for (double& moved_m : result.moved_m) moved_m -= first_m;
  return result;
}

/// A sheet let go at frame 0, at rest or with a speed.
struct Release {
  double acceleration = 0;   ///< m/s2
  double speed = 0;          ///< at frame 0, m/s
  double misfit = INFINITY;  ///< mean square, in sigmas
};

/// Fits d = speed t + acceleration t^2 / 2 over the frames; `with_speed` or not.
Release fit_parabola(const std::vector<double>& t_s, const MotionAlong& motion, int frames,
                     bool with_speed) {
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  const auto basis = [&](int f) -> Eigen::Vector2d {
    const double t = t_s[static_cast<size_t>(f)] - t_s[0];
    return {0.5 * t * t, with_speed ? t : 0};
  };
  for (int f = 1; f < frames; ++f) {
    const double weight = std::pow(motion.sigma_m[static_cast<size_t>(f)], -2);
    normal += weight * basis(f) * basis(f).transpose();
    right += weight * motion.moved_m[static_cast<size_t>(f)] * basis(f);
  }
  if (!with_speed) normal(1, 1) = 1;
  if (!(std::abs(normal.determinant()) > 0)) return {};
  const Eigen::Vector2d found = normal.inverse() * right;
  double sum = 0;
  for (int f = 1; f < frames; ++f)
    sum += std::pow((motion.moved_m[static_cast<size_t>(f)] - found.dot(basis(f))) /
                        motion.sigma_m[static_cast<size_t>(f)],
                    2);
  return {.acceleration = found[0], .speed = found[1], .misfit = sum / std::max(1, frames - 1)};
}

struct ReleaseSight {
  const RecordedMotion& motion;
  const Rigid3& world_from_sheet;
  double weight = 0;  ///< gravity along the normal, m/s2, > 0
};

/// Finds the frame in which a sheet is let go that stands still before. Returns whether that is
/// frame 0, or near it.
bool check_moment(const RecordedMotion& motion, double weight, CheckList& list) {
  constexpr double kStill = 0.01;  // of the cloth's size
  const MovedMarkers moved = moved_markers(motion);
  const std::vector<double>& moved_m = moved.distance_m;
  const std::vector<double>& t_s = motion.time_s();
  const double still_m = kStill * motion.size_m();
  size_t moves = 1;
  while (moves < moved_m.size() && !(moved_m[moves] > still_m)) ++moves;
  if (moves == moved_m.size()) {
    list.refuse("release",
                fmt::format("markers move by less than {:.2g} mm in all {} frames", 1e3 * still_m,
                            motion.frames()),
                "start: released_flat says that the sheet is let go at frame 0",
                "nothing can be fitted to a cloth that does not move: is something holding it?");
    return false;
  }
  // The way grows with the square of the time since, so its root does with the time.
  double released_s = 0;
  constexpr size_t kLookedAt = 3;
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  for (size_t f = moves; f < std::min(moves + kLookedAt, moved_m.size()); ++f) {
    if (!std::isfinite(moved_m[f])) continue;
    const Eigen::Vector2d by(1, t_s[f] - t_s[0]);
    normal += by * by.transpose();
    right += std::sqrt(moved_m[f]) * by;
  }
  if (!(std::abs(normal.determinant()) > 0)) return true;
  const Eigen::Vector2d line = normal.inverse() * right;
  if (line[1] > 0) released_s = -line[0] / line[1];
  const double frame_s = (t_s[moves] - t_s[0]) / static_cast<double>(moves);
  // A sheet that nothing but its weight moves does not start earlier than this.
  const double falls_s = std::sqrt(2 * moved_m[moves] / weight);
  const double still = std::min(released_s, t_s[moves] - t_s[0] - 0.5 * falls_s) / frame_s;
  if (still < kPreflight.still_frames) return true;
  // The last frame that shows no motion, near there.
  const auto near = static_cast<size_t>(still);
  size_t last = near;
  for (size_t f = near; f < std::min(near + 3, moves); ++f)
    if (!(moved_m[f] > moved.seen_m[f])) last = f;
  list.refuse("release",
              fmt::format("the sheet stands still until frame {}: up to there markers move by less "
                          "than {:.2g} mm, by frame {} by {:.2g} mm",
                          last, 1e3 * std::max(moved_m[last], moved.seen_m[last]), moves,
                          1e3 * moved_m[moves]),
              "start: released_flat says that it is let go at frame 0",
              fmt::format("cut the recording so that it begins with frame {}", last));
  return false;
}

/// Directions that gravity may have instead.
struct Gravity {
  std::string name;
  Eigen::Vector3d m_per_s2;
};

std::vector<Gravity> other_gravities(const Eigen::Vector3d& declared) {
  const double size = declared.norm();
  std::vector<Gravity> others{{"turned round", -declared}};
  constexpr std::array kAxes{"x", "y", "z"};
  for (int axis = 0; axis < 3; ++axis)
    for (const int sign : {-1, 1}) {
      const Eigen::Vector3d g = sign * size * Eigen::Vector3d::Unit(axis);
      if (std::abs(g.normalized().dot(declared.normalized())) < 0.9)
        others.push_back(
            {fmt::format("along {}{}", sign > 0 ? "+" : "-", kAxes[static_cast<size_t>(axis)]), g});
    }
  return others;
}

/// Rates that people write for another.
std::string asked_rate(const Recording& recording, double acceleration_ratio) {
  if (!recording.frame_rate_hz || !(acceleration_ratio > 0)) return "";
  const double rate_hz = *recording.frame_rate_hz / std::sqrt(acceleration_ratio);
  for (const double usual : {24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 90.0, 100.0, 120.0, 200.0, 240.0})
    if (std::abs(std::log(rate_hz / usual)) < std::log(1.06) &&
        std::abs(std::log(usual / *recording.frame_rate_hz)) > std::log(1.1))
      return fmt::format("a frame rate of {:.0f} Hz in place of {:g}", usual,
                         *recording.frame_rate_hz);
  return "";
}

/// Says that gravity or the frame times are wrong; `ratio` is that of the acceleration seen to the
/// one declared, 1 where they agree.
void judge_ratio(const Recording& recording, double ratio, const std::string& found,
                 const std::string& explained, CheckList& list) {
  if (ratio < kPreflight.gravity_warned && ratio > 1 / kPreflight.gravity_warned)
    return list.pass("gravity", found);
  const std::string rate = asked_rate(recording, ratio);
  std::string remedy = explained + (explained.empty() || rate.empty() ? "" : " or ") + rate;
  if (!remedy.empty())
    remedy += " would explain it";
  else
    remedy =
        "look at gravity's sign, axis and size and at the frame rate; a strong wind would do "
        "it too, and is to be declared";
  const bool certain = ratio > kPreflight.gravity_refused || ratio < 1 / kPreflight.gravity_refused;
  // A declared force may push as hard as the weight.
  if (certain && recording.declared.empty())
    list.refuse("gravity", found, "a ratio near 1", remedy);
  else
    list.warn("gravity", found, "a ratio near 1", remedy);
}

std::string vector_text(const Eigen::Vector3d& v) {
  const auto shown = [](double number) { return std::round(100 * number) / 100 + 0.0; };
  return fmt::format("[{:g}, {:g}, {:g}]", shown(v.x()), shown(v.y()), shown(v.z()));
}

std::string explaining(const Gravity& other) {
  return fmt::format("gravity {}, {},", other.name, vector_text(other.m_per_s2));
}

/// Over a twentieth of its size the sheet is still nearly flat.
int frames_of_release(const RecordedMotion& motion) {
  const std::vector<double> moved_m = moved_markers(motion).distance_m;
  int frames = 1;
  while (frames < motion.frames() &&
         !(moved_m[static_cast<size_t>(frames)] > 0.05 * motion.size_m()))
    ++frames;
  return std::clamp(frames, 4, motion.frames());
}

/// Holds a sheet in space against its weight. All springs of a flat sheet lie in it, so that the
/// first force across it is the weight's: it moves by (g . n) t^2 / 2 wherever nothing is held
/// near, whatever the fabric is.
void check_across(const ReleaseSight& at, const Eigen::Vector3d& normal, CheckList& list) {
  const Recording& recording = at.motion.recording();
  const MotionAlong across = motion_along(at.motion, at.world_from_sheet, normal);
  const int frames = frames_of_release(at.motion);
  const Release still = fit_parabola(at.motion.time_s(), across, frames, false);
  const Release moving = fit_parabola(at.motion.time_s(), across, frames, true);
  if (!std::isfinite(still.misfit) || !std::isfinite(moving.misfit)) return;
  // A sheet at rest gathers this speed in these frames; one that has a share of it was moving.
  const double t_s = at.motion.time_s()[static_cast<size_t>(frames - 1)] - at.motion.time_s()[0];
  if (std::abs(moving.speed) > std::max(kPreflight.moving_speed, 0.3 * at.weight * t_s) &&
      moving.misfit < 0.5 * still.misfit)
    return list.refuse(
        "release",
        fmt::format("in frame 0 the sheet already moves at {:.2g} m/s", std::abs(moving.speed)),
        "start: released_flat says that it is let go there, at rest",
        "give start: unknown, or begin with the frame of the release");
  const std::string found = fmt::format(
      "let go, the sheet accelerates by {:.3g} m/s2 across itself; the declared gravity and frame "
      "times make it {:.3g} (ratio {:.2f})",
      still.acceleration, at.weight, still.acceleration / at.weight);
  std::string explained;
  for (const Gravity& other : other_gravities(recording.gravity_m_per_s2)) {
    const double expected = other.m_per_s2.dot(normal);
    if (explained.empty() && std::abs(still.acceleration - expected) < 0.15 * std::abs(expected) &&
        std::abs(expected) > 0.1 * other.m_per_s2.norm())
      explained = explaining(other);
  }
  judge_ratio(recording, still.acceleration / at.weight, found, explained, list);
}

/// Holds a sheet in pictures against its weight. These tell little of the motion across it. Along
/// gravity it falls as its weight across itself makes it at least, and freely at most.
void check_fall(const ReleaseSight& at, CheckList& list) {
  const Recording& recording = at.motion.recording();
  const int frames = frames_of_release(at.motion);
  const double size = recording.gravity_m_per_s2.norm();
  const auto fall = [&](const Eigen::Vector3d& gravity) {
    const MotionAlong along =
        motion_along(at.motion, at.world_from_sheet, gravity.stableNormalized());
    return std::pair(fit_parabola(at.motion.time_s(), along, frames, false).acceleration,
                     along.explained[static_cast<size_t>(frames - 1)]);
  };
  const auto [acceleration, share] = fall(recording.gravity_m_per_s2);
  const double least = at.weight * at.weight / size;
  // The springs of cloth soon end its fall along itself.
  constexpr double kAlongItself = 2.5;
  const double most = std::min(size, kAlongItself * least);
  const std::string found = fmt::format(
      "let go, the sheet falls along the declared gravity by {:.3g} m/s2; its weight makes it "
      "{:.3g} to {:.3g}",
      acceleration, least, most);
  // Within what is possible the ratio is 1.
  const double ratio = acceleration / std::clamp(acceleration, least, most);
  std::string explained;
  constexpr double kClearly = 0.9;
  for (const Gravity& other : other_gravities(recording.gravity_m_per_s2)) {
    const auto [as_other, other_share] = fall(other.m_per_s2);
    if (explained.empty() && as_other > 0.1 * size && other_share > kClearly)
      explained = explaining(other);
  }
  judge_ratio(recording, ratio, found, explained, list);
}

/// Tells where the middle of the markers lies, seen from those that are held, in units of the first
/// set: the mean over frames. Nothing where no marker is near a held point.
std::optional<Eigen::VectorXd> hanging(const RecordedMotion& motion, int most_frames) {
  const Recording& recording = motion.recording();
  constexpr double kAtHeld = 0.1;  // of the cloth's size
  const auto dimension = motion.set(0).dimension;
  Eigen::VectorXd middle = Eigen::VectorXd::Zero(dimension), held = middle;
  int seen = 0, holding = 0;
  for (const int f : motion.sampled_frames(most_frames)) {
    const Eigen::MatrixXd place = motion.places(0, f);
    for (const int m : motion.tracked()) {
      if (!place.col(m).allFinite()) continue;
      middle += place.col(m);
      ++seen;
      if (distance_to_held_m(recording, motion.marker_m().col(m)) > kAtHeld * motion.size_m())
        continue;
      held += place.col(m);
      ++holding;
    }
  }
  if (holding == 0 || seen == holding) return std::nullopt;
  return Eigen::VectorXd(middle / seen - held / holding);
}

/// The direction along which cloth hangs in the mean, of one or two places that hold it.
std::optional<Gravity> gravity_it_hangs_along(const Eigen::Vector3d& hangs,
                                              const Eigen::Vector3d& declared) {
  constexpr double kAlong = 0.85, kNotAlong = 0.6;  // cosines
  if (declared.normalized().dot(hangs.normalized()) > kNotAlong) return std::nullopt;
  for (const Gravity& other : other_gravities(declared))
    if (other.m_per_s2.normalized().dot(hangs.normalized()) > kAlong) return other;
  return std::nullopt;
}

/// Cloth hangs below what holds it: at rest, and in the mean of its motion.
void check_hanging(const RecordedMotion& motion, CheckList& list) {
  const Recording& recording = motion.recording();
  if (recording.held.empty() || is_carried(recording) || motion.first_frame(0) < 0) return;
  const bool at_rest = recording.start == StartKind::at_rest;
  const auto hangs = hanging(motion, at_rest ? 1 : 60);
  if (!hangs) return;
  const Eigen::Vector3d& gravity = recording.gravity_m_per_s2;
  Eigen::VectorXd down = gravity.stableNormalized();
  if (motion.set(0).camera) {
    const auto sheet = place_flat_sheet(std::vector{motion.set(0)}, motion.marker_m(), 1);
    if (!sheet) return;
    Eigen::Matrix3d by_position;
    const Eigen::Vector3d middle(0.5 * recording.cloth.width_m, 0.5 * recording.cloth.height_m, 0);
    if (!motion.set(0).predict(*sheet * middle, &by_position)) return;
    down = (by_position * down).head<2>().eval();
    // A camera that looks along gravity does not see it.
    if (down.norm() < 0.5 * motion.units_per_m(0)) return;
    down.normalize();
  }
  const double below_m = hangs->dot(down) / motion.units_per_m(0);
  const double share = below_m / motion.size_m();
  const std::string found =
      fmt::format("the markers' middle lies {:.3g} mm {} what holds the cloth",
                  1e3 * std::abs(below_m), below_m < 0 ? "above" : "below");
  const std::string expected =
      "a cloth that hangs below it, along the declared gravity " + vector_text(gravity);
  constexpr double kClearly = 0.15;
  std::optional<Gravity> other;
  if (!motion.set(0).camera) other = gravity_it_hangs_along(*hangs, gravity);
  const std::string remedy = other ? explaining(*other) + " would explain it"
                                   : "look at gravity's sign and axis, and at the held points";
  if (share < -kClearly && recording.declared.empty())
    return list.refuse("gravity", found, expected, remedy);
  if (other && recording.declared.empty() && recording.start != StartKind::unknown)
    return list.refuse("gravity", found, expected, remedy);
  if (other || share < -kClearly) return list.warn("gravity", found, expected, remedy);
  if (share > kClearly) list.pass("gravity", found);
}

/// Cloth that is at rest, and that nothing moves, stays at rest.
void check_rest(const RecordedMotion& motion, CheckList& list) {
  const Recording& recording = motion.recording();
  const bool all_fixed = std::ranges::all_of(
      recording.held, [](const HeldPoint& point) { return point.motion == HeldMotion::fixed; });
  if (recording.start != StartKind::at_rest || !all_fixed || recording.held.empty()) return;
  constexpr double kMoves = 0.02;  // of the cloth's size
  constexpr double kSoon_s = 0.2;  // before a person sets something in motion
  const std::vector<double> moved_m = moved_markers(motion).distance_m;
  for (int f = 1; f < motion.frames(); ++f) {
    if (motion.time_s()[static_cast<size_t>(f)] - motion.time_s()[0] > kSoon_s) return;
    const double moved = moved_m[static_cast<size_t>(f)];
    if (!(moved > kMoves * motion.size_m())) continue;
    const std::string found = fmt::format(
        "markers move by {:.3g} mm up to frame {}, and all held "
        "points are fixed",
        1e3 * moved, f);
    const char* expected = "start: at_rest says that nothing moves before something moves it";
    const char* remedy =
        "give start: released_flat where a flat sheet is let go, start: unknown where it moves "
        "already, or declare what moves it";
    if (recording.declared.empty())
      list.refuse("release", found, expected, remedy);
    else
      list.warn("release", found, expected, remedy);
    return;
  }
}

}  // namespace

void check_release(const RecordedMotion& motion, CheckList& list) {
  const Recording& recording = motion.recording();
  check_hanging(motion, list);
  check_rest(motion, list);
  if (list.refused()) return;
  if (recording.start != StartKind::released_flat || motion.frames() < 4) return;
  std::vector<ObservationSet> sets;
  for (int s = 0; s < motion.sets(); ++s) sets.push_back(motion.set(s));
  const auto world_from_sheet = place_flat_sheet(sets, motion.marker_m(), 1);
  if (!world_from_sheet) return;
  Eigen::Vector3d normal = world_from_sheet->rotation * Eigen::Vector3d::UnitZ();
  if (normal.dot(recording.gravity_m_per_s2) < 0) normal = -normal;
  const double weight = normal.dot(recording.gravity_m_per_s2);
  // A sheet that hangs already need not fall, and one that is carried soon stops.
  if (weight < kPreflight.in_view || is_carried(recording)) return;
  if (!check_moment(motion, weight, list)) return;
  const ReleaseSight at{.motion = motion, .world_from_sheet = *world_from_sheet, .weight = weight};
  if (motion.set(0).camera)
    check_fall(at, list);
  else
    check_across(at, normal, list);
}

}  // namespace clothfit
