#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "calib/camera/rigid3.h"
#include "data/median.h"
#include "fit/preflight/checks.h"
#include "fit/preflight/criteria.h"
#include "fit/preflight/gravity_candidates.h"
#include "fit/preflight/moved_markers.h"

namespace clothfit {
namespace {

/// Returns which markers are far from what is held, and lie in frame 0 where the flat sheet has
/// them as most do: a row that is wrong there would be taken for a motion ever after.
std::vector<char> free_markers(const RecordedMotion& motion, const Rigid3& world_from_sheet) {
  constexpr double kFarOff = 5;  // times what half of them are off
  std::vector<char> is_free;
  for (int m = 0; m < motion.markers(); ++m)
    is_free.push_back(distance_to_held_m(motion.recording(), motion.marker_m().col(m)) >
                      kPreflight.free_of_held * motion.size_m());
  for (int s = 0; s < motion.sets(); ++s) {
    std::vector<std::pair<double, int>> off;
    std::vector<double> usual;
    for (const Observation& row : motion.set(s).rows) {
      if (row.frame > 0) break;
      const Eigen::Vector2d flat = motion.marker_m().col(row.marker);
      const auto start =
          motion.set(s).predict(world_from_sheet * Eigen::Vector3d(flat.x(), flat.y(), 0));
      if (!start) continue;
      off.emplace_back((row.observed - *start).norm() / row.sigma, row.marker);
      usual.push_back(off.back().first);
    }
    if (usual.empty()) continue;
    const double limit = kFarOff * std::max(1.0, median(std::move(usual)));
    for (const auto& [sigmas, marker] : off)
      if (sigmas > limit) is_free[static_cast<size_t>(marker)] = 0;
  }
  return is_free;
}

/// The mean motion of the free part of a sheet along a direction since frame 0, by frame.
struct MotionAlong {
  std::vector<double> moved_m, sigma_m;  ///< sigma infinite where nothing was seen
  std::vector<double> explained;         ///< share of the markers' motion, as it is seen
};

/// Normal equations of a mean motion along some directions in one frame.
struct MeanMotion {
  Eigen::MatrixXd information;
  Eigen::VectorXd pull;
  double all = 0;  ///< square of the markers' motion

  explicit MeanMotion(Eigen::Index directions)
      : information(Eigen::MatrixXd::Zero(directions, directions)),
        pull(Eigen::VectorXd::Zero(directions)) {}
};

/// Measures the motion along the first of some directions, the others being moved along as well:
/// pictures show the sum of all. A frame tells nothing where they look alike there.
MotionAlong motion_along(const RecordedMotion& motion, const Rigid3& world_from_sheet,
                         const Eigen::Matrix3Xd& directions) {
  std::vector<MeanMotion> means(static_cast<size_t>(motion.frames()),
                                MeanMotion(directions.cols()));
  const std::vector<char> is_free = free_markers(motion, world_from_sheet);
  for (int s = 0; s < motion.sets(); ++s)
    for (const Observation& row : motion.set(s).rows) {
      if (is_free[static_cast<size_t>(row.marker)] == 0) continue;
      const Eigen::Vector2d flat = motion.marker_m().col(row.marker);
      Eigen::Matrix3d by_position;
      const auto start = motion.set(s).predict(
          world_from_sheet * Eigen::Vector3d(flat.x(), flat.y(), 0), &by_position);
      if (!start) continue;
      const Eigen::Matrix3Xd along = by_position * directions / row.sigma;
      const Eigen::Vector3d moved = (row.observed - *start) / row.sigma;
      MeanMotion& mean = means[static_cast<size_t>(row.frame)];
      mean.information += along.transpose() * along;
      mean.pull += along.transpose() * moved;
      mean.all += moved.squaredNorm();
    }
  // Sine squared of 20 degrees between what the first direction and the others look like.
  constexpr double kApart = 0.12;
  MotionAlong result;
  for (const MeanMotion& mean : means) {
    const Eigen::FullPivLU<Eigen::MatrixXd> solver(mean.information);
    Eigen::VectorXd first = Eigen::VectorXd::Zero(directions.cols());
    if (solver.isInvertible()) first = solver.solve(Eigen::VectorXd::Unit(directions.cols(), 0));
    const bool seen = first[0] > 0 && first[0] * mean.information(0, 0) * kApart < 1;
    const Eigen::VectorXd found = solver.solve(mean.pull);
    result.moved_m.push_back(seen ? found[0] : 0);
    result.sigma_m.push_back(seen ? std::sqrt(first[0]) : INFINITY);
    result.explained.push_back(seen ? mean.pull.dot(found) / mean.all : 0);
  }
  // What the placement of the sheet is off by is no motion.
  const double first_m = result.moved_m.front();
  for (double& moved_m : result.moved_m) moved_m -= first_m;
  return result;
}

/// A sheet let go at frame 0, at rest or with a speed.
struct Parabola {
  double acceleration = 0;  ///< m/s2
  double speed = 0;         ///< at frame 0, m/s
  double sigma = INFINITY;  ///< of the acceleration, by what the frames are off, m/s2
  double left = 1;          ///< of the mean square of the motion
};

/// Fits d = speed t + acceleration t^2 / 2 to frames 1 to `last`, with the speed or without it.
Parabola fit_parabola(const std::vector<double>& t_s, const MotionAlong& motion, int last,
                      bool with_speed) {
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  const auto basis = [&](int f) -> Eigen::Vector2d {
    const double t = t_s[static_cast<size_t>(f)] - t_s[0];
    return {0.5 * t * t, with_speed ? t : 0};
  };
  double all = 0;
  for (int f = 1; f <= last; ++f) {
    const double weight = std::pow(motion.sigma_m[static_cast<size_t>(f)], -2);
    const double moved_m = motion.moved_m[static_cast<size_t>(f)];
    normal += weight * basis(f) * basis(f).transpose();
    right += weight * moved_m * basis(f);
    all += weight * moved_m * moved_m;
  }
  if (!with_speed) normal(1, 1) = 1;
  if (!(std::abs(normal.determinant()) > 0)) return {};
  const Eigen::Vector2d found = normal.inverse() * right;
  double sum = 0;
  for (int f = 1; f <= last; ++f)
    sum += std::pow((motion.moved_m[static_cast<size_t>(f)] - found.dot(basis(f))) /
                        motion.sigma_m[static_cast<size_t>(f)],
                    2);
  int seen = 0;
  for (int f = 1; f <= last; ++f)
    if (std::isfinite(motion.sigma_m[static_cast<size_t>(f)])) ++seen;
  const int spare = std::max(1, seen - (with_speed ? 2 : 1));
  return {.acceleration = found[0],
          .speed = found[1],
          .sigma = std::sqrt(std::max(1.0, sum / spare) * normal.inverse()(0, 0)),
          .left = all > 0 ? sum / all : 1};
}

/// What is known of a sheet that is let go at frame 0.
struct ReleaseSight {
  const RecordedMotion& motion;
  const Rigid3& world_from_sheet;
  Eigen::Vector3d normal;  ///< of the sheet, world, to the side of the declared gravity
  double weight = 0;       ///< the declared gravity along it, m/s2
  MovedMarkers moved;

  double time_s(int f) const {
    return motion.time_s()[static_cast<size_t>(f)] - motion.time_s()[0];
  }
};

/// Fewest frames of a release that tell an acceleration.
constexpr int kFewestFrames = 3;

/// Returns the last frame in which a sheet is still nearly flat and springs have not slowed it:
/// well before it turns round for the first time. 0 where already the first is later than that.
int last_of_release(const ReleaseSight& at) {
  const std::vector<double>& moved_m = at.moved.distance_m;
  const double size_m = at.motion.size_m();
  const auto last_within = [&](double share) {
    int last = 0;
    while (last + 1 < at.motion.frames() &&
           !(moved_m[static_cast<size_t>(last) + 1] > share * size_m))
      ++last;
    return last;
  };
  int last = last_within(kPreflight.nearly_flat);
  if (last < kFewestFrames) last = std::min(kFewestFrames, last_within(2 * kPreflight.nearly_flat));
  // Damped sheets do not turn round: their way grows more slowly than with the time.
  constexpr double kSlowed = 1.9;  // ratio of the ways in twice the time, 4 of a free fall
  for (int f = 2; f <= last; f += 2) {
    const auto whole = static_cast<size_t>(f), half = static_cast<size_t>(f / 2);
    if (moved_m[whole] > at.moved.seen_m[whole] && moved_m[whole] < kSlowed * moved_m[half])
      last = f / 2;
  }
  constexpr double kTurned = 0.95;  // of the way that it had gone
  for (int f = 1; f < std::min(2 * last, at.motion.frames() - 1); ++f) {
    const auto frame = static_cast<size_t>(f);
    if (moved_m[frame] > at.moved.seen_m[frame] && moved_m[frame + 1] < kTurned * moved_m[frame])
      return std::min(last, f / 2);
  }
  return last;
}

/// When a sheet is let go that stands still before: d = (rate (t - time))^2.
struct LetGo {
  double time_s = 0, rate = 0;  ///< rate: roots of metres a second; both 0 where it cannot be told
};

/// The way grows with the square of the time since, so its root does with the time. `moves` is the
/// first frame in which it has moved.
LetGo let_go(const ReleaseSight& at, size_t moves) {
  constexpr size_t kFewest = 3, kMost = 60;
  constexpr double kFar = 6;  // times the first way: noise of a short stretch tells no time
  const std::vector<double>& moved_m = at.moved.distance_m;
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  for (size_t f = moves; f < std::min(moves + kMost, moved_m.size()); ++f) {
    if (!std::isfinite(moved_m[f])) continue;
    if (f >= moves + kFewest && moved_m[f] > kFar * moved_m[moves]) break;
    const Eigen::Vector2d by(1, at.time_s(static_cast<int>(f)));
    normal += by * by.transpose();
    right += std::sqrt(moved_m[f]) * by;
  }
  if (!(std::abs(normal.determinant()) > 0)) return {};
  const Eigen::Vector2d line = normal.inverse() * right;
  if (!(line[1] > 0)) return {};
  return {.time_s = -line[0] / line[1], .rate = line[1]};
}

/// Says whether frame 0 shows markers that are free to move.
bool shows_free_part(const ReleaseSight& at) {
  constexpr int kFewest = 4;
  const std::vector<char> is_free = free_markers(at.motion, at.world_from_sheet);
  int seen = 0;
  for (int s = 0; s < at.motion.sets(); ++s) {
    const Eigen::MatrixXd first = at.motion.places(s, 0);
    for (Eigen::Index m = 0; m < first.cols(); ++m)
      if (is_free[static_cast<size_t>(m)] != 0 && first.col(m).allFinite()) ++seen;
  }
  return seen >= kFewest;
}

/// Finds the frame in which a sheet is let go that stands still before. Returns whether that is
/// frame 0, or near it.
bool check_moment(const ReleaseSight& at, CheckList& list) {
  const std::vector<double>& moved_m = at.moved.distance_m;
  const std::vector<double>& seen_m = at.moved.seen_m;
  double largest_m = 0;
  bool is_seen = false;
  for (size_t f = 1; f < moved_m.size(); ++f)
    if (moved_m[f] > seen_m[f]) {
      is_seen = true;
      largest_m = std::max(largest_m, moved_m[f]);
    }
  if (!is_seen) {
    if (!shows_free_part(at)) return false;
    list.refuse("release",
                fmt::format("in all {} frames markers move by no more than their noise",
                            at.motion.frames()),
                "start: released_flat says that the sheet is let go at frame 0",
                "nothing can be fitted to a cloth that does not move: is something holding it?");
    return false;
  }
  // A stiff sheet moves little: a part of its whole way shows that it has begun.
  constexpr double kBegun = 0.25;
  const double begun_m = std::min(kPreflight.begun * at.motion.size_m(), kBegun * largest_m);
  size_t moves = 1;
  while (!(moved_m[moves] > std::max(begun_m, seen_m[moves]))) ++moves;
  const double frame_s = at.time_s(static_cast<int>(moves)) / static_cast<double>(moves);
  // A sheet that nothing but its weight moves does not start earlier than this.
  const double falls_s = std::sqrt(2 * moved_m[moves] / at.weight);
  const LetGo moment = let_go(at, moves);
  const double still =
      std::min(moment.time_s, at.time_s(static_cast<int>(moves)) - 0.5 * falls_s) / frame_s;
  if (still < kPreflight.still_frames) return true;
  // The last frame that shows no motion, near there.
  const auto near = static_cast<size_t>(still);
  size_t last = near;
  for (size_t f = near; f < std::min(near + 3, moves); ++f)
    if (!(moved_m[f] > seen_m[f])) last = f;
  list.refuse(
      "release",
      fmt::format("the sheet stands still until frame {}: up to there markers move by less "
                  "than {:.2g} mm, by frame {} by {:.2g} mm",
                  last, 1e3 * std::max(moved_m[last], seen_m[last]), moves, 1e3 * moved_m[moves]),
      "start: released_flat says that it is let go at frame 0",
      fmt::format("cut the recording so that it begins with frame {}", last));
  return false;
}

/// Rates that people write for another.
std::string asked_rate(const Recording& recording, double acceleration_ratio) {
  if (!recording.frame_rate_hz || !(acceleration_ratio > 0)) return "";
  const double rate_hz = *recording.frame_rate_hz / std::sqrt(acceleration_ratio);
  // Half the way from 50 to 60: drag takes some of a fall, and shows a higher rate.
  constexpr double kAlike = 1.09, kOther = 1.1;
  const auto apart = [&](double usual_hz) { return std::abs(std::log(rate_hz / usual_hz)); };
  constexpr std::array kUsual_hz = {24.0, 25.0,  30.0,  48.0,  50.0, 60.0,
                                    90.0, 100.0, 120.0, 200.0, 240.0};
  const double usual_hz = *std::ranges::min_element(kUsual_hz, {}, apart);
  if (apart(usual_hz) > std::log(kAlike) ||
      std::abs(std::log(usual_hz / *recording.frame_rate_hz)) < std::log(kOther))
    return "";
  return fmt::format("a frame rate of {:.0f} Hz in place of {:g}", usual_hz,
                     *recording.frame_rate_hz);
}

/// Another gravity that explains how a sheet falls.
struct Explanation {
  std::string text;    ///< gravity_text, or empty
  bool twice = false;  ///< whether the cloth also hangs along it later
};

/// An acceleration seen, as a multiple of the one declared, 1 where they agree.
struct Ratio {
  double value = 1, sigma = 0;

  /// Returns it as near to 1 as its uncertainty allows.
  double at_least() const {
    const double uncertain = kPreflight.release_sigmas * sigma;
    return value < 1 ? std::min(1.0, value + uncertain) : std::max(1.0, value - uncertain);
  }
  bool within(double factor) const { return at_least() < factor && at_least() > 1 / factor; }
};

/// Says that gravity or the frame times are wrong. A strong wind may do it too, so that it is
/// certain only where a mistake explains it that people make.
void judge_ratio(const Recording& recording, const Ratio& ratio, const std::string& found,
                 const Explanation& explanation, CheckList& list) {
  if (ratio.within(kPreflight.gravity_warned)) return list.pass("gravity", found);
  const std::string rate = asked_rate(recording, ratio.value);
  std::string remedy =
      explanation.text + (explanation.text.empty() || rate.empty() ? "" : " or ") + rate;
  const bool is_explained = !remedy.empty();
  if (is_explained)
    remedy += " would explain it";
  else
    remedy =
        "look at gravity's sign, axis and size and at the frame rate; a strong wind would do "
        "it too, and is to be declared";
  const bool clearly = explanation.twice || !ratio.within(kPreflight.gravity_refused);
  // A declared force may push as hard as the weight.
  if (clearly && is_explained && !moves_by_effects(recording))
    list.refuse("gravity", found, "a ratio near 1", remedy);
  else
    list.warn("gravity", found, "a ratio near 1", remedy);
}

/// Returns the gravity that makes a sheet accelerate so across itself; nothing where none does.
std::optional<GravityCandidate> falls_along(const ReleaseSight& at, double acceleration) {
  // One camera adds what moves the sheet aside.
  const bool one_camera = at.motion.set(0).camera && at.motion.sets() == 1;
  const double alike = one_camera ? 0.3 : 0.15;
  constexpr double kInView = 0.1;
  for (const GravityCandidate& other : gravity_candidates(at.motion.recording().gravity_m_per_s2)) {
    const double expected = other.m_per_s2.dot(at.normal);
    if (std::abs(acceleration - expected) < alike * std::abs(expected) &&
        std::abs(expected) > kInView * other.m_per_s2.norm())
      return other;
  }
  return std::nullopt;
}

/// Says what moves in frame 0 already. Returns whether it does.
bool moves_already(const ReleaseSight& at, const MotionAlong& across, int last, CheckList& list) {
  constexpr double kExplains = 0.02, kOfFall = 0.3;
  const Parabola still = fit_parabola(at.motion.time_s(), across, last, false),
                 moving = fit_parabola(at.motion.time_s(), across, last, true);
  // A sheet at rest gathers this speed in these frames; one that has a share of it was moving.
  const double gathered = at.weight * at.time_s(last);
  if (std::abs(moving.speed) < std::max(kPreflight.moving_speed, kOfFall * gathered) ||
      moving.left > std::min(kExplains, 0.5 * still.left))
    return false;
  // From rest it cannot have moved so far in the first frame, by its weight and by what it hangs
  // on.
  constexpr double kFaster = 2;
  const double first_m = std::abs(across.moved_m[1]);
  const bool is_certain = first_m > kFaster * 0.5 * at.weight * at.time_s(1) * at.time_s(1) +
                                        kPreflight.release_sigmas * across.sigma_m[1];
  list.add("release",
           is_certain && !moves_by_effects(at.motion.recording()) ? FindingState::refused
                                                                  : FindingState::warning,
           list.file(),
           fmt::format("in frame 0 the sheet already moves at {:.2g} m/s", std::abs(moving.speed)),
           "start: released_flat says that it is let go there, at rest",
           "give start: unknown, or begin with the frame of the release");
  return true;
}

/// Returns the directions in which a sheet that is let go moves: across itself first and, until its
/// springs hold it, along itself. One camera tells two of them apart at most.
Eigen::Matrix3Xd directions_of_release(const ReleaseSight& at) {
  const Eigen::Vector3d& gravity = at.motion.recording().gravity_m_per_s2;
  const Eigen::Vector3d along = gravity - gravity.dot(at.normal) * at.normal;
  constexpr double kLevel = 0.05;  // of gravity: such a sheet hardly falls along itself
  const bool is_level = along.norm() < kLevel * gravity.norm();
  const bool one_camera = at.motion.set(0).camera && at.motion.sets() == 1;
  const Eigen::Index count = !one_camera ? 3 : is_level ? 1 : 2;
  Eigen::Matrix3d directions;
  directions.col(0) = at.normal;
  directions.col(1) = is_level ? at.normal.unitOrthogonal() : along.normalized();
  directions.col(2) = at.normal.cross(directions.col(1));
  return directions.leftCols(count);
}

/// Says whether the first frames tell the motion across a sheet from that along it.
bool shows_across(const ReleaseSight& at) {
  const MotionAlong across =
      motion_along(at.motion, at.world_from_sheet, directions_of_release(at));
  const int last = std::min(kFewestFrames, at.motion.frames() - 1);
  return std::all_of(across.sigma_m.begin() + 1, across.sigma_m.begin() + 1 + last,
                     [](double sigma_m) { return std::isfinite(sigma_m); });
}

/// Holds a sheet in space against its weight. All springs of a flat sheet lie in it, so that the
/// first force across it is the weight's: it moves by (g . n) t^2 / 2 wherever nothing is held
/// near, whatever the fabric is.
void check_across(const ReleaseSight& at, CheckList& list) {
  const MotionAlong across =
      motion_along(at.motion, at.world_from_sheet, directions_of_release(at));
  int last = last_of_release(at);
  const bool is_soon_over = last < kFewestFrames;
  Parabola fall = fit_parabola(at.motion.time_s(), across, std::max(1, last), false);
  // What damps a sheet slows it more and more: the first frames tell what moves it.
  constexpr double kSlower = 1.15;
  bool slows = false;
  while (last / 2 >= kFewestFrames) {
    const Parabola half = fit_parabola(at.motion.time_s(), across, last / 2, false);
    slows = std::abs(half.acceleration) > kSlower * std::abs(fall.acceleration);
    if (!slows) break;
    last /= 2;
    fall = half;
  }
  if (!std::isfinite(fall.sigma)) return;
  const bool is_in_view = at.weight >= kPreflight.in_view;
  Ratio ratio;
  if (is_in_view) ratio = {.value = fall.acceleration / at.weight, .sigma = fall.sigma / at.weight};
  // Of few frames it is certain only that nothing falls faster than freely.
  if (is_soon_over && ratio.value < kPreflight.gravity_refused) return;
  if (!is_soon_over && is_in_view && moves_already(at, across, last, list)) return;
  // What does not grow with the square of the time is no free fall.
  if (!is_soon_over && (slows || fall.left > kPreflight.no_parabola)) return;
  if (!is_soon_over &&
      fall.sigma > kPreflight.release_uncertain * std::max(at.weight, std::abs(fall.acceleration)))
    return;
  const std::string found = fmt::format(
      "let go, the sheet accelerates by {:.3g} m/s2 across itself; the declared gravity and frame "
      "times make it {:.3g}",
      fall.acceleration, at.weight);
  Explanation explanation;
  if (const auto other = falls_along(at, fall.acceleration)) {
    const auto hangs = hangs_along(at.motion);
    explanation = {.text = gravity_text(*other), .twice = hangs && hangs->name == other->name};
  }
  const double size = at.motion.recording().gravity_m_per_s2.norm();
  if (is_in_view)
    return judge_ratio(at.motion.recording(), ratio,
                       found + fmt::format(" (ratio {:.2f})", ratio.value), explanation, list);
  // A sheet that hangs already need not fall. Where it falls as another gravity makes it, that is
  // its gravity.
  constexpr double kFalls = 0.5;
  const double differs = std::abs(fall.acceleration - at.weight);
  if (!explanation.text.empty() &&
      differs > kFalls * size + kPreflight.release_sigmas * fall.sigma &&
      !moves_by_effects(at.motion.recording())) {
    const std::string remedy = explanation.text + " would explain it; a wind would too";
    list.add("gravity", explanation.twice ? FindingState::refused : FindingState::warning,
             list.file(), found, "the declared one", remedy);
  }
}

/// How a sheet in pictures falls along a direction.
struct Fall {
  Parabola parabola;
  double share = 0;  ///< of the markers' motion that it explains, at the end
};

Fall fall_along(const ReleaseSight& at, const Eigen::Vector3d& direction, int last) {
  const MotionAlong along =
      motion_along(at.motion, at.world_from_sheet, direction.stableNormalized());
  return {.parabola = fit_parabola(at.motion.time_s(), along, last, false),
          .share = along.explained[static_cast<size_t>(last)]};
}

/// Names the gravity along which a sheet in pictures falls; empty where none explains its motion.
std::string explained_fall(const ReleaseSight& at, int last) {
  constexpr double kClearly = 0.9, kFalls = 0.1;
  const Eigen::Vector3d& declared = at.motion.recording().gravity_m_per_s2;
  for (const GravityCandidate& other : gravity_candidates(declared)) {
    const Fall fall = fall_along(at, other.m_per_s2, last);
    if (fall.parabola.acceleration > kFalls * declared.norm() && fall.share > kClearly)
      return gravity_text(other);
  }
  return "";
}

/// Holds a sheet in pictures against its weight. These tell little of the motion across it. Along
/// gravity it falls as its weight across itself makes it at least, and freely at most.
void check_fall(const ReleaseSight& at, CheckList& list) {
  const Recording& recording = at.motion.recording();
  const int last = last_of_release(at);
  if (last < kFewestFrames) return;
  const Fall fall = fall_along(at, recording.gravity_m_per_s2, last);
  const double size = recording.gravity_m_per_s2.norm();
  const double least = at.weight * at.weight / size;
  // The springs of cloth soon end its fall along itself.
  constexpr double kAlongItself = 2.5;
  const double most = std::max(least, std::min(size, kAlongItself * least));
  if (!std::isfinite(fall.parabola.sigma) ||
      fall.parabola.sigma >
          kPreflight.release_uncertain * std::max(least, std::abs(fall.parabola.acceleration)))
    return;
  const std::string found = fmt::format(
      "let go, the sheet falls along the declared gravity by {:.3g} m/s2; its weight makes it "
      "{:.3g} to {:.3g}",
      fall.parabola.acceleration, least, most);
  // Within what is possible the ratio is 1.
  const double nearest = std::clamp(fall.parabola.acceleration, least, most);
  const Ratio ratio{.value = fall.parabola.acceleration / nearest,
                    .sigma = fall.parabola.sigma / nearest};
  judge_ratio(recording, ratio, found, {.text = explained_fall(at, last)}, list);
}

/// Cloth that is at rest, and that nothing moves, stays at rest.
void check_rest(const RecordedMotion& motion, CheckList& list) {
  const Recording& recording = motion.recording();
  const bool all_fixed = std::ranges::all_of(
      recording.held, [](const HeldPoint& point) { return point.motion == HeldMotion::fixed; });
  if (recording.start != StartKind::at_rest || !all_fixed || recording.held.empty() ||
      moves_by_effects(recording))
    return;
  const MovedMarkers moved = moved_markers(motion);
  for (int f = 1; f < motion.frames(); ++f) {
    const auto frame = static_cast<size_t>(f);
    if (motion.time_s()[frame] - motion.time_s()[0] > kPreflight.rest_s) return;
    const double limit_m = std::max(kPreflight.rests * motion.size_m(), moved.seen_m[frame]);
    if (!(moved.distance_m[frame] > limit_m)) continue;
    return list.warn(
        "release",
        fmt::format("half of the markers move by {:.3g} mm up to frame {}, and all held points are "
                    "fixed",
                    1e3 * moved.distance_m[frame], f),
        "start: at_rest says that nothing moves before something moves it",
        "give start: released_flat where a flat sheet is let go, start: unknown where it moves "
        "already, or declare what moves it");
  }
}

}  // namespace

void check_release(const RecordedMotion& motion, CheckList& list) {
  const Recording& recording = motion.recording();
  check_rest(motion, list);
  if (recording.start != StartKind::released_flat || motion.frames() <= kFewestFrames ||
      !motion.flat_sheet() || is_carried(motion))
    return;
  Eigen::Vector3d normal = motion.flat_sheet()->rotation * Eigen::Vector3d::UnitZ();
  if (normal.dot(recording.gravity_m_per_s2) < 0) normal = -normal;
  const ReleaseSight at{.motion = motion,
                        .world_from_sheet = *motion.flat_sheet(),
                        .normal = normal,
                        .weight = normal.dot(recording.gravity_m_per_s2),
                        .moved = moved_markers(motion)};
  // One that hangs already need not move.
  const bool is_in_view = at.weight >= kPreflight.in_view;
  if (is_in_view && !check_moment(at, list)) return;
  // One camera may see the motion along the sheet where it sees that across it.
  if (shows_across(at))
    check_across(at, list);
  else if (is_in_view)
    check_fall(at, list);
}

}  // namespace clothfit
