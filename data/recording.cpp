#include "data/recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>

#include "data/input_error.h"

namespace clothfit {

double Recording::frame_time_s(int frame) const {
  if (frame_rate_hz) return frame / *frame_rate_hz;
  assert(frame >= 0);
  if (!times_file && times_s.empty())
    throw InputError((folder / "recording.yaml").string(),
                     "no `time` is given, and the videos were not looked at", "times of the frames",
                     "track the recording first, or give `time: {frame_rate: ...}`");
  if (frame >= static_cast<int>(times_s.size()))
    throw InputError(times_file ? times_file->string() : name,
                     fmt::format("there is no time for frame {}", frame),
                     "a time for every frame that the tracks name",
                     fmt::format("the last one is frame {}", times_s.size() - 1));
  return times_s[static_cast<size_t>(frame)];
}

const CameraEntry* Recording::find_camera(const std::string& camera_name) const {
  const auto found = std::find_if(cameras.begin(), cameras.end(), [&](const CameraEntry& camera) {
    return camera.name == camera_name;
  });
  return found == cameras.end() ? nullptr : &*found;
}

std::vector<std::filesystem::path> input_paths(const Recording& recording) {
  std::vector<std::filesystem::path> paths{recording.folder, recording.markers_file};
  const auto add = [&paths](const std::optional<std::filesystem::path>& path) {
    if (path) paths.push_back(*path);
  };
  add(recording.times_file);
  add(recording.reference_file);
  add(recording.obstacle_file);
  add(recording.tracks3d);
  for (const auto& [camera, file] : recording.tracks2d) paths.push_back(file);
  for (const CameraEntry& camera : recording.cameras) {
    add(camera.file);
    add(camera.images);
    if (camera.calibration) paths.push_back(camera.calibration->images);
  }
  for (const RigidBody& body : recording.bodies) paths.push_back(body.file);
  if (recording.clouds) paths.push_back(recording.clouds->folder);
  for (const HeldPoint& held : recording.held) add(held.file);
  std::erase_if(paths, [](const std::filesystem::path& path) { return path.empty(); });
  return paths;
}

}  // namespace clothfit
