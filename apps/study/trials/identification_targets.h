#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/study/trials/planted_drag.h"
#include "apps/study/trials/recover.h"

namespace clothfit {

/// Options to measure the targets of identification. The results are the studies behind the
/// numbers, and the table of targets.
struct TargetsOptions {
  double share =
      1;  ///< share of the trials that a target asks for, in (0, 1]; each study keeps 5 at least
  unsigned long long seed = 1;
  int threads = 0;
  std::vector<std::string> only;  ///< names of studies, `drag` for all of its levels; empty: all
  void validate() const;          ///< throws InputError
};

/// One study of recordings that are simulated and recovered.
struct TargetStudy {
  std::string name, what;
  RecoverOptions options;
  double drag_sigmas = 0;  ///< planted in the truth and not in the fit; 0: none
};
/// Returns tracks3d, one_camera, spoiled, clean, drag_1, drag_5, drag_20, drag_fitted.
std::vector<TargetStudy> target_studies(const TargetsOptions& options);

enum class TargetState { met, missed, not_measured };

struct TargetRow {
  std::string target, measured;
  TargetState state = TargetState::not_measured;
  std::string command;
};

/// Seconds of single fits on one core, the best of some.
struct FitSeconds {
  double scratch_3d = 0, scratch_2d = 0, warm_3d = 0, warm_2d = 0;
};
FitSeconds measure_fits(unsigned long long seed);

/// Planted drag of one size that the fit lacks.
struct PlantedDrag {
  double sigmas = 0;
  PseudoTruth pseudo;
  std::vector<PlantedDragRow> rows;
};

struct TargetsResult {
  bool cancelled = false;
  std::vector<std::pair<TargetStudy, RecoverResult>> studies;
  std::vector<PlantedDrag> planted_drag;
  FitSeconds seconds;
  std::vector<TargetRow> rows;
};

/// Measures the targets. Each study keeps a journal NAME.journal in `journals`, so that a run goes
/// on where it was interrupted.
TargetsResult measure_targets(const TargetsOptions& options, const std::filesystem::path& journals,
                              JournalStart start, const ProgressCallback& progress);

}  // namespace clothfit
