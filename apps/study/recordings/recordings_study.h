#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/study/recordings/marker_weights.h"
#include "apps/study/recordings/published_errors.h"
#include "apps/study/recordings/study_row.h"
#include "data/progress.h"
#include "fit/fit.h"
#include "fit/jobs/journal.h"

namespace clothfit {

/// A model with which every recording of a study is fitted. It has springs and weight, the effects
/// that a recording declares, and these effects.
struct StudiedModel {
  std::string name;
  std::vector<std::string> effects;
  bool marker_offsets =
      false;  ///< constants beside the markers' places (fit/observe/marker_offsets.h)
};

struct RecordingsStudyOptions {
  std::vector<std::filesystem::path> recordings;  ///< folders with a recording.yaml each
  std::vector<StudiedModel> models;
  /// Options of every fit. `effects` and `threads` are the study's own, and `marker_offset_sigma_m`
  /// goes to the models that ask for offsets.
  FitOptions fit;
  std::optional<MarkerWeights> weights;
  PublishedErrors published;  ///< for some of the recordings; with weights
  int threads = 0;            ///< fits at work side by side; 0: as many as the machine has

  void validate() const;  ///< throws InputError
  /// Returns one line that names all that a row depends on, so that a journal of another study is
  /// refused. It holds the recordings' descriptions, and names and sizes of the files beside them.
  std::string key() const;
};

/// Returns the recordings at and below `folders`, in the order of their paths. A folder with a
/// recording.yaml is one; else those of all folders in it count. Throws InputError for a folder
/// without any.
std::vector<std::filesystem::path> find_recordings(
    const std::vector<std::filesystem::path>& folders);

/// Fits every recording with every model, by fit/jobs/executor.h, and judges the fits. A recording
/// that cannot be read or fitted has its reason in its rows and stops no other. The rows are sorted
/// by recording, model and kind. Their numbers but `seconds` are the same bits for any number of
/// threads, and whether or not a journal held some of them. The journal, where given, has the
/// options' key. Throws InputError for options that make no sense, Cancelled when `progress` or an
/// interrupt asks to stop.
std::vector<StudyRow> study_recordings(const RecordingsStudyOptions& options, Journal* journal,
                                       const ProgressCallback& progress);

}  // namespace clothfit
