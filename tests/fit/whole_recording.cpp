#include "tests/fit/whole_recording.h"

#include <cstdlib>
#include <fstream>

#include "data/recording.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

const fs::path kSource = CLOTHFIT_SOURCE_DIR;

}  // namespace

FitInput whole_recording(const fs::path& folder) {
  FitInput input{.recording = read_recording(folder)};
  const Recording& recording = input.recording;
  if (recording.tracks3d) input.tracks3d = read_tracks3d(*recording.tracks3d, recording.markers);
  for (const auto& [camera, file] : recording.tracks2d) {
    input.tracks2d[camera] = read_tracks2d(file, recording.markers);
    input.cameras.push_back(read_camera(*recording.find_camera(camera)->file));
  }
  return input;
}

FitInput bundled_recording(const std::string& name) {
  return whole_recording(kSource / "data" / "recordings" / name);
}

nlohmann::json bundled_truth(const std::string& name) {
  std::ifstream file(kSource / "tests" / "fixtures" / "truth" / name / "truth.json");
  return nlohmann::json::parse(file);
}

fs::path further_data() {
  const char* data = std::getenv("CLOTHFIT_DATA");
  return data != nullptr ? fs::path(data) : fs::path();
}

}  // namespace clothfit
