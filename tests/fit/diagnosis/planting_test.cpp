// Checks searches of twins, on which an effect is planted or none.
#include "fit/diagnosis/planting.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/fit/diagnosis/true_model.h"

namespace clothfit {
namespace {

const FitOptions kPlantingOptions = [] {
  FitOptions options;
  options.loss = Loss::squared;
  return options;
}();

/// A cloth that is searched soon.
const SyntheticCloth kTwinCloth{.mesh = 5, .markers = 4, .frames = 26, .held_out_from = 20};

/// Returns a few hypotheses on the air and on gravity.
SearchOptions few_hypotheses(const FitInput& input) {
  SearchOptions options{.hypotheses = {},
                        .beam_width = 1,
                        .refits = 2,
                        .most_effects = 2,
                        .threshold = std::numeric_limits<double>::infinity()};
  for (const ShapeCandidates& mode : hypotheses_to_test(input, kPlantingOptions, 0.5)) {
    const std::string& effect = mode.front().effect;
    if (effect == "viscous_damping" || effect == "gravity_tilt" || effect == "wind")
      options.hypotheses.push_back(mode);
  }
  return options;
}

TEST(Planting, FindsThePlantedDragOnATwinAndNothingOnATwinWithoutIt) {
  const SyntheticCloth& cloth = kTwinCloth;
  const FitInput input = synthetic_input(cloth);
  const DiagnosisSetup setup{
      .inputs = {&input, 1}, .options = kPlantingOptions, .columns = 5, .rows = 5};
  const FittedModel model = true_model(setup, cloth);
  const Plant drag{.hypothesis = drag_hypothesis(), .parameter = "rate", .beyond_neutral = 0.8};

  const PlantOutcome planted = search_twins(setup, model, drag, few_hypotheses(input), 5, {});
  ASSERT_TRUE(planted.ran) << planted.why_not;
  EXPECT_TRUE(planted.named());

  const PlantOutcome nothing = search_twins(setup, model, {}, few_hypotheses(input), 6, {});
  ASSERT_TRUE(nothing.ran) << nothing.why_not;
  EXPECT_TRUE(nothing.found.empty()) << nothing.found.front().title();
}

// A model that has the drag is the truth of a twin with drag, so nothing is missing there.
TEST(Planting, FindsNothingOnATwinOfWhatTheModelHas) {
  SyntheticCloth cloth = kTwinCloth;
  cloth.drag_rate_per_s = 1;
  const FitInput input = synthetic_input(cloth);
  const DiagnosisSetup setup{
      .inputs = {&input, 1}, .options = kPlantingOptions, .columns = 5, .rows = 5};
  const FittedModel model = true_model(setup, cloth, {drag_hypothesis()});

  SearchOptions options = few_hypotheses(input);
  std::erase_if(options.hypotheses, [](const ShapeCandidates& mode) {
    return mode.front().effect == "viscous_damping";
  });
  const PlantOutcome outcome = search_twins(setup, model, {}, options, 7, {});
  ASSERT_TRUE(outcome.ran) << outcome.why_not;
  EXPECT_TRUE(outcome.found.empty()) << outcome.found.front().title();
}

}  // namespace
}  // namespace clothfit
