// A recording with its tables and cameras. What reads once must read again after it was written.

#include "data/body_path.h"
#include "data/camera_parameters.h"
#include "data/clouds.h"
#include "data/recording.h"
#include "data/tracks.h"
#include "tests/fuzz/scratch_folder.h"

namespace clothfit {
namespace {

void read_what_it_names(const Recording& recording) {
  if (recording.tracks3d)
    read_or_refuse([&] { read_tracks3d(*recording.tracks3d, recording.markers); });
  for (const auto& tracks : recording.tracks2d)
    read_or_refuse([&] { read_tracks2d(tracks.second, recording.markers); });
  for (const CameraEntry& camera : recording.cameras)
    if (camera.file) read_or_refuse([&] { read_camera(*camera.file); });
  for (const RigidBody& body : recording.bodies) read_or_refuse([&] { read_body_path(body.file); });
  for (const HeldPoint& point : recording.held)
    if (point.file) read_or_refuse([&] { read_held_path(*point.file); });
  if (recording.clouds) read_or_refuse([&] { read_point_clouds(recording.clouds->folder); });
  read_or_refuse([&] { recording.frame_time_s(2); });
}

}  // namespace
}  // namespace clothfit

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, size_t size) {
  using namespace clothfit;
  const auto& folder = write_files(files_of(text_of(data, size), "recording.yaml"));
  Recording recording;
  try {
    recording = read_recording(folder);
  } catch (const InputError&) {
    return 0;
  }
  read_what_it_names(recording);
  input_paths(recording);
  write_recording(recording, folder);
  read_recording(folder);
  return 0;
}
