#include "apps/steps/recording_copy.h"

#include <fmt/format.h>

#include <map>
#include <string>
#include <system_error>

#include "data/input_error.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

/// Allots a place of its own to every file that is copied into a result.
class CopyPlaces {
 public:
  CopyPlaces(const Recording& recording, const fs::path& folder)
      : recording_folder_(recording.folder), folder_(folder) {
    // What the steps write themselves comes first.
    for (const char* name : {"recording.yaml", "tracks.json", "calibration.json", "calibration.csv",
                             "report.html", ".clothfit"})
      owner_.emplace(name, kResult);
    for (const CameraEntry& camera : recording.cameras) {
      owner_.emplace(camera_place(camera), camera.name);
      owner_.emplace(tracks_place(camera.name), camera.name);
    }
  }

  /// Copies a file to the place it has in the recording, or to `subfolder` when it lies elsewhere.
  /// At a place that another `owner` has, it gets a number in front.
  void move_in(fs::path& file, const fs::path& subfolder, const std::string& owner = "") {
    fs::path place = file.lexically_relative(recording_folder_);
    if (place.empty() || *place.begin() == "..") place = subfolder / file.filename();
    file = copy_to(file, free_place(place.lexically_normal(), owner));
  }
  /// Cameras may share a file of intrinsics, but each needs its own for its place in the world.
  void move_in_camera(CameraEntry& camera) {
    if (camera.file) camera.file = copy_to(*camera.file, camera_place(camera));
  }

 private:
  static constexpr const char* kResult = "/";  // no camera has this name

  static fs::path camera_place(const CameraEntry& camera) {
    const bool packed = camera.file && camera.file->extension() == ".gz";
    return fs::path("cameras") / (camera.name + (packed ? ".yaml.gz" : ".yaml"));
  }
  static fs::path tracks_place(const std::string& camera) {
    return fs::path("tracks2d") / (camera + ".csv");
  }

  fs::path free_place(const fs::path& wanted, const std::string& owner) {
    fs::path place = wanted;
    for (int number = 2;; ++number) {
      const auto [at, is_free] = owner_.emplace(place, kResult);
      if (is_free) return place;
      if (at->second == owner && place == wanted) {
        at->second = kResult;
        return place;
      }
      place = wanted.parent_path() / fmt::format("{}_{}", number, wanted.filename().string());
    }
  }

  fs::path copy_to(const fs::path& file, const fs::path& place) const {
    const fs::path target = folder_ / place;
    std::error_code error;
    fs::create_directories(target.parent_path(), error);
    if (error)
      throw InputError(target.parent_path().string(), "cannot be made: " + error.message(),
                       "a writable folder with room on its disk");
    fs::copy_file(file, target, error);
    if (error)
      throw InputError(file.string(), "cannot be copied: " + error.message(),
                       "a file of the recording that can be read, and room for its copy");
    return target;
  }

  fs::path recording_folder_, folder_;
  std::map<fs::path, std::string> owner_;  ///< place in the result -> camera, or kResult
};

}  // namespace

Recording copy_recording(const Recording& recording, const std::filesystem::path& folder) {
  Recording copy = recording;
  copy.folder = folder;
  CopyPlaces places(recording, folder);
  if (!copy.markers_file.empty()) places.move_in(copy.markers_file, "");
  if (copy.times_file) places.move_in(*copy.times_file, "");
  if (copy.reference_file) places.move_in(*copy.reference_file, "");
  if (copy.obstacle_file) places.move_in(*copy.obstacle_file, "");
  if (copy.tracks3d) places.move_in(*copy.tracks3d, "");
  for (auto& [camera, file] : copy.tracks2d) places.move_in(file, "tracks2d", camera);
  for (CameraEntry& camera : copy.cameras) places.move_in_camera(camera);
  for (HeldPoint& held : copy.held)
    if (held.file) places.move_in(*held.file, "held");
  return copy;
}

}  // namespace clothfit
