#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/study/foreign/foreign_row.h"
#include "data/progress.h"
#include "fit/jobs/journal.h"

namespace clothfit {

/// Options of the study of recordings that another program simulated. Each is diagnosed, and the
/// diagnosis is compared with the truth beside the recording.
struct ForeignStudyOptions {
  std::vector<std::filesystem::path> recordings;  ///< folders, each with a truth.json
  unsigned long long seed = 1;                    ///< of the searches of every diagnosis
  double budget_s = 0;  ///< of one search, after which it reports what it has; 0: unbounded
  int threads = 0;      ///< of one diagnosis; 0: as many as the machine has

  void validate() const;  ///< throws InputError
  /// Returns one line that names all that a diagnosis depends on, for the journal.
  std::string key() const;
};

/// Returns the folders in `folder` that have a recording.yaml and a truth.json, sorted by name.
/// Where `only` holds names, those alone. Throws InputError for a name that is not there, or where
/// nothing is.
std::vector<std::filesystem::path> find_foreign_recordings(const std::filesystem::path& folder,
                                                           const std::vector<std::string>& only);

/// Diagnoses every recording, one after the other, and judges the diagnoses. A recording that
/// cannot be read, tracked or diagnosed has its reason in its row and stops no other. What a
/// recording lacks, such as tracks, is made below `steps`. The journal, where given, has the
/// options' key. Throws InputError for options that make no sense, Cancelled when `progress` or an
/// interrupt asks to stop.
std::vector<ForeignRow> study_foreign(const ForeignStudyOptions& options,
                                      const std::filesystem::path& steps, Journal* journal,
                                      const ProgressCallback& progress);

}  // namespace clothfit
