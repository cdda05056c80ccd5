#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace clothfit {

/// The result of one fit for one kind of observation. Errors are root mean squares of the distance,
/// in `unit`; NaN where there is none. Where nothing was fitted, only `recording`, `folder`,
/// `model` and `reason` are filled in.
struct StudyRow {
  std::string recording;  ///< its name; of the folder where the recording cannot be read
  std::string folder;
  std::string model;
  bool fitted = false;
  std::string stop;    ///< converged, reached a limit, ...
  std::string reason;  ///< why there is no fit, or how it stopped
  std::string kind;    ///< "tracks3d" or the camera's name
  std::string unit;    ///< "m" or "px"

  double fitted_rms = 0;    ///< on the frames that were fitted
  double held_out_rms = 0;  ///< on those that were held out
  double whole_rms = 0;     ///< on all frames: one free run from the start to the end
  double first_frame_rms = 0, last_velocity_rms = 0, rigid_rms = 0;  ///< guesses, held out
  double whole_rigid_rms = 0;                                        ///< on all frames
  double noise = 0;  ///< noise of the observations, as a distance

  /// Errors of the model and of the rigid guess over all frames. Markers are weighed as in the
  /// study, those that drive held points included. NaN without weights.
  double weighted_rms = 0, weighted_rigid_rms = 0;
  double published_rms = 0;  ///< stated by others for the recording's weighted error, or NaN

  /// Errors with each marker's mean error on the fitted frames subtracted from the predictions:
  /// held out, of the model and of the rigid guess; all frames, weighed, of the model.
  double centred_held_out_rms = 0, centred_rigid_rms = 0, centred_weighted_rms = 0;

  std::map<std::string, double> parameters;  ///< by name; EFFECT.NAME for an effect
  double seconds = 0;                        ///< for the fit
};

}  // namespace clothfit
