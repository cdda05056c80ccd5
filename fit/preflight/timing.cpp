#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
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
  double step = 0;       ///< the ways, as a share of that mean's, whatever the times say
  double agreement = 0;  ///< cosine between the two
  double evenness = 0;   ///< of the velocities before and after: their product by the larger square
  double alike = 0;      ///< cosine between the steps before and after
  double of_least = 1;   ///< the step's size, as a share of the smaller of those two
  double least = 0;      ///< root mean square of that smaller step, a coordinate, in units
  double shift = 0;      ///< root mean square of what the mean moves a coordinate, in units
  double off = 0;        ///< of the velocities less that mean, in units per second
};

IntervalMotion interval_motion(const RecordedMotion& motion, int s, int frame) {
  const std::vector<double>& time_s = motion.time_s();
  const auto at = [&](int f) { return time_s[static_cast<size_t>(f)]; };
  const Eigen::MatrixXd a = motion.places(s, frame - 1), b = motion.places(s, frame),
                        c = motion.places(s, frame + 1), d = motion.places(s, frame + 2);
  double by_mean = 0, squares = 0, mean_squares = 0, across = 0, before2 = 0, after2 = 0;
  double off = 0, steps = 0, mean_steps = 0, steps_before = 0, steps_after = 0, steps_across = 0;
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
    steps_before += (b.col(m) - a.col(m)).squaredNorm();
    steps_after += (d.col(m) - c.col(m)).squaredNorm();
    steps_across += (b.col(m) - a.col(m)).dot(d.col(m) - c.col(m));
    across += before.dot(after);
    off += (now - mean).squaredNorm();
    before2 += before.squaredNorm();
    after2 += after.squaredNorm();
    ++markers;
    coordinates += static_cast<int>(mean.size());
  }
  if (markers < kFewestMarkers || !(mean_squares > 0)) return {};
  const double interval_s = at(frame + 1) - at(frame);
  const double least_steps = std::min(steps_before, steps_after);
  return {.factor = by_mean / mean_squares,
          .step = mean_steps > 0 ? std::sqrt(steps / mean_steps) : 1,
          .agreement = squares > 0 ? by_mean / std::sqrt(squares * mean_squares) : 0,
          .evenness = across / std::max(before2, after2),
          .alike = least_steps > 0 ? steps_across / std::sqrt(steps_before * steps_after) : 0,
          .of_least = least_steps > 0 ? std::sqrt(steps / least_steps) : 1,
          .least = std::sqrt(least_steps / coordinates),
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

/// Frames that are out of step with those about them.
struct OutOfStep {
  std::vector<int> jumps, repeats;  ///< the frame before a jump; a frame that repeats the last
  double largest = 0;               ///< velocity in a jump, of that before and after
  bool moves = false;               ///< whether any interval shows motion
};

/// Returns frames whose markers all stand, to the last digit, where the frame before has them,
/// while the cloth moves by more than `seen` before such a run of frames and behind it.
std::vector<int> exact_copies(const RecordedMotion& motion, int s, double seen) {
  constexpr int kLongest = 12;
  std::vector<double> step;  // root mean square of a coordinate; NaN where too few are seen
  Eigen::MatrixXd last = motion.places(s, 0);
  for (int f = 0; f < motion.frames(); ++f) {
    const Eigen::MatrixXd place = motion.places(s, f);
    double sum = 0;
    Eigen::Index seen_in_both = 0;
    for (Eigen::Index m = 0; m < place.cols(); ++m)
      if (const double square = (place.col(m) - last.col(m)).squaredNorm(); std::isfinite(square)) {
        sum += square;
        ++seen_in_both;
      }
    step.push_back(seen_in_both >= kFewestMarkers
                       ? std::sqrt(sum / static_cast<double>(seen_in_both * place.rows()))
                       : NAN);
    last = place;
  }
  std::vector<int> copies;
  for (int f = 2; f + 1 < motion.frames(); ++f) {
    if (step[static_cast<size_t>(f)] != 0) continue;
    int before = f, after = f;
    while (before > 1 && f - before < kLongest && step[static_cast<size_t>(before)] == 0) --before;
    while (after + 1 < motion.frames() && after - f < kLongest &&
           step[static_cast<size_t>(after)] == 0)
      ++after;
    if (step[static_cast<size_t>(before)] > seen && step[static_cast<size_t>(after)] > seen)
      copies.push_back(f);
  }
  return copies;
}

OutOfStep out_of_step(const RecordedMotion& motion, int s) {
  const double seen =
      std::max(motion.set(s).noise, kPreflight.moves * motion.size_m() * motion.units_per_m(s));
  std::vector<IntervalMotion> intervals;
  std::vector<double> usual;
  OutOfStep found;
  for (int f = 1; f + 2 < motion.frames(); ++f) {
    const IntervalMotion now = interval_motion(motion, s, f);
    intervals.push_back(now);
    if (now.shift > seen) usual.push_back(now.off);
    // Whatever the times say: a copy is not moved at all.
    if (now.least > seen && now.of_least < kPreflight.repeat && now.alike > kPreflight.repeats_way)
      found.repeats.push_back(f + 1);
  }
  std::ranges::copy(exact_copies(motion, s, motion.set(s).noise),
                    std::back_inserter(found.repeats));
  std::ranges::sort(found.repeats);
  found.repeats.erase(std::ranges::unique(found.repeats).begin(), found.repeats.end());
  found.moves = !usual.empty();
  if (!found.moves) return found;
  const double rough = kPreflight.out_of_step * median(std::move(usual));
  for (int f = 1; f + 2 < motion.frames(); ++f) {
    const IntervalMotion& now = intervals[static_cast<size_t>(f - 1)];
    if (now.off < rough || now.shift < seen || now.evenness < kPreflight.alike_intervals) continue;
    if (std::min(now.factor, now.step) < kPreflight.jump || now.agreement < kPreflight.jump_agrees)
      continue;
    // What follows a copy in the place of a lost frame is explained by it.
    const bool beside_copy =
        std::ranges::any_of(found.repeats, [f](int repeat) { return std::abs(repeat - f) <= 1; });
    if (beside_copy) continue;
    found.jumps.push_back(f);
    found.largest = std::max(found.largest, now.factor);
  }
  return found;
}

/// Says that frames are missing. It is certain where no held point moves and no times are measured,
/// so that nothing else makes all markers go a whole number of steps at once.
void report_jumps(const RecordedMotion& motion, const std::string& kind, const OutOfStep& found,
                  CheckList& list) {
  const Recording& recording = motion.recording();
  const bool timed = recording.times_file.has_value();
  const bool driven = std::ranges::any_of(
      recording.held, [](const HeldPoint& point) { return point.motion != HeldMotion::fixed; });
  const double whole = std::round(found.largest);
  const bool is_whole = std::abs(found.largest - whole) < kPreflight.whole_steps * std::sqrt(whole);
  std::string text = fmt::format(
      "all markers of {} move {:.1f} times as fast between frames {} and {} as before and after",
      kind, found.largest, found.jumps.front(), found.jumps.front() + 1);
  if (found.jumps.size() > 1) text += fmt::format(", and so in {} places", found.jumps.size());
  const bool certain = is_whole && !timed && !driven;
  list.add("time", certain ? FindingState::refused : FindingState::warning, list.file(), text,
           timed ? "times that fit the frames"
                 : fmt::format("frames that are evenly spaced: {:.0f} seem to be missing there",
                               std::max(1.0, whole - 1)),
           timed ? "look at the times file there"
                 : "give a times.csv with the time of every frame, or number the frames with their "
                   "gaps");
}

void report_repeats(const RecordedMotion& motion, const std::string& kind,
                    const std::vector<int>& repeats, CheckList& list) {
  const bool every_second =
      static_cast<double>(repeats.size()) > kPreflight.every_second * motion.frames();
  list.warn("time",
            fmt::format("all markers of {} stand still in {} {} while the cloth moves", kind,
                        repeats.size() > 1 ? fmt::format("{} frames:", repeats.size()) : "frame",
                        frames_text(repeats)),
            "every frame of its own",
            every_second ? "the recording was made at a lower rate: leave out the copies, and give "
                           "its own frame rate"
                         : "a frame was written twice: leave out the copies, and number the others "
                           "as they were taken");
}

void check_set(const RecordedMotion& motion, int s, CheckList& list) {
  const std::string& kind = motion.set(s).kind;
  const OutOfStep found = out_of_step(motion, s);
  if (!found.repeats.empty()) report_repeats(motion, kind, found.repeats, list);
  if (!found.jumps.empty()) report_jumps(motion, kind, found, list);
  if (found.repeats.empty() && found.jumps.empty() && found.moves)
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
  // Frames that are numbered with their gaps are what they should be.
  const bool at_start = !empty.empty() && empty.front() == 0;
  if (!at_start && 2 * std::ssize(empty) < motion.frames()) return;
  list.warn("time",
            fmt::format("{} of {} frames show no marker: {}", empty.size(), motion.frames(),
                        frames_text(empty)),
            "frames that follow each other", "look at the frame column, and at those pictures");
}

}  // namespace

void check_timing(const RecordedMotion& motion, CheckList& list) {
  const bool may_drop = std::ranges::any_of(
      motion.recording().declared,
      [](const DeclaredEffect& effect) { return effect.name == "dropped_frames"; });
  for (int s = 0; s < motion.sets() && !may_drop; ++s) check_set(motion, s, list);
  check_gaps(motion, list);
}

}  // namespace clothfit
