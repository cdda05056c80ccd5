// Checks the removal of hypotheses that later ones make needless. Whole searches: search_test.cpp.
#include "fit/diagnosis/prune.h"

#include <gtest/gtest.h>

#include "fit/diagnosis/beam.h"
#include "fit/diagnosis/search_context.h"
#include "tests/fit/diagnosis/true_model.h"

namespace clothfit {
namespace {

const SyntheticCloth kPruned{
    .drag_rate_per_s = 1, .mesh = 7, .markers = 4, .frames = 24, .held_out_from = 20};
const Hypothesis kNeedless{.effect = "gravity_scale", .mode = "", .amplitudes = {"factor"}};

/// An entry that accepted two hypotheses, in this order, of a cloth with drag alone.
struct TwoAccepted {
  FitInput input = synthetic_input(kPruned);
  FitOptions fit;
  DiagnosisSetup setup{.inputs = {&input, 1}, .options = fit, .columns = 7, .rows = 7};
  SearchOptions options;
  SearchContext search{setup, options, {}};
  BeamEntry entry{.model = {}, .accepted = {}, .last = {}, .refused = {}};

  TwoAccepted(const Hypothesis& first, const Hypothesis& second) {
    entry.model = true_model(setup, kPruned, {first, second});
    refine_model(entry.model, setup, {}, {});
    for (const Hypothesis& hypothesis : {first, second})
      entry.accepted.push_back({.trial = {.hypothesis = hypothesis}, .alike = {}, .refused = {}});
  }
};

TEST(Prune, DropsWhatALaterHypothesisMakesNeedless) {
  TwoAccepted two(kNeedless, drag_hypothesis());
  prune(two.search, two.entry);

  ASSERT_EQ(two.entry.accepted.size(), 1u);
  EXPECT_EQ(two.entry.accepted.front().trial.hypothesis.effect, "viscous_damping");
  EXPECT_EQ(two.entry.model.hypotheses.size(), 1u);
  ASSERT_EQ(two.entry.refused.size(), 1u);
  const Criterion& needed = two.entry.refused.front().criteria.back();
  EXPECT_EQ(needed.name, "needed");
  EXPECT_LT(needed.measured, needed.threshold);
}

TEST(Prune, KeepsTheLastOneUnlessTheEntryHasChangedItsBasin) {
  TwoAccepted two(drag_hypothesis(), kNeedless);
  prune(two.search, two.entry);
  EXPECT_EQ(two.entry.accepted.size(), 2u);

  two.entry.basin = BasinOrigin::changed;
  prune(two.search, two.entry);
  ASSERT_EQ(two.entry.accepted.size(), 1u);
  EXPECT_EQ(two.entry.accepted.front().trial.hypothesis.effect, "viscous_damping");
}

TEST(Prune, KeepsWhatMadeUpForAnotherOnCredit) {
  TwoAccepted two(drag_hypothesis(), kNeedless);
  two.entry.basin = BasinOrigin::changed;
  two.entry.accepted.front().trial.on_credit = true;
  prune(two.search, two.entry);
  EXPECT_EQ(two.entry.accepted.size(), 2u);
}

}  // namespace
}  // namespace clothfit
