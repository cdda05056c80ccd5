// Checks scores over horizons. The score of one hypothesis is checked in score_test.cpp, the coarse
// mesh in search_test.cpp.
#include "fit/diagnosis/shortlist.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "fit/diagnosis/criteria.h"
#include "fit/diagnosis/search_context.h"
#include "tests/fit/diagnosis/true_model.h"

namespace clothfit {
namespace {

const Hypothesis kTiltListed{
    .effect = "gravity_tilt", .mode = "", .amplitudes = {"about_x", "about_y"}};

SyntheticCloth listed_cloth(double drag_rate_per_s) {
  return {.drag_rate_per_s = drag_rate_per_s,
          .mesh = 7,
          .markers = 4,
          .frames = 40,
          .held_out_from = 36};
}

/// Returns the shortlist of a fitted model that does not know of the drag.
Shortlist list_of(double drag_rate_per_s) {
  const SyntheticCloth cloth = listed_cloth(drag_rate_per_s);
  const FitInput input = synthetic_input(cloth);
  const FitOptions fit;
  const DiagnosisSetup setup{.inputs = {&input, 1}, .options = fit, .columns = 7, .rows = 7};
  const SearchOptions options{.hypotheses = {{kTiltListed}, {drag_hypothesis()}}};
  const SearchContext search(setup, options, {});
  FittedModel model = true_model(setup, cloth);
  refine_model(model, setup, {}, {});
  EXPECT_TRUE(model.usable());
  return make_shortlist(search, model);
}

TEST(Shortlist, HasTheHiddenEffectFirst) {
  for (const double rate_per_s : {0.1, 3.0}) {
    SCOPED_TRACE(rate_per_s);
    const Shortlist list = list_of(rate_per_s);
    ASSERT_FALSE(list.best.empty());
    EXPECT_EQ(list.best.front().hypothesis.effect, "viscous_damping");
    EXPECT_GT(list.best.front().amplitude[0], 0);
  }
}

TEST(Shortlist, IsOfFewFramesWhereTheFitOverAllIsBiased) {
  EXPECT_TRUE(list_of(0.1).is_of_whole_run());
  const Shortlist biased = list_of(3);
  EXPECT_LT(biased.share, 1);
  // The model over these is nearer the truth than the one over all frames.
  EXPECT_LT(biased.early.misfit(), kCriteria.grossly_misfitting);
  EXPECT_LT(biased.early.parts.front().frames, 36);
}

TEST(Shortlist, MergesAveragedScoresIntoAll) {
  Shortlist list;
  list.scores = {{.hypothesis = kTiltListed, .share = 0.2},
                 {.hypothesis = drag_hypothesis(), .share = 0.1}};
  list.best = {{.hypothesis = drag_hypothesis(), .share = 0.5}};

  const std::vector<Score> merged = list.merged();
  ASSERT_EQ(merged.size(), 2u);
  EXPECT_EQ(merged[0].hypothesis.effect, "viscous_damping");
  EXPECT_EQ(merged[0].share, 0.5);
  EXPECT_EQ(merged[1].share, 0.2);
}

}  // namespace
}  // namespace clothfit
