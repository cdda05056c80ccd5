#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "data/median.h"
#include "fit/preflight/checks.h"
#include "fit/preflight/criteria.h"

namespace clothfit {
namespace {

constexpr int kFewestMarkers = 4;

/// The markers' velocities in one interval, held against the mean of those before and after.
struct IntervalMotion {
  double factor = 0;     ///< of the mean that is nearest to the velocities
  double size = 0;       ///< of the velocities, as a share of that mean's
  double step = 0;       ///< the same of the ways, whatever the times say
  double agreement = 0;  ///< cosine between the two
  double evenness = 0;   ///< of the velocities before and after: their product by the larger square
  double shift = 0;      ///< root mean square of what the mean moves a coordinate, in units
  double off = 0;        ///< of the velocities less that mean, in units per second
};

IntervalMotion interval_motion(const RecordedMotion& motion, int s, int frame) {
  const std::vector<double>& time_s = motion.time_s();
  const auto at = [&](int f) { return time_s[static_cast<size_t>(f)]; };
  const Eigen::MatrixXd a = motion.places(s, frame - 1), b = motion.places(s, frame),
                        c = motion.places(s, frame + 1), d = motion.places(s, frame + 2);
  double by_mean = 0, squares = 0, mean_squares = 0, across = 0, before2 = 0, after2 = 0;
  double off = 0, steps = 0, mean_steps = 0;
  int markers = 0, coordinates = 0;
  for (Eigen::Index m = 0; m < a.cols(); ++m) {
    if (!(a.col(m) + b.col(m) + c.col(m) + d.col(m)).allFinite()) continue;
    const Eigen::VectorXd before = (b.col(m) - a.col(m)) / (at(frame) - at(frame - 1)),
                          now = (c.col(m) - b.col(m)) / (at(frame + 1) - at(frame)),
                          after = (d.col(m) - c.col(m)) / (at(frame + 2) - at(frame + 1)),
                          mean = 0.5 * (before + after);
    by_mean += now.dot(mean);
    squares += now.squaredNorm();
    mean_squares += mean.squaredNorm();
    steps += (c.col(m) - b.col(m)).squaredNorm();
    mean_steps += (b.col(m) - a.col(m) + d.col(m) - c.col(m)).squaredNorm() / 4;
    across += before.dot(after);
    off += (now - mean).squaredNorm();
    before2 += before.squaredNorm();
    after2 += after.squaredNorm();
    ++markers;
    coordinates += static_cast<int>(mean.size());
  }
  if (markers < kFewestMarkers || !(mean_squares > 0)) return {};
  const double interval_s = at(frame + 1) - at(frame);
  return {.factor = by_mean / mean_squares,
          .size = std::sqrt(squares / mean_squares),
          .step = mean_steps > 0 ? std::sqrt(steps / mean_steps) : 1,
          .agreement = squares > 0 ? by_mean / std::sqrt(squares * mean_squares) : 0,
          .evenness = across / std::max(before2, after2),
          .shift = interval_s * std::sqrt(mean_squares / coordinates),
          .off = std::sqrt(off / coordinates)};
}

std::string frames_text(const std::vector<int>& frames) {
  constexpr size_t kShown = 6;
  const std::vector<int> shown(
      frames.begin(),
      frames.begin() + static_cast<std::ptrdiff_t>(std::min(kShown, frames.size())));
  return fmt::format("{}{}", fmt::join(shown, ", "), frames.size() > kShown ? ", ..." : "");
}

void check_set(const RecordedMotion& motion, int s, CheckList& list) {
  constexpr double kAgrees = 0.9;
  const double seen =
      std::max(motion.set(s).noise, kPreflight.moves * motion.size_m() * motion.units_per_m(s));
  std::vector<int> repeats;
  int jumps = 0, first_jump = 0;
  double largest = 0;
  std::vector<IntervalMotion> intervals;
  std::vector<double> usual;
  for (int f = 1; f + 2 < motion.frames(); ++f) {
    intervals.push_back(interval_motion(motion, s, f));
    if (intervals.back().shift > seen) usual.push_back(intervals.back().off);
  }
  if (usual.empty()) return;
  const double rough = kPreflight.out_of_step * median(std::move(usual));
  for (int f = 1; f + 2 < motion.frames(); ++f) {
    const IntervalMotion& now = intervals[static_cast<size_t>(f - 1)];
    if ((now.off < rough && now.size > 0) || now.shift < seen) continue;
    if (now.evenness < kPreflight.alike_intervals) continue;
    if (std::min(now.factor, now.step) > kPreflight.jump && now.agreement > kAgrees) {
      if (jumps++ == 0) first_jump = f;
      largest = std::max(largest, now.factor);
    } else if (std::max(now.size, now.step) < kPreflight.repeat) {
      repeats.push_back(f + 1);
    }
  }
  const std::string& kind = motion.set(s).kind;
  const bool timed = motion.recording().times_file.has_value();
  if (jumps > 0) {
    std::string found = fmt::format(
        "all markers of {} move {:.1f} times as fast between frames {} and {} as before and after",
        kind, largest, first_jump, first_jump + 1);
    if (jumps > 1) found += fmt::format(", and so in {} places", jumps);
    list.refuse("time", found,
                timed ? "times that fit the frames"
                      : fmt::format("frames that are evenly spaced: {:.0f} seem to be missing "
                                    "there",
                                    std::max(1.0, std::round(largest - 1))),
                timed ? "look at the times file there"
                      : "give a times.csv with the time of every frame, or number the frames with "
                        "their gaps");
    return;
  }
  if (!repeats.empty()) {
    list.warn("time",
              fmt::format("all markers of {} stand still in frame{} {} while the cloth moves", kind,
                          repeats.size() > 1 ? "s" : "", frames_text(repeats)),
              "every frame of its own", "a frame was written twice: leave out the copies");
    return;
  }
  list.pass("time", fmt::format("markers of {} move evenly from frame to frame", kind));
}

/// Names frames in which nothing was observed, between others.
void check_gaps(const RecordedMotion& motion, CheckList& list) {
  std::vector<int> empty;
  for (int f = 0; f < motion.frames(); ++f) {
    bool seen = false;
    for (int s = 0; s < motion.sets() && !seen; ++s)
      seen = motion.places(s, f).array().isFinite().any();
    if (!seen) empty.push_back(f);
  }
  if (empty.empty()) return;
  list.warn("time",
            fmt::format("{} of {} frames show no marker: {}", empty.size(), motion.frames(),
                        frames_text(empty)),
            "frames that follow each other", "look at the frame column, and at those pictures");
}

}  // namespace

void check_timing(const RecordedMotion& motion, CheckList& list) {
  for (int s = 0; s < motion.sets(); ++s) check_set(motion, s, list);
  check_gaps(motion, list);
}

}  // namespace clothfit
