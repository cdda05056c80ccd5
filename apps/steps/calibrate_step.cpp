#include "apps/steps/calibrate_step.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <utility>

#include "apps/steps/picture_size.h"
#include "apps/steps/recording_copy.h"
#include "apps/terminal/csv_table.h"
#include "apps/terminal/exit_code.h"
#include "apps/terminal/json_file.h"
#include "data/input_error.h"
#include "vision/detect/chessboard.h"
#include "vision/ingest/open_images.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

nlohmann::ordered_json to_json(const StillsCalibration& calibration) {
  const CalibrateResult& result = calibration.result;
  nlohmann::ordered_json json;
  json["camera"] = calibration.camera;
  json["message"] = result.message;
  json["image_size"] = {result.camera.image_width, result.camera.image_height};
  json["rms"] = result.rms_px;
  json["corners"] = {{"used", result.corners_used}, {"rejected", result.corners_rejected}};
  json["intrinsics"] = nlohmann::ordered_json::array();
  for (const NamedSigma& parameter : result.intrinsics) {
    json["intrinsics"].push_back(
        {{"name", parameter.name}, {"value", parameter.value}, {"sigma", parameter.sigma}});
  }
  json["views"] = nlohmann::ordered_json::array();
  for (const ViewError& view : result.views) {
    json["views"].push_back({{"name", view.name},
                             {"rms", view.rms_px},
                             {"used", view.used},
                             {"rejected", view.rejected}});
  }
  json["board_not_found"] = calibration.board_not_found;
  return json;
}

CameraEntry& camera_named(Recording& recording, const std::string& name) {
  return *std::find_if(recording.cameras.begin(), recording.cameras.end(),
                       [&](const CameraEntry& camera) { return camera.name == name; });
}

}  // namespace

StillsCalibration calibrate_from_stills(const std::string& camera, const CalibrationStills& stills,
                                        const CalibrateOptions& options,
                                        const ProgressCallback& progress) {
  const std::unique_ptr<ImageSource> source = open_images(stills.images);
  StillsCalibration calibration;
  calibration.camera = camera;
  std::vector<BoardView> views;
  cv::Mat grey;
  cv::Size size;
  while (source->next(grey)) {
    ++calibration.stills;
    if (!source->damage().empty()) {
      calibration.board_not_found.push_back(source->current_name() + " (damaged)");
      continue;
    }
    size = grey.size();
    if (auto corners = find_chessboard(grey, stills.board))
      views.push_back({source->current_name(), std::move(*corners)});
    else
      calibration.board_not_found.push_back(source->current_name());
    const Progress now{.stage = "calibrate " + camera,
                       .done = static_cast<double>(calibration.stills),
                       .total = static_cast<double>(source->count()),
                       .unit = "stills",
                       .note = fmt::format("{} boards found", views.size())};
    if (!progress(now)) throw Cancelled();
  }
  if (views.empty())
    throw InputError(stills.images.string(),
                     fmt::format("none of the {} stills shows the whole board", calibration.stills),
                     fmt::format("a chessboard with {} x {} inner corners", stills.board.columns,
                                 stills.board.rows),
                     "count the board's inner corners (squares minus one in each direction)");

  calibration.result = calibrate(stills.board, views, size.width, size.height, options);
  if (!calibration.result.usable)
    throw NoResult(
        fmt::format("camera '{}' was not calibrated: {}", camera, calibration.result.message));
  calibration.result.camera.name = camera;
  return calibration;
}

void write_calibrations(const std::vector<StillsCalibration>& calibrations,
                        const std::filesystem::path& folder) {
  fs::create_directories(folder / "cameras");
  nlohmann::ordered_json json;
  json["format"] = "clothfit-calibration/1";
  json["cameras"] = nlohmann::ordered_json::array();
  std::vector<std::vector<std::string>> rows;
  for (const StillsCalibration& calibration : calibrations) {
    write_camera(calibration.result.camera, folder / "cameras" / (calibration.camera + ".yaml"));
    json["cameras"].push_back(to_json(calibration));
    for (const NamedSigma& parameter : calibration.result.intrinsics) {
      rows.push_back({calibration.camera, parameter.name, fmt::format("{}", parameter.value),
                      fmt::format("{}", parameter.sigma)});
    }
  }
  write_json(json, folder / "calibration.json");
  write_csv_table({{"camera", "parameter", "value", "sigma"}, rows}, folder / "calibration.csv");
}

std::vector<std::string> cameras_to_calibrate(const Recording& recording, bool again) {
  std::vector<std::string> names;
  for (const CameraEntry& camera : recording.cameras)
    if (camera.calibration && (again || !camera.file)) names.push_back(camera.name);
  return names;
}

CalibrateStepResult calibrate_step(const Recording& recording,
                                   const std::vector<std::string>& cameras,
                                   const CalibrateOptions& options,
                                   const std::filesystem::path& folder,
                                   const ProgressCallback& progress) {
  CalibrateStepResult step;
  step.recording = copy_recording(recording, folder);
  for (const std::string& name : cameras) {
    CameraEntry& camera = camera_named(step.recording, name);
    if (camera.images) {
      const PictureSize stills = picture_size(camera.calibration->images);
      const PictureSize frames = picture_size(*camera.images);
      if (stills != frames)
        throw InputError(
            camera.calibration->images.string(),
            fmt::format("the stills are {}", to_string(stills)),
            fmt::format("{}, the size of the pictures in {}", to_string(frames),
                        camera.images->string()),
            "photograph the board with the settings of the recording, or scale the stills");
    }
    step.calibrations.push_back(
        calibrate_from_stills(name, *camera.calibration, options, progress));
    camera.file = folder / "cameras" / (name + ".yaml");
  }
  write_calibrations(step.calibrations, folder);
  write_recording(step.recording, folder);
  return step;
}

}  // namespace clothfit
