// Checks simulate-and-recover as a whole: fits of recordings whose every number is known. `clothfit
// recover` prints its statistics at full size; here they are small, to notice when they break.
#include "apps/study/trials/recover.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>

#include "fit/jobs/draws.h"
#include "tests/apps/scratch_folder.h"
#include "tests/data/whole_runs.h"

namespace clothfit {
namespace {

/// Sets up a small cloth for half a second: a trial takes a fraction of a second.
RecoverOptions small_study() {
  RecoverOptions options;
  options.scene.truth_mesh = 7;
  options.scene.markers = 7;
  options.scene.frames = 31;
  options.fit.mesh_columns = options.fit.mesh_rows = 7;
  options.fit.loss = Loss::squared;
  options.start_factor = 2;
  options.trials = 20;
  options.seed = 11;
  return options;
}

/// Returns all that a trial found, without its duration.
std::vector<double> found(const RecoverTrial& trial) {
  std::vector<double> numbers{static_cast<double>(trial.stop)};
  for (const RecoveredParameter& p : trial.parameters)
    for (const double number : {p.truth, p.estimate, p.sigma, p.noise_sigma, p.robust_sigma,
                                p.bound_sigma, p.undetermined ? 1.0 : 0.0, p.degrees_of_freedom,
                                p.interval_90.lower, p.interval_90.upper})
      numbers.push_back(number);
  return numbers;
}

TEST(Recover, ScattersAsTheBoundAllowsAndKnowsIt) {
  const RecoverResult result = recover(small_study(), nullptr, {});

  SCOPED_TRACE("seed 11");
  ASSERT_EQ(result.stop, ExecuteStop::finished);
  EXPECT_EQ(result.failures, 0);
  EXPECT_EQ(result.wrong, 0);
  EXPECT_EQ(result.good + result.unconverged, 20);
  ASSERT_EQ(result.parameters.size(), 7u);
  double squared_by_bound = 0, squared_by_sigma = 0;
  int covered = 0, count = 0;
  for (const RecoverTrial& trial : result.trials) {
    for (const RecoveredParameter& p : trial.parameters) {
      const double error = p.estimate - p.truth;
      squared_by_bound += std::pow(error / p.bound_sigma, 2);
      squared_by_sigma += std::pow(error / p.noise_sigma, 2);
      covered += std::abs(error) <= 1.96 * p.noise_sigma ? 1 : 0;
      ++count;
    }
  }
  // The 140 pulls, those of a trial correlated, are as many as about 60 independent ones. Their
  // mean square scatters by 0.18 about 1 and their share within 1.96 sigma by 0.03 about 0.95.
  EXPECT_NEAR(squared_by_bound / count, 1, 0.5);
  EXPECT_NEAR(squared_by_sigma / count, 1, 0.5);
  EXPECT_GE(covered, static_cast<int>(0.86 * count));
}

TEST(Recover, IsTheSameForAnyNumberOfThreadsAndAfterAnInterruption) {
  RecoverOptions options = small_study();
  options.trials = 5;
  options.scene.frames = 16;
  options.threads = 1;
  const RecoverResult alone = recover(options, nullptr, {});
  const test::ScratchFolder scratch("recover");
  const std::filesystem::path file = scratch.path() / "recover.journal";
  {
    Journal journal(file, options.key(), JournalStart::fresh);
    int told = 0;
    const RecoverResult cut =
        recover(options, &journal, [&](const Progress&) { return ++told < 3; });
    EXPECT_EQ(cut.stop, ExecuteStop::cancelled);
    EXPECT_LT(journal.finished().size(), 5u);
    EXPECT_GT(journal.finished().size(), 0u);
  }
  options.threads = 2;
  Journal journal(file, options.key(), JournalStart::resume);
  const RecoverResult resumed = recover(options, &journal, {});

  ASSERT_EQ(resumed.trials.size(), 5u);
  for (size_t n = 0; n < 5; ++n) EXPECT_EQ(found(resumed.trials[n]), found(alone.trials[n])) << n;
}

TEST(Recover, BearsGapsAHandAndOutliers) {
  // The clean twin has as many observations as the spoiled one has good ones. These are 0.8 of the
  // time outside the hand's twelfth, and 0.95 of these are no outliers.
  RecoverOptions spoiled = small_study();
  spoiled.scene.truth_mesh = spoiled.fit.mesh_columns = spoiled.fit.mesh_rows = 5;
  spoiled.trials = 12;
  spoiled.fit.loss = Loss::huber;
  spoiled.scene.missing = 0.2;
  spoiled.scene.hand = true;
  spoiled.scene.outliers = 0.05;
  RecoverOptions clean = small_study();
  clean.scene.truth_mesh = clean.fit.mesh_columns = clean.fit.mesh_rows = 5;
  clean.trials = 12;
  clean.scene.missing = 1 - 0.8 * (1 - 1.0 / 12) * 0.95;

  const RecoverResult with = recover(spoiled, nullptr, {});
  const RecoverResult without = recover(clean, nullptr, {});

  ASSERT_EQ(with.parameters.size(), without.parameters.size());
  EXPECT_EQ(with.failures, 0);
  double ratio = 0;  // geometric mean over the parameters
  for (size_t p = 0; p < with.parameters.size(); ++p)
    ratio += std::log(with.parameters[p].rms / without.parameters[p].rms) /
             static_cast<double>(with.parameters.size());
  // Each rms of 12 trials scatters by 20 %, the mean over the parameters by some 12 %.
  EXPECT_LT(std::exp(ratio), 1.5 * 1.25);
}

// Over all frames, and over a third of them, the cost of this release has a basin 24 bounds away
// from the truth. Tension and flexion along a thread have traded places there.
TEST(Recover, LeavesABasinWhereTensionAndFlexionTradePlaces) {
  CLOTHFIT_ONLY_IN_WHOLE_RUNS();
  RecoverOptions options;
  options.scene.markers = 9;
  options.scene.noise_m = 0.0005;
  options.fit.mesh_columns = options.fit.mesh_rows = 17;
  options.fit.loss = Loss::squared;
  constexpr std::uint64_t kSeed = 5;
  constexpr int kIndex = 41;

  const RecoverTrial trial = recover_once(options, kIndex, derived_seed(kSeed, kIndex));

  SCOPED_TRACE("trial 41 of seed 5");
  ASSERT_EQ(trial.parameters.size(), 7u);
  for (const RecoveredParameter& p : trial.parameters)
    EXPECT_LT(std::abs(p.estimate - p.truth), 5 * p.bound_sigma) << p.name;
}

// This fit does not converge where its first state is corrected through 6 x 6 nodes only. Such
// corrections leave up to 0.6 mm of it.
TEST(Recover, FindsAClothThatOneCameraSeesAlreadySwinging) {
  CLOTHFIT_ONLY_IN_WHOLE_RUNS();
  RecoverOptions options;
  options.scene.truth_mesh = 9;
  options.scene.markers = 9;
  options.scene.frames = 46;
  options.scene.before_s = 0.25;
  options.fit.observations = ObservationKind::tracks2d;
  options.fit.mesh_columns = options.fit.mesh_rows = 9;
  options.fit.loss = Loss::squared;
  options.start_factor = 1.5;
  constexpr std::uint64_t kSeed = 41;

  const RecoverTrial trial = recover_once(options, 0, derived_seed(kSeed, 0));

  SCOPED_TRACE("seed 41");
  ASSERT_EQ(trial.parameters.size(), 7u);
  EXPECT_EQ(trial.stop, FitStop::converged) << trial.message;
  for (const RecoveredParameter& p : trial.parameters)
    EXPECT_LT(std::abs(p.estimate - p.truth), 4 * p.bound_sigma) << p.name;
}

TEST(Recover, RefusesAStudyThatMakesNoSense) {
  RecoverOptions none = small_study();
  none.trials = 0;
  EXPECT_ANY_THROW(recover(none, nullptr, {}));
  RecoverOptions noiseless = small_study();
  noiseless.scene.noise_m = 0;
  EXPECT_ANY_THROW(recover(noiseless, nullptr, {}));
  RecoverOptions below = small_study();
  below.start_factor = 0.5;
  EXPECT_ANY_THROW(recover(below, nullptr, {}));
}

}  // namespace
}  // namespace clothfit
