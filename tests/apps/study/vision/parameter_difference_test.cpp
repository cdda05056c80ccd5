// How parameters of two fits are compared. What fits to pictures give is for `clothfit study
// vision`.

#include "apps/study/vision/parameter_difference.h"

#include <gtest/gtest.h>

#include <cmath>

#include "apps/study/vision/chain_rows.h"
#include "apps/study/vision/chain_study.h"

namespace clothfit {
namespace {

ChainNumber parameter(const char* name, double value, double sigma) {
  return {.name = name, .unit = "N/m", .value = value, .sigma = sigma};
}

TEST(ParameterDifference, IsOverTheSigmaOfTheDifference) {
  std::vector<ChainNumber> numbers = {parameter("shear", 21, 0.3), parameter("tension", 50, 4)};

  compare_parameters(numbers, {parameter("tension", 44, 3), parameter("shear", 22, 0.4)});

  EXPECT_DOUBLE_EQ(numbers[0].over_sigma, 2);    // 1 over 0.5
  EXPECT_DOUBLE_EQ(numbers[1].over_sigma, 1.2);  // 6 over 5
  ASSERT_NE(furthest(numbers), nullptr);
  EXPECT_EQ(furthest(numbers)->name, "shear");
}

TEST(ParameterDifference, IsInfiniteForAParameterThatIsNoLongerDetermined) {
  std::vector<ChainNumber> numbers = {parameter("shear", 22, 0.3)};

  compare_parameters(numbers, {parameter("shear", 22, 0.4), parameter("flexion", 11, 0.1)});

  ASSERT_EQ(numbers.size(), 2U);
  EXPECT_EQ(furthest(numbers)->name, "flexion");
  EXPECT_TRUE(std::isinf(furthest(numbers)->over_sigma));
}

TEST(ParameterDifference, LeavesNumbersWithoutASigmaAlone) {
  std::vector<ChainNumber> numbers = {{.name = "found", .unit = "%", .value = 99}};

  compare_parameters(numbers, {{.name = "found", .unit = "%", .value = 12}});

  EXPECT_TRUE(std::isnan(numbers[0].over_sigma));
  EXPECT_EQ(furthest(numbers), nullptr);
}

TEST(ParameterDifference, TakesFittedParametersOfClothAndEffects) {
  FitResult result;
  result.parameters = {
      {.name = "shear", .unit = "N/m", .value = 22, .sigma = 0.1},
      {.name = "areal_density", .unit = "kg/m2", .value = 0.2, .state = ParameterState::fixed}};
  result.effects = {{.name = "wind", .parameters = {{.name = "c", .value = 1, .sigma = 0.2}}}};
  result.nuisance = {{.name = "world_tilt_a", .unit = "rad", .value = 1, .sigma = 1}};

  const std::vector<ChainNumber> numbers = fitted_parameters(result);

  ASSERT_EQ(numbers.size(), 2U);
  EXPECT_EQ(numbers[0].name, "shear");
  EXPECT_DOUBLE_EQ(numbers[0].sigma, 0.1);
  EXPECT_EQ(numbers[1].name, "wind.c");
}

TEST(ChainTargets, NameTheWorstParameterAndNothingOfTheReference) {
  const ChainResult stills{
      .row = kChainOfTags, .set = "stills", .numbers = {parameter("shear", 22, 0.4)}};
  ChainResult video = stills;
  video.set = "video";
  video.numbers[0].over_sigma = 3.5;

  const std::vector<VisionTarget> targets = chain_targets({stills, video});

  ASSERT_EQ(targets.size(), 1U);
  EXPECT_EQ(targets[0].note, "shear");
  EXPECT_DOUBLE_EQ(targets[0].value, 3.5);
  EXPECT_FALSE(targets[0].met);
}

TEST(ChainTargets, AreMissedByAChainThatBroke) {
  const ChainResult broken{.row = kChainOfDots, .set = "dots", .reason = "gave no tracks"};

  const std::vector<VisionTarget> targets = chain_targets({broken});

  ASSERT_EQ(targets.size(), 1U);
  EXPECT_FALSE(targets[0].met);
  EXPECT_EQ(targets[0].note, "gave no tracks");
}

}  // namespace
}  // namespace clothfit
