#include "vision/ingest/frame_times.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "data/input_error.h"
#include "data/median.h"
#include "vision/ingest/frame_list.h"

namespace clothfit {
namespace {

/// What a time may lie beside its frame. A share of the interval: raised, an uneven rate passes,
/// and displacements err by that share of the way between frames. Besides, half a millisecond: some
/// containers count in whole ones.
constexpr double kShareOfInterval = 0.1, kRounding_s = 0.6e-3, kMostOfInterval = 0.4;

double tolerance_s(double interval_s) {
  return std::min(kShareOfInterval * interval_s + kRounding_s, kMostOfInterval * interval_s);
}

double mean_rate_hz(const std::vector<double>& times_s) {
  return static_cast<double>(times_s.size() - 1) / (times_s.back() - times_s.front());
}

/// Says how the pictures lie in time: "57 pictures in 1.18 s, 47.5 per second in the mean, with
/// 16.7 to 33.3 ms between them".
std::string spacing(const std::vector<double>& times_s) {
  double shortest = INFINITY, longest = 0;
  for (size_t i = 1; i < times_s.size(); ++i) {
    shortest = std::min(shortest, times_s[i] - times_s[i - 1]);
    longest = std::max(longest, times_s[i] - times_s[i - 1]);
  }
  return fmt::format(
      "{} pictures in {:.4g} s, {:.5g} per second in the mean, with {:.4g} to {:.4g} ms between "
      "them",
      times_s.size(), times_s.back() - times_s.front(), mean_rate_hz(times_s), 1e3 * shortest,
      1e3 * longest);
}

/// Returns the nearest of rising times.
int nearest(const std::vector<double>& times_s, double time_s) {
  const auto after = std::lower_bound(times_s.begin(), times_s.end(), time_s);
  const auto index = static_cast<int>(after - times_s.begin());
  if (after == times_s.end()) return index - 1;
  return index > 0 && time_s - times_s[static_cast<size_t>(index - 1)] < *after - time_s ? index - 1
                                                                                         : index;
}

/// How pictures lie beside frames.
struct Match {
  std::vector<int> frames;  ///< the nearest of each
  double worst_s = 0;       ///< distance
  size_t worst_picture = 0;
  bool one_each = true;
};

Match match(const std::vector<double>& frame_times_s, const std::vector<double>& times_s,
            double offset_s) {
  Match match;
  for (size_t p = 0; p < times_s.size(); ++p) {
    const double time_s = times_s[p] + offset_s;
    const int frame = nearest(frame_times_s, time_s);
    const double beside_s = std::abs(frame_times_s[static_cast<size_t>(frame)] - time_s);
    if (beside_s > match.worst_s) {
      match.worst_s = beside_s;
      match.worst_picture = p;
    }
    match.one_each = match.one_each && (match.frames.empty() || frame > match.frames.back());
    match.frames.push_back(frame);
  }
  return match;
}

double median_interval_s(const std::vector<double>& times_s) {
  std::vector<double> intervals_s;
  for (size_t i = 1; i < times_s.size(); ++i) intervals_s.push_back(times_s[i] - times_s[i - 1]);
  return intervals_s.empty() ? 0 : median(intervals_s);
}

/// Returns how far apart pictures of one frame may lie.
double allowed_s(const std::vector<double>& frame_times_s) {
  return median_interval_s(frame_times_s) / 4;
}

bool agree(const Match& match, const std::vector<double>& frame_times_s) {
  return match.one_each && match.worst_s <= allowed_s(frame_times_s);
}

/// Compares times as they stand or, where that fails, from the first of both on.
Match best_match(const std::vector<double>& frame_times_s, const std::vector<double>& times_s) {
  Match found = match(frame_times_s, times_s, 0);
  if (agree(found, frame_times_s)) return found;
  return match(frame_times_s, times_s, frame_times_s.front() - times_s.front());
}

/// Adds the times at which a camera took pictures and the frames have a gap: both dropped some.
std::vector<double> with_dropped(const std::vector<double>& frame_times_s,
                                 const std::vector<double>& times_s, double offset_s) {
  constexpr double kApart = 0.75;  // intervals from the frames beside it
  const double least_s = kApart * median_interval_s(frame_times_s);
  std::vector<double> all_s = frame_times_s;
  for (const double time_s : times_s) {
    const double at_s = time_s + offset_s;
    const double beside_s = std::abs(all_s[static_cast<size_t>(nearest(all_s, at_s))] - at_s);
    const bool within = at_s > frame_times_s.front() && at_s < frame_times_s.back();
    if (within && beside_s >= least_s) all_s.insert(std::ranges::lower_bound(all_s, at_s), at_s);
  }
  return all_s;
}

}  // namespace

FrameNumbers number_by_rate(const std::vector<double>& times_s, double rate_hz,
                            const std::string& video, const std::string& yaml) {
  FrameNumbers numbers;
  const double interval_s = 1 / rate_hz;
  double least = 0, most = 0;  // of what the times lie beside the grid through the first
  for (const double time_s : times_s) {
    const double frames = (time_s - times_s.front()) * rate_hz;
    numbers.frame_of_picture.push_back(static_cast<int>(std::lround(frames)));
    const double beside_s = (frames - std::round(frames)) * interval_s;
    least = std::min(least, beside_s);
    most = std::max(most, beside_s);
  }
  const bool one_each = std::ranges::adjacent_find(numbers.frame_of_picture, [](int a, int b) {
                          return b <= a;
                        }) == numbers.frame_of_picture.end();
  const double beside_s = (most - least) / 2;
  // Single pictures may be missing. Where most are, the rate is another one.
  const bool mostly_there = times_s.size() < 2 || median_interval_s(times_s) < 1.5 * interval_s;
  if (!one_each || !mostly_there || beside_s > tolerance_s(interval_s))
    throw InputError(
        yaml,
        fmt::format("frame_rate is {:.6g}, but {} holds {}", rate_hz, video, spacing(times_s)),
        "the rate of the pictures' own times",
        "leave `time` out, and the times in the video are used; where the video plays "
        "slower than it was filmed, give times.csv");
  std::vector<int> missing;
  for (size_t p = 1; p < times_s.size(); ++p)
    for (int f = numbers.frame_of_picture[p - 1] + 1; f < numbers.frame_of_picture[p]; ++f)
      missing.push_back(f);
  if (!missing.empty())
    numbers.findings.push_back(missing_frames(missing, numbers.frame_of_picture.back() + 1, video));
  return numbers;
}

JointTimes join_times(const std::map<std::string, std::vector<double>>& times_of_camera_s,
                      const std::string& yaml) {
  JointTimes joint;
  std::string most_pictures;
  for (const auto& [camera, times_s] : times_of_camera_s) {
    if (times_s.size() <= joint.times_s.size()) continue;
    joint.times_s = times_s;
    most_pictures = camera;
  }
  // Offsets by which times of cameras are moved to those of the camera with most pictures.
  std::map<std::string, double> offset_s;
  const std::vector<double> most_s = joint.times_s;
  for (const auto& [camera, times_s] : times_of_camera_s) {
    const std::vector<double> all_s = with_dropped(joint.times_s, times_s, 0);
    const bool stand = agree(match(all_s, times_s, 0), most_s);
    if (!stand) offset_s[camera] = most_s.front() - times_s.front();
    joint.times_s = stand ? all_s : with_dropped(joint.times_s, times_s, offset_s[camera]);
  }
  for (const auto& [camera, times_s] : times_of_camera_s) {
    Match found = match(joint.times_s, times_s, offset_s[camera]);
    if (const double offset = offset_s[camera]; std::abs(offset) > allowed_s(most_s))
      joint.findings.push_back(
          {.check = "time",
           .state = FindingState::warning,
           .found = fmt::format("the first pictures of cameras '{}' and '{}' are taken for one "
                                "moment, though their times are {:.4g} s apart",
                                camera, most_pictures, std::abs(offset)),
           .where = yaml,
           .expected = "cameras whose clocks agree, or that were started by one signal",
           .remedy = "give times.csv where they were not"});
    if (!found.one_each || found.worst_s > allowed_s(joint.times_s))
      throw InputError(
          yaml,
          fmt::format("picture {} of camera '{}' lies {:.3g} ms beside the nearest of camera '{}'",
                      found.worst_picture, camera, 1e3 * found.worst_s, most_pictures),
          fmt::format("cameras that take pictures together, within {:.3g} ms",
                      1e3 * allowed_s(joint.times_s)),
          "trigger the cameras together, or fit one of them alone");
    joint.frame_of_picture[camera] = std::move(found.frames);
  }
  return joint;
}

std::optional<std::vector<int>> number_by_times(const std::vector<double>& frame_times_s,
                                                const std::vector<double>& times_s) {
  Match found = best_match(frame_times_s, times_s);
  if (!found.one_each || found.worst_s > allowed_s(frame_times_s)) return std::nullopt;
  return std::move(found.frames);
}

}  // namespace clothfit
