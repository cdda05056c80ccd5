// Checks the judgement whether residuals look like noise: on numbers that are drawn, with a known
// structure in them or none, and on the residuals of a simulated recording. Not checked here: the
// projection that residuals go through first (projection_test.cpp), and by what a mesh and a time
// step make a model err (discretisation_test.cpp).
#include "fit/diagnosis/adequacy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "fit/diagnosis/criteria.h"
#include "tests/fit/diagnosis/true_model.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

/// The recording watches 5 x 5 markers in space over 20 frames.
constexpr int kWatchedSide = 5, kWatchedFrames = 20;
constexpr int kNumbersOfFrame = 3 * kWatchedSide * kWatchedSide;

const FitInput& watched_input() {
  static const FitInput input = synthetic_input({.mesh = kWatchedSide,
                                                 .markers = kWatchedSide,
                                                 .frames = kWatchedFrames,
                                                 .held_out_from = kWatchedFrames});
  return input;
}

/// Returns a model of such recordings with the given residuals in place of those of runs. Each
/// parameter moves every residual at random, so that no structure can hide along them.
FittedModel model_that_leaves(const std::vector<Eigen::VectorXd>& residuals, std::mt19937_64& rng,
                              const FitInput& input = watched_input()) {
  const auto problem =
      std::make_shared<const FitProblem>(make_problem(input, {}, kWatchedSide, kWatchedSide));
  std::normal_distribution<double> normal;
  FittedModel model;
  for (const Eigen::VectorXd& residual : residuals) {
    model.problems.push_back(problem);
    PooledPart& part = model.parts.emplace_back();
    part.values = problem->space.start();
    part.frames = static_cast<int>(residual.size()) / kNumbersOfFrame;
    part.steps = 1e-3;
    part.linear.residual = residual;
    part.linear.residual_by_coordinate = Eigen::MatrixXd::NullaryExpr(
        residual.size(), problem->space.size(), [&] { return normal(rng); });
    part.linear.usable = true;
    part.directions.resize(residual.size(), 0);
  }
  model.state = FitState::complete;
  return model;
}

/// Lets the model of one recording err along a direction, by a standard normal amplitude.
FittedModel that_errs_along(const Eigen::VectorXd& direction, FittedModel model) {
  model.parts.front().directions = direction;
  model.parts.front().amplitudes = Eigen::VectorXd::Zero(1);
  return model;
}

/// Returns a value for each coordinate of each marker in each frame, in the residuals' order.
template <class Value>
Eigen::VectorXd left_by(int frames, const Value& value) {
  Eigen::VectorXd residual(frames * kNumbersOfFrame);
  Eigen::Index row = 0;
  for (int frame = 0; frame < frames; ++frame)
    for (int i = 0; i < kWatchedSide; ++i)
      for (int j = 0; j < kWatchedSide; ++j)
        for (int c = 0; c < 3; ++c) residual[row++] = value(frame, i, j, c);
  return residual;
}

Eigen::VectorXd white(std::mt19937_64& rng, int frames = kWatchedFrames) {
  std::normal_distribution<double> normal;
  return left_by(frames, [&](int, int, int, int) { return normal(rng); });
}

/// Lets all markers drift along x by half a cosine, of that mean square over all residuals.
Eigen::VectorXd drift_of(double mean_square, int frames = kWatchedFrames) {
  const Eigen::VectorXd drift = left_by(frames, [&](int frame, int, int, int c) {
    return c == 0 ? std::cos(std::numbers::pi * frame / (frames - 1)) : 0.0;
  });
  return std::sqrt(mean_square * static_cast<double>(drift.size())) * drift.normalized();
}

/// Returns residuals of mean square 1 that change sign from each to the next: nothing smooth.
Eigen::VectorXd alternating() {
  return Eigen::VectorXd::NullaryExpr(kWatchedFrames * kNumbersOfFrame,
                                      [](Eigen::Index row) { return row % 2 == 0 ? 1.0 : -1.0; });
}

/// Holds a number that was drawn several times.
struct Sample {
  Eigen::VectorXd value;
  double mean() const { return value.mean(); }
  double variance() const {
    return (value.array() - mean()).square().sum() / static_cast<double>(value.size() - 1);
  }
  double error_of_mean() const { return std::sqrt(variance() / static_cast<double>(value.size())); }
};

TEST(Adequacy, HoldsForNoiseWhoseScoresAreNormal) {
  constexpr unsigned kSeed = 11;
  constexpr int kDraws = 40;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  std::mt19937_64 rng(kSeed);
  Sample chi_square{Eigen::VectorXd(kDraws)}, time_score = chi_square, neighbour_score = chi_square;
  for (int draw = 0; draw < kDraws; ++draw) {
    const Adequacy adequacy = judge_adequacy(model_that_leaves({white(rng)}, rng), Loss::squared);
    EXPECT_TRUE(adequacy.adequate) << draw;
    EXPECT_LT(adequacy.smooth_score, kCriteria.structure_score) << draw;
    EXPECT_EQ(adequacy.noise_chi_square_per_dof, adequacy.chi_square_per_dof);
    EXPECT_EQ(adequacy.discretisation_square, 0);
    chi_square.value[draw] = adequacy.chi_square_per_dof;
    time_score.value[draw] = adequacy.time_score;
    neighbour_score.value[draw] = adequacy.neighbour_score;
    // Each of 25 markers has 19 next frames. In each of 20 frames lie 40 pairs of neighbours. A
    // pair has three coordinates.
    EXPECT_NEAR(adequacy.time_score, adequacy.time_correlation * std::sqrt(25 * 19 * 3), 1e-9);
    EXPECT_NEAR(adequacy.neighbour_score, adequacy.neighbour_correlation * std::sqrt(40 * 20 * 3),
                1e-9);
  }

  // The tolerances are four standard deviations of means and variances of normal numbers.
  constexpr double kNumbers = kWatchedFrames * kNumbersOfFrame;
  EXPECT_NEAR(chi_square.mean(), 1, 4 * std::sqrt(2 / kNumbers / kDraws));
  for (const Sample& score : {time_score, neighbour_score}) {
    EXPECT_NEAR(score.mean(), 0, 4 / std::sqrt(kDraws));
    EXPECT_NEAR(score.variance(), 1, 4 * std::sqrt(2.0 / kDraws));
  }
}

TEST(Adequacy, FindsTheCorrelationOfAMarkerWithItselfInItsNextFrame) {
  constexpr unsigned kSeed = 12;
  constexpr int kDraws = 8;
  constexpr double kCorrelation = 0.3;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  std::mt19937_64 rng(kSeed);
  Sample in_time{Eigen::VectorXd(kDraws)}, along = in_time;
  for (int draw = 0; draw < kDraws; ++draw) {
    Eigen::VectorXd residual = white(rng);
    for (Eigen::Index row = kNumbersOfFrame; row < residual.size(); ++row)
      residual[row] = kCorrelation * residual[row - kNumbersOfFrame] +
                      std::sqrt(1 - kCorrelation * kCorrelation) * residual[row];
    const Adequacy adequacy = judge_adequacy(model_that_leaves({residual}, rng), Loss::squared);
    in_time.value[draw] = adequacy.time_correlation;
    along.value[draw] = adequacy.neighbour_correlation;
  }

  // The tolerances are four standard deviations of an autoregression's. Its correlation over n
  // pairs has the variance (1 - rho^2) / n, the mean product of two of them (1 + rho^2) / (1 -
  // rho^2) / n.
  constexpr double kSquare = kCorrelation * kCorrelation;
  EXPECT_NEAR(in_time.mean(), kCorrelation, 4 * std::sqrt((1 - kSquare) / (25 * 19 * 3) / kDraws));
  EXPECT_NEAR(along.mean(), 0,
              4 * std::sqrt((1 + kSquare) / (1 - kSquare) / (40 * 20 * 3) / kDraws));
}

TEST(Adequacy, FindsTheCorrelationOfNeighboursInOneFrame) {
  constexpr unsigned kSeed = 13;
  constexpr int kDraws = 12;
  constexpr double kCorrelation = 0.4;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  std::mt19937_64 rng(kSeed);
  Sample in_time{Eigen::VectorXd(kDraws)}, along = in_time;
  for (int draw = 0; draw < kDraws; ++draw) {
    // Each residual follows the one before it, first along rows, then along columns.
    Eigen::VectorXd residual = white(rng);
    const double innovation = std::sqrt(1 - kCorrelation * kCorrelation);
    for (const int stride : {3, 3 * kWatchedSide})
      for (Eigen::Index row = 0; row < residual.size(); ++row)
        if (row / stride % kWatchedSide > 0)
          residual[row] = kCorrelation * residual[row - stride] + innovation * residual[row];
    const Adequacy adequacy = judge_adequacy(model_that_leaves({residual}, rng), Loss::squared);
    in_time.value[draw] = adequacy.time_correlation;
    along.value[draw] = adequacy.neighbour_correlation;
  }

  EXPECT_NEAR(along.mean(), kCorrelation, 4 * along.error_of_mean());
  EXPECT_NEAR(in_time.mean(), 0, 4 * in_time.error_of_mean());
  EXPECT_LT(along.error_of_mean(), 0.05 * kCorrelation);
}

TEST(Adequacy, PairsOnlyFramesThatFollowEachOther) {
  FitInput input = watched_input();
  std::erase_if(input.tracks3d, [](const Position3d& row) { return row.frame % 2 == 1; });
  std::mt19937_64 rng(14);
  FittedModel model = model_that_leaves({white(rng, kWatchedFrames / 2)}, rng, input);
  model.parts.front().frames = kWatchedFrames;

  const Adequacy adequacy = judge_adequacy(model, Loss::squared);

  EXPECT_EQ(adequacy.time_correlation, 0);
  EXPECT_EQ(adequacy.time_score, 0);
  EXPECT_NE(adequacy.neighbour_score, 0);
}

// A smooth function counts from a mean square of structure_share on. Twelve functions, four of time
// for each coordinate, explain some noise along with it.
TEST(Adequacy, IsDeniedToASmoothFunctionOfTheStatedSize) {
  constexpr unsigned kSeed = 15;
  constexpr int kDraws = 12;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  std::mt19937_64 rng(kSeed);
  for (const double times : {0.25, 2.5}) {
    SCOPED_TRACE(times);
    const double size = times * kCriteria.structure_share;
    Sample found{Eigen::VectorXd(kDraws)};
    int adequate = 0;
    for (int draw = 0; draw < kDraws; ++draw) {
      const Adequacy adequacy =
          judge_adequacy(model_that_leaves({white(rng) + drift_of(size)}, rng), Loss::squared);
      found.value[draw] = adequacy.smooth_share * adequacy.chi_square_per_dof;
      adequate += adequacy.adequate ? 1 : 0;
    }
    // Either size lies two and a half standard deviations from the criterion. They are those of the
    // square that twelve functions explain.
    if (times < 1) {
      EXPECT_GE(adequate, kDraws - 1);
    } else {
      EXPECT_LE(adequate, 1);
      constexpr double kNumbers = kWatchedFrames * kNumbersOfFrame;
      const double sigma = std::sqrt(2 * (12 + 2 * size * kNumbers)) / kNumbers;
      EXPECT_NEAR(found.mean(), size, 4 * sigma / std::sqrt(kDraws));
    }
  }
}

TEST(Adequacy, IsDeniedToAFoldThatStandsStill) {
  constexpr unsigned kSeed = 22;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  std::mt19937_64 rng(kSeed);
  constexpr double kSize = 0.15;
  const Eigen::VectorXd fold = left_by(kWatchedFrames, [](int, int i, int j, int c) {
    const double along_s = std::cos(std::numbers::pi * j / (kWatchedSide - 1));
    const double along_t = std::cos(std::numbers::pi * i / (kWatchedSide - 1));
    return c == 2 ? along_s * along_t : 0;
  });
  const auto numbers = static_cast<double>(fold.size());

  const Adequacy adequacy = judge_adequacy(
      model_that_leaves({white(rng) + std::sqrt(kSize * numbers) * fold.normalized()}, rng),
      Loss::squared);

  // Two waves each way and four in time make 48 functions of the three coordinates.
  const double sigma = std::sqrt(2 * (48 + 2 * kSize * numbers)) / numbers;
  EXPECT_NEAR(adequacy.smooth_share * adequacy.chi_square_per_dof, kSize, 4 * sigma);
  EXPECT_FALSE(adequacy.adequate);
}

// Over few frames noise makes as much as this function: 12 functions explain 24 of chi-square,
// where they explain 12 of noise, give or take 5.
TEST(Adequacy, TakesNothingForStructureThatNoiseMakesToo) {
  constexpr unsigned kSeed = 16;
  constexpr int kFew = 6;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  std::mt19937_64 rng(kSeed);
  const double size = 12.0 / (kFew * kNumbersOfFrame);
  ASSERT_GT(size, 1.3 * kCriteria.structure_share);

  const Adequacy adequacy = judge_adequacy(
      model_that_leaves({white(rng, kFew) + drift_of(size, kFew)}, rng), Loss::squared);

  EXPECT_GT(adequacy.smooth_share * adequacy.chi_square_per_dof, kCriteria.structure_share);
  EXPECT_LT(adequacy.smooth_score, kCriteria.structure_score);
  EXPECT_TRUE(adequacy.adequate);
}

// No function that all recordings share explains two that drift opposite ways.
TEST(Adequacy, LooksForStructureInEachRecordingByItself) {
  constexpr unsigned kSeed = 17;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  std::mt19937_64 rng(kSeed);
  constexpr double kSize = 0.1;
  const Eigen::VectorXd drift = drift_of(kSize);

  const Adequacy adequacy = judge_adequacy(
      model_that_leaves({white(rng) + drift, white(rng) - drift}, rng), Loss::squared);

  constexpr double kNumbers = 2 * kWatchedFrames * kNumbersOfFrame;
  const double sigma = std::sqrt(2 * (24 + 2 * kSize * kNumbers)) / kNumbers;
  EXPECT_NEAR(adequacy.smooth_share * adequacy.chi_square_per_dof, kSize, 4 * sigma);
  EXPECT_FALSE(adequacy.adequate);
}

TEST(Adequacy, IsDeniedToNoiseThatIsAFifthLargerThanStated) {
  constexpr unsigned kSeed = 18;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  std::mt19937_64 rng(kSeed);
  const Eigen::VectorXd noise = white(rng);
  const double sigma = std::sqrt(2.0 / kWatchedFrames / kNumbersOfFrame);
  for (const double excess : {0.5, 1.5}) {
    SCOPED_TRACE(excess);
    const double expected = 1 + excess * kCriteria.excess_chi_square;

    const Adequacy adequacy =
        judge_adequacy(model_that_leaves({std::sqrt(expected) * noise}, rng), Loss::squared);

    EXPECT_NEAR(adequacy.chi_square_per_dof, expected, 4 * sigma * expected);
    EXPECT_EQ(adequacy.adequate, excess < 1);
    EXPECT_LT(adequacy.smooth_score, kCriteria.structure_score);
  }
}

// Two of 500 observations took a marker for another one, 30 sigmas away. Huber's loss counts 3 x 30
// of each square of 900.
TEST(Adequacy, HoldsDespiteOutliersThatTheLossForgives) {
  constexpr unsigned kSeed = 19;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  std::mt19937_64 rng(kSeed);
  Eigen::VectorXd residual = white(rng);
  int outliers = 0;
  for (Eigen::Index row = 0; row < residual.size(); row += 3 * 271, ++outliers)
    residual[row] = outliers % 2 == 0 ? 30 : -30;
  const FittedModel model = model_that_leaves({residual}, rng);
  const double numbers = static_cast<double>(residual.size());

  const Adequacy as_squares = judge_adequacy(model, Loss::squared);
  const Adequacy forgiven = judge_adequacy(model, Loss::huber);

  const double sigma = std::sqrt(2 / numbers);
  EXPECT_NEAR(as_squares.chi_square_per_dof, 1 + outliers * 900 / numbers, 0.1 + 4 * sigma);
  EXPECT_FALSE(as_squares.adequate);
  // Three times the robust scale is known to a twentieth.
  EXPECT_NEAR(forgiven.chi_square_per_dof, 1 + outliers * 90 / numbers, 0.05 + 4 * sigma);
  EXPECT_TRUE(forgiven.adequate);
}

// Directions of standard normal amplitudes are a covariance. With amplitudes drawn so, chi-square
// is that of noise, and noise alone explains none of it.
TEST(Adequacy, LeavesOutWhatTheDiscretisationMayErrBy) {
  constexpr unsigned kSeed = 20;
  constexpr int kDraws = 12;
  constexpr double kSquare = 1;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  std::mt19937_64 rng(kSeed);
  std::normal_distribution<double> normal;
  const Eigen::VectorXd direction = drift_of(kSquare);
  Sample chi_square{Eigen::VectorXd(kDraws)};
  for (int draw = 0; draw < kDraws; ++draw) {
    const double amplitude = normal(rng);
    const FittedModel model =
        that_errs_along(direction, model_that_leaves({white(rng) + amplitude * direction}, rng));

    const Adequacy adequacy = judge_adequacy(model, Loss::squared);

    EXPECT_TRUE(adequacy.adequate) << draw;
    EXPECT_NEAR(adequacy.discretisation_square, kSquare, 1e-12);
    const double sigma = std::sqrt(2 / static_cast<double>(model.residual_count()));
    EXPECT_NEAR(adequacy.noise_chi_square_per_dof, 1 + amplitude * amplitude * kSquare,
                4 * sigma * (1 + std::abs(amplitude)));
    chi_square.value[draw] = adequacy.chi_square_per_dof;
  }
  EXPECT_NEAR(chi_square.mean(), 1, 4 * std::sqrt(2.0 / kWatchedFrames / kNumbersOfFrame / kDraws));
}

TEST(Adequacy, TellsTheErrorThatTheDiscretisationWasFoundToMake) {
  constexpr unsigned kSeed = 23;
  constexpr double kAmplitude = 0.4, kSquare = 2;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  std::mt19937_64 rng(kSeed);
  FittedModel model = that_errs_along(drift_of(kSquare), model_that_leaves({white(rng)}, rng));
  EXPECT_EQ(discretisation_found(model), 0);
  model.parts.front().amplitudes[0] = kAmplitude;
  const double found = kAmplitude * kAmplitude * kSquare;
  EXPECT_NEAR(judge_adequacy(model, Loss::squared).discretisation_found, found, 1e-12);
  model.parts.front().correction = model.parts.front().directions.col(0);
  EXPECT_NEAR(discretisation_found(model), std::pow(1 + kAmplitude, 2) * kSquare, 1e-12);
}

// Beside such a direction a smooth function counts from a hundredth of the direction's mean square
// on. An excess counts from a tenth of it on.
TEST(Adequacy, HoldsForLittleBesideWhatTheDiscretisationErrsBy) {
  constexpr unsigned kSeed = 21;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  std::mt19937_64 rng(kSeed);
  constexpr double kSize = 0.1;
  const FittedModel drifts = model_that_leaves({white(rng) + drift_of(kSize)}, rng);
  const FittedModel exceeds = model_that_leaves({std::sqrt(1.6) * white(rng)}, rng);
  EXPECT_FALSE(judge_adequacy(drifts, Loss::squared).adequate);
  EXPECT_FALSE(judge_adequacy(exceeds, Loss::squared).adequate);

  const auto is_adequate_beside = [&](const FittedModel& model, double square) {
    return judge_adequacy(that_errs_along(std::sqrt(square) * alternating(), model), Loss::squared)
        .adequate;
  };
  EXPECT_FALSE(is_adequate_beside(drifts, 0.5 * kSize / kCriteria.smooth_discretisation));
  EXPECT_TRUE(is_adequate_beside(drifts, 2 * kSize / kCriteria.smooth_discretisation));
  EXPECT_FALSE(is_adequate_beside(exceeds, 0.5 * 0.6 / kCriteria.left_discretisation));
  EXPECT_TRUE(is_adequate_beside(exceeds, 2 * 0.6 / kCriteria.left_discretisation));
}

TEST(Adequacy, HoldsForATrueModelAndNotForOneThatLacksDrag) {
  static const FitOptions options{.loss = Loss::squared};
  for (const double drag : {0.0, 1.0}) {
    const SyntheticCloth cloth{.drag_rate_per_s = drag, .mesh = 5};
    SCOPED_TRACE("seed " + std::to_string(cloth.seed));
    const FitInput input = synthetic_input(cloth);
    const DiagnosisSetup setup{.inputs = {&input, 1}, .options = options, .columns = 5, .rows = 5};
    const FittedModel model = that_may_err(setup, true_model(setup, cloth));
    ASSERT_TRUE(model.usable());

    const Adequacy adequacy = judge_adequacy(model, options.loss);

    EXPECT_EQ(adequacy.adequate, drag == 0) << "drag " << drag;
    if (drag == 0) {
      EXPECT_NEAR(adequacy.chi_square_per_dof, 1, 0.08);  // 3822 residuals: 3.5 of its sigmas
      EXPECT_NEAR(adequacy.noise_chi_square_per_dof, 1, 0.08);
      EXPECT_LT(std::abs(adequacy.time_score), 4);
      EXPECT_LT(std::abs(adequacy.neighbour_score), 4);
    } else {
      EXPECT_GT(adequacy.time_score, 10);
      EXPECT_GT(adequacy.neighbour_score, 10);
    }
  }
}

}  // namespace
}  // namespace clothfit
