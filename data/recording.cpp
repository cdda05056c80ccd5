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

}  // namespace clothfit
