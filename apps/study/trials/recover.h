#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/study/scene/rendered_recording.h"
#include "apps/study/scene/synthetic_recording.h"
#include "data/progress.h"
#include "fit/jobs/executor.h"
#include "fit/problem/problem.h"

namespace clothfit {

/// Options of simulate and recover: recordings whose every number is known are fitted many times.
/// The fits' statements of themselves are compared with the truth. With pictures it is render and
/// recover: the tracker finds the markers in what cameras see of the scene.
struct RecoverOptions {
  SyntheticScene scene;
  /// Options of pictures; these are rendered instead of projected, and the fit is of 2D tracks.
  std::optional<PictureOptions> pictures;
  FitOptions fit;  ///< its seed is each trial's own
  int trials = 20;
  /// Fits begin at the truth times or divided by this, drawn for each parameter. 0: they begin from
  /// scratch.
  double start_factor = 0;
  unsigned long long seed = 1;
  int threads = 0;
  void validate() const;  ///< throws InputError

  /// Returns one line that names all that determines the trials, for their journal.
  std::string key() const;
};

/// One parameter in one trial.
struct RecoveredParameter {
  std::string name;
  double truth = 0, estimate = 0;
  double sigma = 0;                          ///< as in fit.json
  double noise_sigma = 0, robust_sigma = 0;  ///< FitReport::SigmaParts
  double degrees_of_freedom = 0;             ///< those behind robust_sigma; infinite without blocks
  Interval interval_90;                      ///< as in fit.json
  /// The Cramer-Rao bound, from the information of the recording at the truth, with all that is
  /// fitted along. NaN where the model is not the truth's.
  double bound_sigma = 0;
  bool undetermined = false;
};

/// Makes a problem of a synthetic recording as these options fit it, on their mesh.
FitProblem problem_of(const SyntheticRecording& recording, const FitOptions& options);

/// Returns standard deviations of the fit's parameters by Cramer and Rao's bound, by name. They
/// follow from the information of the recording at the truth; none where that cannot be simulated.
std::map<std::string, double> bound_sigmas(const SyntheticRecording& recording,
                                           const FitOptions& options);

struct RecoverTrial {
  FitStop stop = FitStop::not_run;
  std::string message;
  std::vector<RecoveredParameter> parameters;  ///< empty where there was no fit
  int rejected = 0;                            ///< observations that the fit left out
  std::optional<TrackerErrors> tracker;        ///< for rendered recordings
  double seconds = 0;                          ///< the only number that differs from run to run
};

/// Runs trial `index` of the study. Pure but for `seconds`.
RecoverTrial recover_once(const RecoverOptions& options, int index, std::uint64_t seed);

/// Shares of trials whose 90 % intervals of a parameter hold some value; NaN without trials.
struct Coverage90 {
  double plain = 0;   ///< estimate +- 1.645 noise sigma
  double robust = 0;  ///< estimate +- Student's factor times robust sigma
  double stated = 0;  ///< as in fit.json
};
/// Computes the shares; trials where the parameter is undetermined are left out.
Coverage90 coverage_90(const std::vector<RecoverTrial>& trials, const std::string& parameter,
                       double value);

/// One parameter over all trials.
struct RecoverySummary {
  std::string name;
  double truth = 0;
  int trials = 0;                ///< trials that ended with an estimate of it
  int undetermined = 0;          ///< among these, left out of all below
  double bias = 0;               ///< mean relative error
  double spread = 0;             ///< standard deviation of relative errors
  double rms = 0;                ///< root mean square of relative errors
  double percentile_95 = 0;      ///< 95 % quantile of absolute relative errors
  double spread_over_bound = 0;  ///< standard deviation of error / bound
  double bias_over_bound = 0;    ///< mean of error / bound
  double coverage_95 = 0;        ///< share for estimate +- 1.96 noise sigma
  Coverage90 holds_truth;
};

struct RecoverResult {
  ExecuteStop stop = ExecuteStop::not_run;
  std::string message;
  std::vector<RecoverTrial> trials;
  std::vector<RecoverySummary> parameters;
  int good = 0;         ///< fits that converged, all parameters within 10 bounds of the truth
  int failures = 0;     ///< trials without a fit
  int unconverged = 0;  ///< fits that say so of themselves
  int wrong = 0;        ///< fits that converged beyond 10 bounds from the truth in any parameter
  double median_seconds = 0, longest_seconds = 0;
  std::optional<TrackerErrors> tracker;  ///< over all trials together, where they were rendered
};

RecoverResult recover(const RecoverOptions& options, Journal* journal,
                      const ProgressCallback& progress);

/// Fills in the summary of the trials that are known.
void summarise_trials(RecoverResult& result);

}  // namespace clothfit
