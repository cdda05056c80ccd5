// Checks the criteria that a hypothesis is asked, one after the other. Corrections without physics
// and free forces in whole searches: diagnose_test.cpp, free_forces_test.cpp.
#include "fit/diagnosis/trial.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "fit/diagnosis/criteria.h"
#include "fit/diagnosis/refit.h"
#include "fit/diagnosis/search_context.h"
#include "tests/fit/diagnosis/true_model.h"

namespace clothfit {
namespace {

const SyntheticCloth kDragged{
    .drag_rate_per_s = 1, .mesh = 7, .markers = 4, .frames = 44, .held_out_from = 36};

/// A search in a synthetic recording with drag, which the model does not have.
struct Scene {
  FitInput input = synthetic_input(kDragged);
  FitOptions fit;
  DiagnosisSetup setup{.inputs = {&input, 1}, .options = fit, .columns = 7, .rows = 7};
  SearchOptions options;
  SearchContext search{setup, options, {}};
  FittedModel without = true_model(setup, kDragged);

  Scene() {
    // The truth's parameters are a start, without its drag.
    refine_model(without, setup, {}, {});
    search.base_chi_square = without.chi_square(search.threshold);
  }

  Trial of(const Hypothesis& hypothesis, double predicted) {
    FittedModel with = with_hypotheses(setup, without, {hypothesis}, {});
    refine_model(with, setup, {}, {});
    return of(with, hypothesis, predicted);
  }
  Trial of(const FittedModel& with, const Hypothesis& hypothesis, double predicted) {
    const Score score{
        .hypothesis = hypothesis,
        .amplitude = Eigen::VectorXd::Ones(static_cast<Eigen::Index>(hypothesis.amplitudes.size())),
        .sigma = {},
        .decrease = predicted,
        .columns = {}};
    const CrossValidation left_out = left_out_of(search, without, &search.coarse);
    return try_hypothesis(
        search, {.without = without, .without_left_out = left_out, .score = score, .with = with});
  }
};

std::vector<std::string> asked(const Trial& trial) {
  std::vector<std::string> names;
  for (const Criterion& criterion : trial.criteria) names.push_back(criterion.name);
  return names;
}

TEST(TryHypothesis, PassesTheHiddenEffectByEveryCriterion) {
  Scene scene;
  const Trial trial = scene.of(drag_hypothesis(), 30);

  EXPECT_TRUE(trial.passed()) << trial.refusal();
  EXPECT_EQ(trial.refusal(), "");
  EXPECT_EQ(asked(trial), (std::vector<std::string>{"fitted", "decrease", "worth_naming",
                                                    "left_out", "clear_of_neutral", "matters",
                                                    "free_forces", "corrections"}));
  EXPECT_GT(trial.decrease, 100);
  EXPECT_LT(trial.cross_validated, trial.without_it);
  EXPECT_GT(trial.clear_of_neutral, kCriteria.clear_of_neutral);
}

TEST(ChangeOfPrediction, IsProportionalToASmallAmplitude) {
  const Scene scene;
  FittedModel model = with_hypotheses(scene.setup, scene.without, {drag_hypothesis()}, {});
  const int rate = model.problems.front()->space.index("viscous_damping.rate");
  const auto change_at = [&](double per_s) {
    model.parts.front().values[rate] = per_s;
    linearise_model(model);
    return change_of_prediction(model, drag_hypothesis());
  };
  EXPECT_EQ(change_at(0), 0);
  const double once = change_at(0.001);
  EXPECT_GT(once, 0);
  EXPECT_NEAR(change_at(0.002) / once, 2, 0.01);
}

TEST(Trial, IsATraceWhereOnlyItsChangeOfThePredictionIsTooSmall) {
  Trial trial;
  trial.criteria = {{.name = "decrease", .passed = true}, {.name = "matters", .passed = false}};
  EXPECT_TRUE(trial.is_trace());
  trial.criteria.front().passed = false;
  EXPECT_FALSE(trial.is_trace());
  EXPECT_FALSE(Trial().is_trace());
}

TEST(TryHypothesis, AsksNoFurtherThanTheFirstCriterionThatIsNotPassed) {
  Scene scene;
  const Trial broken_promise = scene.of(drag_hypothesis(), 1e9);
  EXPECT_EQ(asked(broken_promise), (std::vector<std::string>{"fitted", "decrease"}));
  EXPECT_FALSE(broken_promise.passed());
  EXPECT_TRUE(std::isnan(broken_promise.cross_validated));
  EXPECT_EQ(broken_promise.criteria.back().threshold, kCriteria.predicted_share * 1e9);

  const Trial failed = scene.of(FittedModel{}, drag_hypothesis(), 30);
  EXPECT_EQ(asked(failed), std::vector<std::string>{"fitted"});
  EXPECT_TRUE(std::isnan(failed.decrease));
}

TEST(TryHypothesis, RefusesWhatTakesTooLittleToBeWorthAName) {
  Scene scene;
  // A model that explains a million times what is there leaves little that is worth a name.
  scene.search.base_chi_square = 1e12;
  const Trial trial = scene.of(drag_hypothesis(), 30);
  EXPECT_EQ(trial.criteria.back().name, "worth_naming");
  EXPECT_FALSE(trial.passed());
}

}  // namespace
}  // namespace clothfit
