#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "calib/boards/calibrate.h"
#include "data/progress.h"
#include "data/recording.h"

namespace clothfit {

/// One camera calibrated from stills of a board.
struct StillsCalibration {
  std::string camera;
  int stills = 0;                            ///< pictures looked at
  std::vector<std::string> board_not_found;  ///< names of the pictures without the whole board
  CalibrateResult result;                    ///< usable
};

/// Finds the board in every still and calibrates. Throws InputError where the stills cannot be read
/// or none shows the board, NoResult where the numbers do not work out, Cancelled.
StillsCalibration calibrate_from_stills(const std::string& camera, const CalibrationStills& stills,
                                        const CalibrateOptions& options,
                                        const ProgressCallback& progress);

/// Writes cameras/NAME.yaml, calibration.json and calibration.csv below `folder`.
void write_calibrations(const std::vector<StillsCalibration>& calibrations,
                        const std::filesystem::path& folder);

struct CalibrateStepResult {
  Recording recording;  ///< as it stands in the step's folder, with camera files
  std::vector<StillsCalibration> calibrations;
};

/// Returns cameras that have stills of a board; without `again`, only those that lack a camera
/// file.
std::vector<std::string> cameras_to_calibrate(const Recording& recording, bool again);

/// Calibrates the named cameras and writes a complete recording into `folder`, which exists. Throws
/// InputError for stills of another size than the camera's pictures.
CalibrateStepResult calibrate_step(const Recording& recording,
                                   const std::vector<std::string>& cameras,
                                   const CalibrateOptions& options,
                                   const std::filesystem::path& folder,
                                   const ProgressCallback& progress);

}  // namespace clothfit
