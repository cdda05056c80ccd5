#include "vision/ingest/footage.h"

#include <fmt/core.h>

#include <algorithm>
#include <numeric>

#include "data/input_error.h"
#include "vision/ingest/frame_times.h"
#include "vision/ingest/open_images.h"

namespace clothfit {
namespace {

void add(Findings& findings, const Findings& more) {
  findings.insert(findings.end(), more.begin(), more.end());
}

std::vector<int> in_order(int count) {
  std::vector<int> frames(static_cast<size_t>(count));
  std::iota(frames.begin(), frames.end(), 0);
  return frames;
}

/// Numbers pictures of a folder, of which some are missing, among so many frames. Names may count
/// from 0, from 1, or from the first picture on, whichever makes the last picture the last frame.
void number_by_names(const std::string& file, const std::string& where, int frames,
                     ImageSource& images, Findings& findings) {
  const std::vector<std::int64_t> numbers = images.name_numbers();
  if (numbers.empty()) return;
  std::vector<std::int64_t> bases;
  for (const std::int64_t base : {std::int64_t{0}, std::int64_t{1}, numbers.front()})
    if (base <= numbers.front() && numbers.back() - base < frames) bases.push_back(base);
  if (bases.empty()) return;  // what counts beyond the frames is refused by its frame
  const auto ends = std::ranges::find(bases, numbers.back() - (frames - 1));
  const std::int64_t base = ends != bases.end() ? *ends : numbers.front();
  std::vector<int> number;
  for (const std::int64_t one : numbers) number.push_back(static_cast<int>(one - base));
  images.number_frames(std::move(number));
  if (ends == bases.end() && numbers.front() > 1)
    findings.push_back(
        {.check = "time",
         .state = FindingState::warning,
         .found = fmt::format("it lists {} frames, and the pictures of {} are numbered {} to {}; "
                              "the first is taken for frame 0",
                              frames, where, numbers.front(), numbers.back()),
         .where = file,
         .expected = "numbers that begin or end with the frames",
         .remedy = "give the time of every picture, and of no other"});
}

/// Numbers pictures by the times that times.csv gives to frames.
void number_by_file(const Recording& recording, const std::string& where, ImageSource& images,
                    Findings& findings) {
  const auto frames = static_cast<int>(recording.times_s.size());
  const int pictures = images.count();
  const std::string file = recording.times_file->string();
  if (pictures > frames)
    throw InputError(
        file, fmt::format("lists {} frames, but {} holds {} pictures", frames, where, pictures),
        "a time for each picture", "give the time of every picture");
  if (pictures == frames) {
    images.number_frames(in_order(pictures));
    return;
  }
  const std::vector<double> times_s = images.times_s();
  if (times_s.empty()) {
    number_by_names(file, where, frames, images, findings);
    return;
  }
  if (const auto by_time = number_by_times(recording.times_s, times_s)) {
    images.number_frames(*by_time);
    return;
  }
  findings.push_back({.check = "time",
                      .state = FindingState::warning,
                      .found = fmt::format("it lists {} frames, {} holds {} pictures, and their "
                                           "times differ; they are taken in order",
                                           frames, where, pictures),
                      .where = file,
                      .expected = "a picture for each frame",
                      .remedy = "give the time of every picture, and of no other"});
}

/// Takes the times that the videos state for those of the recording.
void number_by_videos(const std::string& yaml, Footage& footage) {
  std::map<std::string, std::vector<double>> times_of_camera_s;
  for (const auto& [camera, images] : footage.cameras) {
    times_of_camera_s[camera] = images->times_s();
    if (times_of_camera_s[camera].empty())
      throw InputError(
          yaml,
          fmt::format("`time` is not given, and the pictures of camera '{}' have none", camera),
          "{frame_rate: FRAMES_PER_SECOND} or {file: times.csv}",
          "give the rate at which the pictures were taken");
  }
  JointTimes joint = join_times(times_of_camera_s, yaml);
  for (auto& [camera, frames] : joint.frame_of_picture)
    footage.cameras.at(camera)->number_frames(std::move(frames));
  footage.times_s = std::move(joint.times_s);
  add(footage.findings, joint.findings);
}

}  // namespace

Footage open_footage(const Recording& recording, const std::vector<std::string>& cameras) {
  const std::string yaml = (recording.folder / "recording.yaml").string();
  Footage footage;
  for (const std::string& name : cameras)
    footage.cameras[name] = open_images(*recording.find_camera(name)->images);

  if (!recording.frame_rate_hz && !recording.times_file) {
    number_by_videos(yaml, footage);
    return footage;
  }
  for (const auto& [name, images] : footage.cameras) {
    const std::string where = recording.find_camera(name)->images->string();
    if (recording.times_file) {
      number_by_file(recording, where, *images, footage.findings);
    } else if (const std::vector<double> times_s = images->times_s(); !times_s.empty()) {
      FrameNumbers numbers = number_by_rate(times_s, *recording.frame_rate_hz, where, yaml);
      images->number_frames(std::move(numbers.frame_of_picture));
      add(footage.findings, numbers.findings);
    }
  }
  return footage;
}

}  // namespace clothfit
