// Checks what a hypothesis must gain to be tried and to be named, on numbers. How trials ask for it
// is checked in trial_test.cpp.
#include "fit/diagnosis/worth.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/fit/diagnosis/true_model.h"

namespace clothfit {
namespace {

constexpr double kSquaresOnly = std::numeric_limits<double>::infinity();

/// Returns the chance that the sum of so many squared standard normal numbers exceeds `square`.
/// There may be up to four.
double chance_beyond(int numbers, double square) {
  const double half = 0.5 * square;
  if (numbers % 2 == 0) return std::exp(-half) * (numbers == 2 ? 1 : 1 + half);
  return std::erfc(std::sqrt(half)) +
         (numbers == 1 ? 0 : 2 * std::sqrt(half / M_PI) * std::exp(-half));
}

TEST(LeastDecrease, IsAsUnlikelyAsFiveSigmas) {
  const double five_sigmas = std::erfc(5 / std::sqrt(2.0));
  for (const int amplitudes : {1, 2, 3, 4}) {
    SCOPED_TRACE(amplitudes);
    // A straight line in the number of amplitudes is near the truth.
    EXPECT_LT(chance_beyond(amplitudes, least_decrease(amplitudes)), 1.1 * five_sigmas);
    EXPECT_GT(chance_beyond(amplitudes, 0.95 * least_decrease(amplitudes)), five_sigmas);
  }
}

/// Returns a model that leaves so much chi-square per residual.
FittedModel that_leaves(const DiagnosisSetup& setup, double chi_square_per_residual) {
  FittedModel model = true_model(setup, {});
  Eigen::VectorXd& residual = model.parts.front().linear.residual;
  residual.setConstant(std::sqrt(chi_square_per_residual));
  return model;
}

TEST(WorthNaming, IsOfTheNoiseOrOfWhatIsAboveItOrOfAll) {
  const FitInput input = synthetic_input({});
  const FitOptions options;
  const DiagnosisSetup setup{.inputs = {&input, 1}, .options = options, .columns = 9, .rows = 9};
  const auto count = static_cast<double>(that_leaves(setup, 1).residual_count());
  const double scatter = 2 * std::sqrt(2 * count);

  const auto worth = [&](double left) {
    return worth_naming(that_leaves(setup, left), kSquaresOnly);
  };
  const double prior = that_leaves(setup, 0).chi_square(kSquaresOnly);

  // Noise alone, and less than noise
  EXPECT_NEAR(worth(1), 0.003 * count, 1e-9 * count);
  EXPECT_NEAR(worth(0.5), 0.003 * count, 1e-9 * count);
  // A little above noise: a third of what two standard deviations do not explain
  const double little = 1.15;
  EXPECT_NEAR(worth(little), (0.15 * count - scatter + prior) / 3, 1e-9 * count);
  EXPECT_GT(worth(little), 0.003 * count);
  // More: a quarter of the noise is enough
  EXPECT_NEAR(worth(3), 0.25 * count, 1e-9 * count);
  // Far above: a twentieth of all
  EXPECT_NEAR(worth(50), 0.05 * (50 * count + prior), 1e-9 * count);
}

TEST(WorthNaming, IsMoreBesideAHypothesisThatExplainsMuch) {
  const FitInput input = synthetic_input({});
  const FitOptions options;
  const DiagnosisSetup setup{.inputs = {&input, 1}, .options = options, .columns = 9, .rows = 9};
  const FittedModel model = that_leaves(setup, 1);
  const auto count = static_cast<double>(model.residual_count());

  // A form that is known to five per cent leaves a four-hundredth of what it explains.
  EXPECT_NEAR(worth_naming(model, kSquaresOnly, 4 * count), 0.01 * count, 1e-9 * count);
  EXPECT_NEAR(worth_naming(model, kSquaresOnly, count), 0.003 * count, 1e-9 * count);
}

TEST(WorthNaming, CountsLargeResidualsAsTheFitDoes) {
  const FitInput input = synthetic_input({});
  const FitOptions options;
  const DiagnosisSetup setup{.inputs = {&input, 1}, .options = options, .columns = 9, .rows = 9};
  const FittedModel model = that_leaves(setup, 400);
  const double prior = that_leaves(setup, 0).chi_square(kSquaresOnly);

  // Huber's loss is linear beyond 2; 3D residuals have lengths sqrt(3) 20.
  const double length = std::sqrt(3) * 20, threshold = 2;
  const double blocks = static_cast<double>(model.residual_count()) / 3;
  EXPECT_NEAR(worth_naming(model, threshold),
              0.05 * (blocks * threshold * (2 * length - threshold) + prior), 1e-9 * blocks);
}

TEST(PriceOfAmplitudes, IsThatOfTheBayesianInformationCriterion) {
  const FitInput input = synthetic_input({});
  const FitOptions options;
  const DiagnosisSetup setup{.inputs = {&input, 1}, .options = options, .columns = 9, .rows = 9};
  FittedModel model = that_leaves(setup, 1);
  EXPECT_EQ(price_of_amplitudes(model), 0);

  const double each = std::log(static_cast<double>(model.residual_count()));
  model.hypotheses = {{.effect = "gravity_tilt", .amplitudes = {"about_x", "about_y"}},
                      {.effect = "nonuniform_mass",
                       .mode = "hem",
                       .amplitudes = {"hem"},
                       .shape = {{"hem_width", 0.02}}}};
  // A shape costs as much, whether a grid or a fit has chosen it.
  EXPECT_DOUBLE_EQ(price_of_amplitudes(model), 4 * each);
}

}  // namespace
}  // namespace clothfit
