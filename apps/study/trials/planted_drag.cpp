#include "apps/study/trials/planted_drag.h"

#include <cmath>

#include "fit/jobs/draws.h"
#include "fit/jobs/thread_limit.h"
#include "fit/problem/problem.h"
#include "fit/refine/pooled_fit.h"

namespace clothfit {
namespace {

/// Pooled releases have indices from here, trials those from 0.
constexpr int kFirstRelease = 1'000'000;

SyntheticRecording release(const RecoverOptions& study, int number) {
  return make_synthetic_recording(study.scene, derived_seed(study.seed, kFirstRelease + number));
}

}  // namespace

PseudoTruth pseudo_truth(const RecoverOptions& study, int releases,
                         const ProgressCallback& progress) {
  const ThreadLimit threads(study.threads);
  RecoverOptions exact = study;
  exact.scene.noisy = false;
  std::vector<FitProblem> problems;
  std::map<std::string, double> truth;
  for (int n = 0; n < releases; ++n) {
    const SyntheticRecording recording = release(exact, n);
    problems.push_back(problem_of(recording, study.fit));
    truth = recording.truth;
  }
  std::vector<const FitProblem*> pointers;
  for (const FitProblem& problem : problems) pointers.push_back(&problem);
  PooledFit pooled = fit_pooled(pointers, truth, {}, progress);
  return {.usable = pooled.usable,
          .converged = pooled.converged,
          .message = pooled.message,
          .values = std::move(pooled.shared),
          .releases = releases};
}

double drag_sigma_per_s(const RecoverOptions& study, int releases) {
  RecoverOptions known = study;
  known.fit.effects = {"viscous_damping"};
  double sum = 0;
  for (int n = 0; n < releases; ++n) {
    const double sigma = bound_sigmas(release(known, n), known.fit).at("viscous_damping.rate");
    sum += sigma * sigma;
  }
  return std::sqrt(sum / releases);
}

std::vector<PlantedDragRow> planted_drag_rows(const RecoverResult& result,
                                              const PseudoTruth& pseudo) {
  std::vector<PlantedDragRow> rows;
  for (const RecoverySummary& p : result.parameters) {
    const auto known = pseudo.values.find(p.name);
    if (known == pseudo.values.end()) continue;
    rows.push_back({.parameter = p.name,
                    .trials = p.trials,
                    .undetermined = p.undetermined,
                    .truth = p.truth,
                    .pseudo_truth = known->second,
                    .holds_pseudo_truth = coverage_90(result.trials, p.name, known->second),
                    .holds_truth = p.holds_truth});
  }
  return rows;
}

}  // namespace clothfit
