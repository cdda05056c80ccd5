// Checks detection limits and what is planted to confirm them, on numbers. Planting itself is
// checked in planting_test.cpp.
#include "fit/diagnosis/limits.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fit/diagnosis/criteria.h"
#include "tests/fit/diagnosis/true_model.h"

namespace clothfit {
namespace {

const Hypothesis kTwoTilts{
    .effect = "gravity_tilt", .mode = "", .amplitudes = {"about_x", "about_y"}};

FittedModel limits_model(const FitInput& input) {
  static const FitOptions options;
  return true_model({.inputs = {&input, 1}, .options = options, .columns = 5, .rows = 5},
                    {.mesh = 5, .markers = 3, .frames = 8, .held_out_from = 6});
}

TEST(DetectionLimits, AreFiveSigmasOrWhatIsWorthAName) {
  const FitInput input =
      synthetic_input({.mesh = 5, .markers = 3, .frames = 8, .held_out_from = 6});
  const FittedModel model = limits_model(input);
  const Score score{.hypothesis = kTwoTilts,
                    .amplitude = Eigen::Vector2d(1e-3, 2e-3),
                    .sigma = Eigen::Vector2d(2e-3, 4e-3),
                    .decrease = 7,
                    .columns = {}};

  const DetectionLimit clear = detection_limits(model, {}, {score}, 16).front();
  EXPECT_DOUBLE_EQ(clear.limit[0], 5 * 2e-3);
  EXPECT_DOUBLE_EQ(clear.limit[1], 5 * 4e-3);
  EXPECT_EQ(clear.found, score.amplitude);
  EXPECT_EQ(clear.unit.front(), "rad");
  const DetectionLimit worth = detection_limits(model, {}, {score}, 49).front();
  EXPECT_DOUBLE_EQ(worth.limit[0], 7 * 2e-3);
  // Structure in the residual makes every amplitude less sure.
  const DetectionLimit wide =
      detection_limits(model, {.chi_square_per_dof = 4}, {score}, 49).front();
  EXPECT_DOUBLE_EQ(wide.limit[0], 10 * 2e-3);
}

TEST(DetectionLimits, AreThoseOfTheRecordingThatSeesBest) {
  const FitInput input =
      synthetic_input({.mesh = 5, .markers = 3, .frames = 8, .held_out_from = 6});
  // The two recordings have amplitudes of their own.
  const Score score{.hypothesis = kTwoTilts,
                    .amplitude = Eigen::Vector4d(1, 2, 3, 4),
                    .sigma = Eigen::Vector4d(4, 1, 2, 8),
                    .decrease = 7,
                    .columns = {}};
  const DetectionLimit limit = detection_limits(limits_model(input), {}, {score}, 0).front();
  EXPECT_EQ(limit.limit, Eigen::Vector2d(10, 5));
  EXPECT_EQ(limit.found, Eigen::Vector2d(3, 2));
}

TEST(PlantsOf, AreOneOfEachEffectAboveItsLimitThoseSeenBestFirst) {
  const DetectionLimit tilt{.hypothesis = kTwoTilts,
                            .parameter = {"about_x", "about_y"},
                            .unit = {"rad", "rad"},
                            .limit = Eigen::Vector2d(4e-3, 2e-3),
                            .found = {}};
  const DetectionLimit drag{.hypothesis = drag_hypothesis(),
                            .parameter = {"rate"},
                            .unit = {"1/s"},
                            .limit = Eigen::VectorXd::Constant(1, 1e-6),
                            .found = {}};
  const std::vector<Plant> plants = plants_of({tilt, drag});

  ASSERT_EQ(plants.size(), 2u);
  EXPECT_EQ(plants[0].hypothesis.effect, "viscous_damping");
  EXPECT_DOUBLE_EQ(plants[0].beyond_neutral, kCriteria.planted_above_limit * 1e-6);
  EXPECT_EQ(plants[1].parameter, "about_y");
  EXPECT_DOUBLE_EQ(plants[1].beyond_neutral, kCriteria.planted_above_limit * 2e-3);
}

TEST(PlantsOf, StayWithinTheRangeOfTheirParameter) {
  const auto planted = [](double limit) {
    return plants_of({{.hypothesis = drag_hypothesis(),
                       .parameter = {"rate"},
                       .unit = {"1/s"},
                       .limit = Eigen::VectorXd::Constant(1, limit),
                       .found = {}}});
  };
  EXPECT_EQ(planted(0.1).size(), 1u);
  EXPECT_TRUE(planted(1e9).empty());
  EXPECT_TRUE(planted(std::numeric_limits<double>::infinity()).empty());
}

}  // namespace
}  // namespace clothfit
