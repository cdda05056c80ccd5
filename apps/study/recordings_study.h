#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/study/marker_weights.h"
#include "apps/study/published_errors.h"
#include "data/progress.h"
#include "fit/fit.h"
#include "fit/journal.h"

namespace clothfit {

/// A model that every recording of a study is fitted with: springs and weight, what a recording
/// declares, and these effects.
struct StudiedModel {
  std::string name;
  std::vector<std::string> effects;
  bool marker_offsets = false;  ///< constants beside the markers' places (fit/marker_offsets.h)
};

struct RecordingsStudyOptions {
  std::vector<std::filesystem::path> recordings;  ///< folders with a recording.yaml each
  std::vector<StudiedModel> models;
  /// Of every fit; `effects` and `threads` are the study's own, and `marker_offset_sigma_m` goes to
  /// the models that ask for offsets.
  FitOptions fit;
  std::optional<MarkerWeights> weights;
  PublishedErrors published;  ///< of some of the recordings; with weights
  int threads = 0;            ///< fits at work side by side; 0: as many as the machine has

  void validate() const;  ///< throws InputError
  /// One line that names all that a row depends on, so that a journal of another study is refused.
  /// Of the recordings it holds the descriptions, and names and sizes of the files beside them.
  std::string key() const;
};

/// What one fit has to say about one kind of observation. Errors are root mean squares of the
/// distance, in `unit`; NaN where there is none. Where nothing was fitted, `recording`, `folder`,
/// `model` and `reason` alone are filled in.
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
  double noise = 0;  ///< of the observations, as a distance

  /// All frames, markers weighed as the study has it, those that drive held points included: of the
  /// model and of the rigid guess. NaN without weights.
  double weighted_rms = 0, weighted_rigid_rms = 0;
  double published_rms = 0;  ///< what others have stated for the recording's weighted error, or NaN

  /// With each marker's mean error on the fitted frames taken off the predictions: held out, of the
  /// model and of the rigid guess; all frames, weighed, of the model.
  double centred_held_out_rms = 0, centred_rigid_rms = 0, centred_weighted_rms = 0;

  std::map<std::string, double> parameters;  ///< by name; EFFECT.NAME of an effect
  double seconds = 0;                        ///< of the fit
};

/// The recordings at and below `folders`: a folder with a recording.yaml, or else those of all
/// folders in it, in the order of their paths. Throws InputError for a folder without any.
std::vector<std::filesystem::path> find_recordings(
    const std::vector<std::filesystem::path>& folders);

/// Fits every recording with every model, by fit/executor.h, and judges the fits. A recording that
/// cannot be read or fitted has its reason in its rows and stops no other. The rows are sorted by
/// recording, model and kind; their numbers but `seconds` are the same bits for any number of
/// threads, and whether or not the journal, where given (its key that of the options), held some of
/// them. Throws InputError for options that make no sense, Cancelled when `progress` or an
/// interrupt asks to stop.
std::vector<StudyRow> study_recordings(const RecordingsStudyOptions& options, Journal* journal,
                                       const ProgressCallback& progress);

}  // namespace clothfit
