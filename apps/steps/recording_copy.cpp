#include "apps/steps/recording_copy.h"

#include <fmt/format.h>

#include <system_error>

#include "data/input_error.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

fs::path place_copy(const fs::path& file, const fs::path& target) {
  std::error_code error;
  fs::create_directories(target.parent_path(), error);
  if (!error) fs::copy_file(file, target, fs::copy_options::overwrite_existing, error);
  if (error)
    throw InputError(file.string(), "cannot be copied: " + error.message(),
                     "a file of the recording that can be read, and room for its copy");
  return target;
}

/// Copies one file to the place it has in the recording. When it lies elsewhere, it goes to
/// `folder`/`subfolder`. A name already taken by another file gets a number in front.
fs::path copy_file_into(const fs::path& folder, const fs::path& recording_folder,
                        const fs::path& file, const fs::path& subfolder) {
  const fs::path inside = file.lexically_relative(recording_folder);
  const bool lies_inside = !inside.empty() && *inside.begin() != "..";
  if (lies_inside) return place_copy(file, folder / inside);

  fs::path target = folder / subfolder / file.filename();
  for (int number = 2; fs::exists(target); ++number)
    target = folder / subfolder / fmt::format("{}_{}", number, file.filename().string());
  return place_copy(file, target);
}

}  // namespace

Recording copy_recording(const Recording& recording, const std::filesystem::path& folder) {
  Recording copy = recording;
  copy.folder = folder;
  const auto move_in = [&](fs::path& file, const fs::path& subfolder) {
    file = copy_file_into(folder, recording.folder, file, subfolder);
  };

  if (!copy.markers_file.empty()) move_in(copy.markers_file, "");
  if (copy.times_file) move_in(*copy.times_file, "");
  if (copy.reference_file) move_in(*copy.reference_file, "");
  if (copy.obstacle_file) move_in(*copy.obstacle_file, "");
  if (copy.tracks3d) move_in(*copy.tracks3d, "");
  for (auto& [camera, file] : copy.tracks2d) move_in(file, "tracks2d");
  for (CameraEntry& camera : copy.cameras) {
    if (!camera.file) continue;
    // Cameras may share a file of intrinsics, but each needs its own for its place in the world.
    const char* ending = camera.file->extension() == ".gz" ? ".yaml.gz" : ".yaml";
    camera.file = place_copy(*camera.file, folder / "cameras" / (camera.name + ending));
  }
  for (HeldPoint& held : copy.held)
    if (held.file) move_in(*held.file, "held");
  return copy;
}

}  // namespace clothfit
