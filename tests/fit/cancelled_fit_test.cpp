// Checks that fits and diagnoses end within a simulation where they are asked to, and leave nothing
// wrong behind. Not checked here: the simulations themselves
// (tests/model/integrate/stop_check_test.cpp), nor what ends between them (fit_test.cpp).

#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>

#include "fit/diagnosis/diagnose.h"
#include "fit/fit.h"
#include "fit/jobs/executor.h"
#include "fit/jobs/stop_token.h"
#include "tests/data/temporary_folder.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

const SyntheticCloth kCancelledCloth{.mesh = 5, .markers = 4, .frames = 30, .held_out_from = 24};

FitOptions small_fit() {
  FitOptions options;
  options.mesh_columns = options.mesh_rows = 5;
  options.population = 16;
  options.generations = 3;
  options.refine_best = 1;
  options.work = 0.01;
  options.substep_scale = 3;  // longer simulations, with more questions in each
  return options;
}

/// Returns how often a whole fit asks.
int questions_of(FitOptions options, const FitInput& input) {
  std::atomic<int> asked = 0;
  options.is_cancelled = [&] {
    ++asked;
    return false;
  };
  EXPECT_TRUE(fit(input, options, {}).usable());
  return asked;
}

TEST(CancelledFit, EndsAtTheQuestionWherever) {
  const FitInput input = synthetic_input(kCancelledCloth);
  for (const LeadingCost cost :
       {LeadingCost::trajectory, LeadingCost::shooting, LeadingCost::small}) {
    FitOptions options = small_fit();
    options.cost = cost;
    const int all = questions_of(options, input);
    ASSERT_GT(all, 20);
    for (const double share : {0.0, 0.1, 0.5, 0.95}) {
      SCOPED_TRACE(to_string(cost) + " " + std::to_string(share));
      const int last = static_cast<int>(share * all);
      std::atomic<int> asked = 0;
      options.is_cancelled = [&] { return ++asked > last; };

      const FitReport report = fit(input, options, {});

      EXPECT_EQ(report.stop, FitStop::cancelled);
      EXPECT_FALSE(report.usable());
      // A few simulations run side by side, each of which asks once.
      EXPECT_LE(asked, last + 20);
    }
  }
}

TEST(CancelledFit, LeavesACheckpointFromWhichItGoesOnToTheSameBits) {
  const FitInput input = synthetic_input(kCancelledCloth);
  const FitOptions whole = small_fit();
  const FitReport expected = fit(input, whole, {});
  ASSERT_TRUE(expected.usable());
  const int all = questions_of(whole, input);
  const TemporaryFolder here;
  for (const double share : {0.1, 0.3}) {
    SCOPED_TRACE(share);
    FitOptions cut = whole;
    cut.checkpoint = here.path() / std::to_string(share);
    std::atomic<int> asked = 0;
    cut.is_cancelled = [&] { return ++asked > share * all; };
    ASSERT_EQ(fit(input, cut, {}).stop, FitStop::cancelled);
    if (!std::filesystem::exists(cut.checkpoint)) continue;  // not a generation was ready

    FitOptions resumed = whole;
    resumed.checkpoint = cut.checkpoint;
    resumed.resume = true;
    const FitReport report = fit(input, resumed, {});

    ASSERT_TRUE(report.usable()) << report.message;
    EXPECT_EQ(report.values, expected.values);
  }
}

TEST(CancelledFit, ForecastsEndToo) {
  const FitInput input = synthetic_input(kCancelledCloth);
  FitOptions options = small_fit();
  const FitReport known = fit(input, options, {});
  ASSERT_TRUE(known.usable());
  options.forecast = known.result;
  options.is_cancelled = [] { return true; };

  EXPECT_EQ(fit(input, options, {}).stop, FitStop::cancelled);
}

DiagnoseOptions small_diagnosis() {
  DiagnoseOptions options;
  options.fit = small_fit();
  options.fit.substep_scale = 1;
  options.beam_width = 1;
  options.refits = 2;
  options.most_effects = 1;
  options.law_terms = 0;
  options.separate = false;
  options.without = {"wind_field"};
  return options;
}

TEST(CancelledDiagnosis, EndsWithWhatItHasWhereverTheSearchIs) {
  SyntheticCloth cloth = kCancelledCloth;
  cloth.drag_rate_per_s = 1.2;
  const FitInput input = synthetic_input(cloth);
  // The search begins once scores are asked for. From then on some question is the last.
  for (const int more : {30}) {
    SCOPED_TRACE(more);
    DiagnoseOptions options = small_diagnosis();
    std::atomic<int> asked = 0;
    options.is_enough = [&] { return ++asked > more; };

    const Diagnosis diagnosis = diagnose(input, options, {});

    ASSERT_TRUE(diagnosis.usable()) << diagnosis.message;
    EXPECT_FALSE(diagnosis.complete);
    EXPECT_TRUE(diagnosis.found().usable());
  }
}

TEST(CancelledDiagnosis, IsCancelledBeforeAndDuringTheSearch) {
  const FitInput input = synthetic_input(kCancelledCloth);
  for (const int last : {0, 20}) {
    SCOPED_TRACE(last);
    DiagnoseOptions options = small_diagnosis();
    std::atomic<int> asked = 0;
    options.fit.is_cancelled = [&] { return ++asked > last; };

    EXPECT_EQ(diagnose(input, options, {}).stop, FitStop::cancelled);
  }
}

TEST(CancelledPiece, IsNotKeptInTheJournal) {
  const TemporaryFolder here;
  const std::filesystem::path file = here.path() / "pieces.journal";
  const auto piece = [](int index, bool stops) -> std::string {
    if (stops && index == 3) throw StopRequested();
    return std::to_string(index);
  };
  {
    Journal journal(file, "pieces", JournalStart::fresh);
    const ExecuteResult cut = execute(
        6, [&](int index, std::uint64_t) { return piece(index, true); }, {.threads = 1}, &journal);
    EXPECT_EQ(cut.stop, ExecuteStop::cancelled);
    EXPECT_EQ(journal.finished().size(), 3u);
  }
  Journal journal(file, "pieces", JournalStart::resume);
  const ExecuteResult resumed = execute(
      6, [&](int index, std::uint64_t) { return piece(index, false); }, {.threads = 1}, &journal);
  ASSERT_EQ(resumed.stop, ExecuteStop::finished);
  EXPECT_EQ(resumed.payloads, (std::vector<std::string>{"0", "1", "2", "3", "4", "5"}));
}

}  // namespace
}  // namespace clothfit
