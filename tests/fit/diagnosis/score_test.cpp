// Checks the score test of hypotheses on simulated recordings. Not checked here: the derivatives
// that it is made of (hypothesis_derivatives_test.cpp), and the projection (projection_test.cpp).
#include "fit/diagnosis/score.h"

#include <gtest/gtest.h>

#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "tests/fit/diagnosis/true_model.h"
#include "tests/fit/hidden_effect.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

const FitOptions kScoreOptions{.loss = Loss::squared};

DiagnosisSetup score_setup(std::span<const FitInput> inputs) {
  const ClothDescription& cloth = inputs.front().recording.cloth;
  return {.inputs = inputs,
          .options = kScoreOptions,
          .columns = cloth.mesh_columns,
          .rows = cloth.mesh_rows};
}

/// A cloth that is simulated soon.
const SyntheticCloth kFewVertices{.mesh = 5};

TEST(Score, PredictsASmallDragAndItsSigma) {
  const SyntheticCloth cloth{.drag_rate_per_s = 0.05, .noise_m = 1e-4};
  const FitInput input = synthetic_input(cloth);
  const DiagnosisSetup setup = score_setup({&input, 1});
  const FittedModel model = true_model(setup, cloth);
  ASSERT_TRUE(model.usable());
  const ModelProjection projection(model, kScoreOptions.loss);

  const std::vector<Score> scores = score_hypotheses(model, projection, {{drag_hypothesis()}}, {});

  ASSERT_EQ(scores.size(), 1u);
  EXPECT_NEAR(scores[0].amplitude[0], 0.05, 4 * scores[0].sigma[0]);
  EXPECT_LT(scores[0].sigma[0], 0.01);
  // A normal estimate so far from neutral takes this from chi-square.
  const double z = scores[0].amplitude[0] / scores[0].sigma[0];
  EXPECT_NEAR(scores[0].decrease, z * z, 1e-6 * z * z);
}

TEST(Score, IsThatOfNoiseWhereNothingIsHidden) {
  const SyntheticCloth cloth = kFewVertices;
  const FitInput input = synthetic_input(cloth);
  const DiagnosisSetup setup = score_setup({&input, 1});
  const FittedModel model = that_may_err(setup, true_model(setup, cloth));
  ASSERT_TRUE(model.usable());
  std::vector<ShapeCandidates> hypotheses = hypotheses_to_test(input, kScoreOptions, 0.4);
  std::erase_if(hypotheses, [](const ShapeCandidates& shapes) { return shapes.size() > 1; });

  const std::vector<Score> scores =
      score_hypotheses(model, ModelProjection(model, kScoreOptions.loss), hypotheses, {});

  EXPECT_GT(scores.size(), 5u);
  for (const Score& score : scores)
    // Beyond 20 lies the chi-square of one hypothesis in 100 000, with one degree of freedom.
    EXPECT_LT(score.decrease, 20 + 4 * static_cast<double>(score.amplitude.size() - 1))
        << score.hypothesis.title();
}

TEST(Score, AsksNoModeWhoseAmplitudesTheModelHasByAnother) {
  const FitInput input = synthetic_input(kFewVertices);
  const Hypothesis alike{.effect = "support_drift", .mode = "", .amplitudes = {"velocity_x"}};
  Hypothesis single = alike;
  single.mode = "single";
  single.picked["point"] = 1;
  const FittedModel model = true_model(score_setup({&input, 1}), kFewVertices, {alike});
  ASSERT_TRUE(model.usable());

  const std::vector<Score> scores = score_hypotheses(
      model, ModelProjection(model, kScoreOptions.loss), {{single}, {drag_hypothesis()}}, {});

  ASSERT_EQ(scores.size(), 1u);
  EXPECT_EQ(scores[0].hypothesis.effect, "viscous_damping");
}

TEST(Score, TellsWhichHeldPointDrifts) {
  const SyntheticCloth cloth;
  const FitInput input = moved_by(
      {.name = "support_drift", .parameters = {{"velocity", {0.003, 0, 0.002}}, {"point", {2}}}},
      synthetic_input(cloth));
  const FittedModel model = true_model(score_setup({&input, 1}), cloth);
  ASSERT_TRUE(model.usable());
  std::vector<ShapeCandidates> drifts = hypotheses_to_test(input, kScoreOptions, 0.4);
  std::erase_if(drifts, [](const ShapeCandidates& shapes) {
    return shapes.front().effect != "support_drift";
  });

  const std::vector<Score> scores =
      score_hypotheses(model, ModelProjection(model, kScoreOptions.loss), drifts, {});

  ASSERT_EQ(scores.size(), 2u);
  EXPECT_EQ(scores[0].hypothesis.title(), "support_drift");
  EXPECT_EQ(scores[1].hypothesis.title(), "support_drift (single, held point 2)");
  EXPECT_GT(scores[1].decrease, 1.5 * scores[0].decrease);
  // A drift of a millimetre bends the derivatives by a few per cent.
  EXPECT_NEAR(scores[1].amplitude[0], 0.003, 1e-4 + 4 * scores[1].sigma[0]);
  EXPECT_NEAR(scores[1].amplitude[2], 0.002, 1e-4 + 4 * scores[1].sigma[2]);
}

// Two recordings of one motion have the same derivatives, but for where noise has put the sheet. Of
// what is the cloth's they say twice as much as one.
TEST(Score, SharesThePhysicsOfTwoRecordingsAndNotTheirClocks) {
  const std::vector<FitInput> inputs{synthetic_input({.noise_m = 1e-4, .seed = 1}),
                                     synthetic_input({.noise_m = 1e-4, .seed = 2})};
  const SyntheticCloth cloth{.noise_m = 1e-4};
  const Hypothesis clock{.effect = "clock_offset", .mode = "", .amplitudes = {"time"}};
  const auto scores_of = [&](std::span<const FitInput> some) {
    const FittedModel model = true_model(score_setup(some), cloth);
    return score_hypotheses(model, ModelProjection(model, kScoreOptions.loss),
                            {{drag_hypothesis()}, {clock}}, {});
  };

  const std::vector<Score> one = scores_of({inputs.data(), 1}), two = scores_of(inputs);

  ASSERT_EQ(one.size(), 2u);
  ASSERT_EQ(two.size(), 2u);
  ASSERT_EQ(two[0].amplitude.size(), 1);
  EXPECT_NEAR(two[0].sigma[0], one[0].sigma[0] / std::sqrt(2.0), 0.02 * one[0].sigma[0]);
  ASSERT_EQ(two[1].amplitude.size(), 2);
  // Both clocks' common error is known as that of one of them alone is. No parameter of the cloth
  // can do what they do in opposite ways, so that this is known better.
  for (const double sigma_s : two[1].sigma) {
    EXPECT_LT(sigma_s, 1.01 * one[1].sigma[0]);
    EXPECT_GT(sigma_s, 0.99 * one[1].sigma[0] / std::sqrt(2.0));
  }
}

}  // namespace
}  // namespace clothfit
