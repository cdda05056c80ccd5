// Checks what a model predicts of observations that are left out: linear models against the closed
// forms of least squares, and simulated recordings. Not checked here: what free forces predict
// (free_forces_test.cpp).
#include "fit/diagnosis/cross_validation.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "fit/problem/parameterised_model.h"
#include "fit/refine/pooled_space.h"
#include "tests/fit/diagnosis/true_model.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

constexpr double kSquares = std::numeric_limits<double>::infinity();
constexpr int kValidatedFrames = 20, kValidationBlocks = 5, kValidatedMarkers = 9,
              kResidualsOfFrame = 3 * kValidatedMarkers;
constexpr int kResiduals = kValidatedFrames * kResidualsOfFrame,
              kResidualsOfBlock = kResiduals / kValidationBlocks;

const FitOptions kSquaredLoss{.loss = Loss::squared};
const FitOptions kHuberLoss{.loss = Loss::huber};

/// The cloth has 3 x 3 markers, seen over 20 frames.
const SyntheticCloth kValidatedCloth{
    .mesh = 5, .markers = 3, .frames = kValidatedFrames, .held_out_from = kValidatedFrames};

DiagnosisSetup validated_setup(std::span<const FitInput> inputs,
                               const FitOptions& options = kSquaredLoss, int mesh = 5) {
  return {.inputs = inputs, .options = options, .columns = mesh, .rows = mesh};
}

Eigen::MatrixXd normal_numbers(Eigen::Index rows, Eigen::Index columns, std::mt19937_64& rng) {
  std::normal_distribution<double> normal;
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return normal(rng); });
}

/// Returns a model with the given residuals, whatever its run does. Its derivatives say that no
/// parameter changes them.
FittedModel model_leaving(const FitInput& input, const Eigen::VectorXd& numbers,
                          const FitOptions& options = kSquaredLoss) {
  FittedModel model =
      model_at(validated_setup({&input, 1}, options), {}, {named(kValidatedCloth.fabric)});
  PooledPart& part = model.parts.front();
  part.linear.residual = model.objective(0).residuals({part.values}).front();
  part.linear.residual_by_coordinate =
      Eigen::MatrixXd::Zero(part.linear.residual.size(), part.values.size());
  part.linear.usable = true;
  part.correction = numbers - part.linear.residual;
  part.directions.resize(numbers.size(), 0);
  part.amplitudes.resize(0);
  model.state = FitState::complete;
  return model;
}

FittedModel with_directions(FittedModel model, const Eigen::MatrixXd& directions) {
  model.parts.front().directions = directions;
  model.parts.front().amplitudes = Eigen::VectorXd::Zero(directions.cols());
  return model;
}

/// Returns the mean square of each block.
std::vector<double> by_block(const Eigen::VectorXd& residual) {
  std::vector<double> squares;
  for (int b = 0; b < kValidationBlocks; ++b)
    squares.push_back(residual.segment(b * kResidualsOfBlock, kResidualsOfBlock).squaredNorm() /
                      kResidualsOfBlock);
  return squares;
}

/// Returns the residuals of each block where least squares with penalties do not see it. They are
/// (I - H_bb)^-1 e_b, for the hat matrix H and the residuals e of least squares over all blocks.
Eigen::VectorXd left_out(const Eigen::VectorXd& numbers, const Eigen::MatrixXd& columns,
                         const Eigen::VectorXd& penalties) {
  Eigen::MatrixXd information = columns.transpose() * columns;
  information.diagonal() += penalties;
  const Eigen::MatrixXd hat = columns * information.ldlt().solve(columns.transpose());
  const Eigen::VectorXd error = numbers - hat * numbers;
  Eigen::VectorXd left(numbers.size());
  for (int b = 0; b < kValidationBlocks; ++b) {
    const Eigen::Index first = b * kResidualsOfBlock;
    const Eigen::MatrixXd own = Eigen::MatrixXd::Identity(kResidualsOfBlock, kResidualsOfBlock) -
                                hat.block(first, first, kResidualsOfBlock, kResidualsOfBlock);
    left.segment(first, kResidualsOfBlock) =
        own.partialPivLu().solve(Eigen::VectorXd(error.segment(first, kResidualsOfBlock)));
  }
  return left;
}

void expect_blocks(const CrossValidation& found, const Eigen::VectorXd& expected, double within) {
  ASSERT_TRUE(found.usable);
  ASSERT_EQ(found.block.size(), static_cast<size_t>(kValidationBlocks));
  const std::vector<double> squares = by_block(expected);
  for (size_t b = 0; b < squares.size(); ++b)
    EXPECT_NEAR(found.block[b], squares[b], within * squares[b]) << "block " << b;
  const double mean = expected.squaredNorm() / static_cast<double>(expected.size());
  EXPECT_NEAR(found.mean, mean, within * mean);
}

TEST(CrossValidation, OfALinearModelIsThatOfLeastSquaresOverTheOtherBlocks) {
  constexpr unsigned kSeed = 31;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  std::mt19937_64 rng(kSeed);
  const FitInput input = synthetic_input(kValidatedCloth);
  const Eigen::VectorXd numbers = normal_numbers(kResiduals, 1, rng);
  const Eigen::MatrixXd directions = 0.1 * normal_numbers(kResiduals, 12, rng);
  FittedModel model = with_directions(model_leaving(input, numbers), directions);
  const Eigen::VectorXd expected = left_out(numbers, directions, Eigen::VectorXd::Ones(12));
  ASSERT_GT(expected.squaredNorm(), 1.01 * numbers.squaredNorm());

  const DiagnosisSetup setup = validated_setup({&input, 1});
  // The tolerance is that of the small number that keeps the equations regular.
  expect_blocks(cross_validate(setup, model, kValidationBlocks, kSquares), expected, 1e-7);
  // One step leads there from any amplitudes.
  model.parts.front().amplitudes = normal_numbers(12, 1, rng);
  expect_blocks(cross_validate(setup, model, kValidationBlocks, kSquares), expected, 1e-7);
}

// The sheet's shift moves all markers alike, so that runs are linear in it. A prior is one more
// observation, which no block leaves out.
TEST(CrossValidation, RunsTheModelWhereTheOtherBlocksAndThePriorsLeadIt) {
  constexpr unsigned kSeed = 32;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  std::mt19937_64 rng(kSeed);
  const FitInput input = synthetic_input(kValidatedCloth);
  const Eigen::VectorXd numbers =
      Eigen::VectorXd::Constant(kResiduals, 3) + 10 * normal_numbers(kResiduals, 1, rng);
  const ParameterPrior prior{.name = "sheet_shift_x", .mean = 5e-4, .sigma = 5e-5};
  FitOptions options = kSquaredLoss;
  for (const bool known : {false, true}) {
    SCOPED_TRACE(known ? "known" : "free");
    if (known) options.priors = {prior};
    FittedModel model = model_leaving(input, numbers, options);
    const ParameterSpace& space = model.problems.front()->space;
    PooledPart& part = model.parts.front();
    const Eigen::MatrixXd derivatives =
        model.objective(0).linearise(part.values).residual_by_coordinate;
    Eigen::MatrixXd shifts(kResiduals, 3);
    for (const char* name : {"sheet_shift_x", "sheet_shift_y", "sheet_shift_z"}) {
      const int p = space.index(name);
      part.linear.residual_by_coordinate.col(p) = derivatives.col(p);
      shifts.col(name[12] - 'x') = derivatives.col(p);
    }

    const CrossValidation found =
        cross_validate(validated_setup({&input, 1}, options), model, kValidationBlocks, kSquares);

    const int x = space.index(prior.name);
    const double unit_m = space.value_by_coordinate(part.values)[x];
    const double pull = known ? std::pow(unit_m / prior.sigma, 2) : 0;
    const Eigen::VectorXd there = numbers + shifts.col(0) * (known ? prior.mean / unit_m : 0);
    const Eigen::VectorXd expected = left_out(there, shifts, Eigen::Vector3d(pull, 0, 0));
    expect_blocks(found, expected, 1e-6);
    EXPECT_LT(found.mean, 0.99 * numbers.squaredNorm() / kResiduals);
  }
}

// Amplitudes are drawn as their prior says. Chi-square of a block then exceeds that of noise by the
// variance of its prediction from the others.
TEST(CrossValidation, IsOnAverageTheNoiseAndTheVarianceOfThePrediction) {
  constexpr unsigned kSeed = 33;
  constexpr int kDraws = 60, kDirections = 40;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  std::mt19937_64 rng(kSeed);
  const FitInput input = synthetic_input(kValidatedCloth);
  const DiagnosisSetup setup = validated_setup({&input, 1});
  const Eigen::MatrixXd directions = normal_numbers(kResiduals, kDirections, rng);
  double expected = 1;
  for (int b = 0; b < kValidationBlocks; ++b) {
    const Eigen::MatrixXd own = directions.middleRows(b * kResidualsOfBlock, kResidualsOfBlock);
    const Eigen::MatrixXd rest = directions.transpose() * directions - own.transpose() * own +
                                 Eigen::MatrixXd::Identity(kDirections, kDirections);
    expected += (rest.ldlt().solve(own.transpose()) * own).trace() / kResiduals;
  }

  Eigen::VectorXd means(kDraws);
  for (double& mean : means) {
    const Eigen::VectorXd numbers =
        normal_numbers(kResiduals, 1, rng) + directions * normal_numbers(kDirections, 1, rng);
    mean = cross_validate(setup, with_directions(model_leaving(input, numbers), directions),
                          kValidationBlocks, kSquares)
               .mean;
  }

  const double error =
      std::sqrt((means.array() - means.mean()).square().sum() / (kDraws - 1) / kDraws);
  EXPECT_NEAR(means.mean(), expected, 4 * error);
  EXPECT_GT(expected, 1 + 8 * error);
}

TEST(CrossValidation, TakesAConstantOutOfWhatIsConstant) {
  const FitInput input = synthetic_input(kValidatedCloth);
  std::mt19937_64 rng(34);
  const Eigen::VectorXd offsets = normal_numbers(kResidualsOfFrame, 1, rng);

  const CrossValidation found = cross_validate(
      validated_setup({&input, 1}), model_leaving(input, offsets.replicate(kValidatedFrames, 1)),
      kValidationBlocks, kSquares);

  const double square = offsets.squaredNorm() / kResidualsOfFrame;
  EXPECT_NEAR(found.mean, square, 1e-9 * square);
  EXPECT_LT(found.constant_offset, 1e-12 * square);
  EXPECT_LT(found.last_residual, 1e-12 * square);
  EXPECT_EQ(found.free_forces, kSquares);  // nobody asked for them
}

// A constant from the sixteen frames outside a block adds a sixteenth of the noise. A residual that
// is held adds all of it.
TEST(CrossValidation, CountsTheNoiseOfConstantsAndOfLastResiduals) {
  constexpr unsigned kSeed = 35;
  constexpr int kDraws = 100;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  std::mt19937_64 rng(kSeed);
  const FitInput input = synthetic_input(kValidatedCloth);
  Eigen::VectorXd constant(kDraws), last(kDraws);
  for (int draw = 0; draw < kDraws; ++draw) {
    const Eigen::VectorXd numbers =
        5 * normal_numbers(kResidualsOfFrame, 1, rng).replicate(kValidatedFrames, 1) +
        normal_numbers(kResiduals, 1, rng);
    const CrossValidation found = cross_validate(
        validated_setup({&input, 1}), model_leaving(input, numbers), kValidationBlocks, kSquares);
    constant[draw] = found.constant_offset;
    last[draw] = found.last_residual;
  }

  const auto expect_mean = [&](const Eigen::VectorXd& of, double expected, double known_to) {
    const double error = std::sqrt((of.array() - of.mean()).square().sum() / (kDraws - 1) / kDraws);
    EXPECT_NEAR(of.mean(), expected, 4 * error);
    EXPECT_LT(error, known_to);
  };
  expect_mean(constant, 1 + 1.0 / 16, 0.2 / 16);
  expect_mean(last, 2, 0.03);
}

// The four frames of a block lie one to four frames from the one whose residual is held: the last
// one before the block, or the first one after the first block. So their errors along a ramp are
// known.
TEST(CrossValidation, HoldsTheResidualOfTheNearestFrameThatWasSeen) {
  const FitInput input = synthetic_input(kValidatedCloth);
  Eigen::VectorXd ramp(kResiduals);
  for (Eigen::Index row = 0; row < kResiduals; ++row)
    ramp[row] = 0.1 * static_cast<double>(row / kResidualsOfFrame);

  const CrossValidation found = cross_validate(
      validated_setup({&input, 1}), model_leaving(input, ramp), kValidationBlocks, kSquares);

  EXPECT_NEAR(found.last_residual, 0.01 * (1 + 4 + 9 + 16) / 4, 1e-9);
}

TEST(CrossValidation, KnowsNoConstantOfAMarkerThatOneBlockAloneSees) {
  FitInput input = synthetic_input(kValidatedCloth);
  constexpr int kMarker = 4, kFirst = 8, kLast = 11;  // frames of the third block
  std::erase_if(input.tracks3d, [](const Position3d& row) {
    return row.marker == kMarker && (row.frame < kFirst || row.frame > kLast);
  });
  FittedModel model = model_at(validated_setup({&input, 1}), {}, {named(kValidatedCloth.fabric)});
  const TrajectoryObjective objective = model.objective(0);
  Eigen::VectorXd numbers = Eigen::VectorXd::Zero(objective.residual_count());
  for (const Objective::Block& block : objective.blocks())
    if (block.marker == kMarker) numbers.segment<3>(block.offset).setConstant(2);

  const CrossValidation found = cross_validate(
      validated_setup({&input, 1}), model_leaving(input, numbers), kValidationBlocks, kSquares);

  const double square = 4 * 3 * 4.0 / static_cast<double>(numbers.size());
  EXPECT_NEAR(found.mean, square, 1e-9);
  EXPECT_NEAR(found.constant_offset, square, 1e-9);
  EXPECT_NEAR(found.last_residual, square, 1e-9);
}

// Drag that the derivatives take for weaker by 0.4 makes steps two and a half times too long.
TEST(CrossValidation, HalvesAStepThatLeavesMoreOfWhatItSees) {
  constexpr double kTooMuch_per_s = 0.6, kUnderstated = 0.4;
  SyntheticCloth cloth = kValidatedCloth;
  cloth.drag_rate_per_s = 1;
  const FitInput input = synthetic_input(cloth);
  SyntheticCloth thicker = cloth;
  thicker.drag_rate_per_s += kTooMuch_per_s;
  const DiagnosisSetup setup = validated_setup({&input, 1});
  FittedModel model = true_model(setup, thicker, {drag_hypothesis()});
  Linearisation& linear = model.parts.front().linear;
  const int drag = model.problems.front()->space.index("viscous_damping.rate");
  const auto fabric = linear.residual_by_coordinate.cols();
  for (int p = 0; p < fabric; ++p)
    linear.residual_by_coordinate.col(p) *= p == drag ? kUnderstated : 0;
  const double stays = linear.residual.squaredNorm() / static_cast<double>(linear.residual.size());

  const CrossValidation found = cross_validate(setup, model, kValidationBlocks, kSquares);

  ASSERT_GT(stays, 10);  // a whole step would leave about twice as much
  EXPECT_LT(found.mean, 0.5 * stays);
}

// One marker of the first frame lies 50 sigmas off, and a constant that all residuals share is
// fitted. The squared loss lets the marker move the constant by 50 sigmas over the number of
// residuals, Huber's loss with its threshold of 3 by about 3 sigmas. In its own block it counts
// 3 (2 x 50 - 3).
TEST(CrossValidation, CountsBeyondTheThresholdLinearly) {
  const FitInput input = synthetic_input(kValidatedCloth);
  constexpr double kOff = 50, kThreshold = 3;
  constexpr int kSeenRows = kResiduals - kResidualsOfBlock;
  Eigen::VectorXd numbers = Eigen::VectorXd::Zero(kResiduals);
  numbers[0] = kOff;
  // The direction is so long that the prior of its amplitude says nothing.
  const Eigen::MatrixXd constant = Eigen::MatrixXd::Constant(kResiduals, 1, 100);
  const FittedModel model = with_directions(model_leaving(input, numbers), constant);

  for (const FitOptions* options : {&kSquaredLoss, &kHuberLoss}) {
    const bool robust = options == &kHuberLoss;
    SCOPED_TRACE(robust ? "Huber" : "squares");
    const CrossValidation found = cross_validate(validated_setup({&input, 1}, *options), model,
                                                 kValidationBlocks, kThreshold);

    ASSERT_EQ(found.block.size(), static_cast<size_t>(kValidationBlocks));
    EXPECT_NEAR(found.block[0], kThreshold * (2 * kOff - kThreshold) / kResidualsOfBlock, 1e-6);
    // All three coordinates of that marker weigh less.
    const double weight = kThreshold / kOff;
    const double moved = robust ? weight * kOff / (kSeenRows - 3 + 3 * weight) : kOff / kSeenRows;
    for (size_t b = 1; b < kValidationBlocks; ++b)
      EXPECT_NEAR(found.block[b], moved * moved, 1e-5 * moved * moved);
  }
}

TEST(CrossValidation, LeavesTheFirstBlockInWhereTheStartIsUnknown) {
  FitInput input = synthetic_input(kValidatedCloth);
  Eigen::VectorXd numbers = Eigen::VectorXd::Zero(kResiduals);
  numbers.head(kResidualsOfBlock).setConstant(10);
  numbers.tail(kResidualsOfBlock).setConstant(1);
  const auto validated = [&] {
    FittedModel model = model_leaving(input, numbers);
    return cross_validate(validated_setup({&input, 1}), model, kValidationBlocks, kSquares);
  };

  const CrossValidation all = validated();
  input.recording.start = StartKind::unknown;
  const CrossValidation later = validated();

  ASSERT_EQ(all.block.size(), 5u);
  EXPECT_NEAR(all.mean, (100 + 1) / 5.0, 1e-6);
  ASSERT_EQ(later.block.size(), 4u);
  EXPECT_NEAR(later.block[2], 0, 1e-6);
  EXPECT_NEAR(later.block[3], 1, 1e-6);
  EXPECT_NEAR(later.mean, 1 / 4.0, 1e-6);
}

// The derivatives ask for so much damping that no run at these time steps is stable.
TEST(CrossValidation, KeepsTheResidualWhereTheStepLeadsToAnUnstableRun) {
  const FitInput input = synthetic_input(kValidatedCloth);
  const Eigen::VectorXd numbers = Eigen::VectorXd::Ones(kResiduals);
  FittedModel model = model_leaving(input, numbers);
  PooledPart& part = model.parts.front();
  const FitProblem& problem = *model.problems.front();
  const int damping = problem.space.index("damping_warp");
  Eigen::VectorXd damped = part.values;
  damped[damping] = problem.space.parameters[static_cast<size_t>(damping)].upper;
  ASSERT_FALSE(is_stable(problem, parameter_set(problem, damped), part.steps));
  part.linear.residual_by_coordinate.col(damping).setConstant(-1e-3);

  const CrossValidation found =
      cross_validate(validated_setup({&input, 1}), model, kValidationBlocks, kSquares);

  expect_blocks(found, numbers, 1e-9);
}

// Shared parameters follow from the other recordings alone, those of the recording left out from
// itself. The noise is so small that the model is linear within its sigmas.
TEST(CrossValidation, OfAWholeRecordingTakesTheSharedParametersOfTheOthers) {
  SyntheticCloth cloth{.mesh = 5, .markers = 5, .frames = 12, .held_out_from = 12};
  cloth.noise_m = 1e-6;
  std::vector<FitInput> inputs;
  for (cloth.seed = 41; cloth.seed < 44; ++cloth.seed) inputs.push_back(synthetic_input(cloth));
  SCOPED_TRACE("seeds 41 to 43");
  const DiagnosisSetup setup = validated_setup(inputs);
  FittedModel model = true_model(setup, cloth);
  // The residuals are drawn, so that the truth's own time step leaves nothing in them.
  std::mt19937_64 rng(44);
  for (PooledPart& part : model.parts)
    part.correction = normal_numbers(part.linear.residual.size(), 1, rng) - part.linear.residual;

  const CrossValidation found = cross_validate(setup, model, kValidationBlocks, kSquares, true);

  ASSERT_TRUE(found.usable);
  ASSERT_EQ(found.block.size(), 3u);
  const std::vector<const FitProblem*> problems = model.problem_pointers();
  const PooledSpace space(problems);
  const auto without = [](const Eigen::MatrixXd& of, const Eigen::MatrixXd& columns) {
    return Eigen::MatrixXd(of - columns * columns.colPivHouseholderQr().solve(of));
  };
  double sum = 0;
  for (size_t out = 0; out < 3; ++out) {
    Eigen::MatrixXd information = Eigen::MatrixXd::Zero(space.shared(), space.shared());
    Eigen::VectorXd pull = Eigen::VectorXd::Zero(space.shared());
    const auto shared_and_left = [&](size_t n) {
      const Eigen::MatrixXd& jacobian = model.parts[n].linear.residual_by_coordinate;
      const Eigen::MatrixXd own = jacobian(Eigen::all, space.own_of(n));
      return std::pair(without(jacobian(Eigen::all, space.shared_of(n)), own),
                       without(corrected_residual(model.parts[n]), own));
    };
    for (size_t n = 0; n < 3; ++n) {
      if (n == out) continue;
      const auto [shared, left] = shared_and_left(n);
      information += shared.transpose() * shared;
      pull -= shared.transpose() * left;
    }
    const Eigen::VectorXd step = information.ldlt().solve(pull);
    const auto [shared, left] = shared_and_left(out);
    const double square = (left + shared * step).squaredNorm();
    sum += square;
    EXPECT_NEAR(found.block[out], square / static_cast<double>(left.size()), 1e-4) << out;
    // The others predict it worse than it would itself.
    EXPECT_GT(square,
              without(left, shared).squaredNorm() + 1e-3 * static_cast<double>(left.size()));
  }
  EXPECT_NEAR(found.mean, sum / static_cast<double>(model.residual_count()), 1e-4);
}

TEST(CrossValidation, OfOneRecordingHasNoWholeOneToLeaveOut) {
  const FitInput input = synthetic_input(kValidatedCloth);
  std::mt19937_64 rng(36);
  const FittedModel model = model_leaving(input, normal_numbers(kResiduals, 1, rng));
  const DiagnosisSetup setup = validated_setup({&input, 1});

  EXPECT_EQ(cross_validate(setup, model, kValidationBlocks, kSquares, true).block,
            cross_validate(setup, model, kValidationBlocks, kSquares).block);
}

// A true model predicts frames left out to the noise. Constants of markers, which nothing asks for,
// and a last residual, which is noise, do worse.
TEST(CrossValidation, OfATrueModelIsTheNoiseAndBeatsCorrectionsWithoutPhysics) {
  const SyntheticCloth cloth{.mesh = 5};
  SCOPED_TRACE("seed " + std::to_string(cloth.seed));
  const FitInput input = synthetic_input(cloth);
  const DiagnosisSetup setup = validated_setup({&input, 1});
  const FittedModel model = true_model(setup, cloth);
  ASSERT_TRUE(model.usable());

  const CrossValidation validated = cross_validate(setup, model, 5, 1e300);

  ASSERT_TRUE(validated.usable);
  EXPECT_EQ(validated.block.size(), 5u);
  EXPECT_NEAR(validated.mean, 1, 0.1);
  EXPECT_GT(validated.constant_offset, validated.mean);
  EXPECT_NEAR(validated.last_residual, 2 * validated.mean, 0.3);
}

// The same holds of a whole recording that took no part in finding the cloth's parameters. Only
// where its sheet lay is its own.
TEST(CrossValidation, OfATrueModelPredictsAnotherRecordingToTheNoise) {
  const SyntheticCloth cloth{.mesh = 5};
  SCOPED_TRACE("seeds 1 and 2");
  const std::vector<FitInput> inputs{synthetic_input({.mesh = 5, .seed = 1}),
                                     synthetic_input({.mesh = 5, .seed = 2})};
  const DiagnosisSetup setup = validated_setup(inputs);
  const FittedModel model = true_model(setup, cloth);
  ASSERT_TRUE(model.usable());

  const CrossValidation validated = cross_validate(setup, model, 5, 1e300, true);

  ASSERT_TRUE(validated.usable);
  ASSERT_EQ(validated.block.size(), 2u);  // one for each recording, whatever is asked for
  for (const double recording : validated.block) EXPECT_NEAR(recording, 1, 0.1);
  EXPECT_NEAR(validated.mean, 1, 0.07);  // 7644 residuals: 4 of its sigmas
}

// The first frames show a start in motion. Without them it would be told, through 54 numbers, from
// what became of it.
TEST(CrossValidation, KeepsTheFramesThatShowAStartInMotion) {
  FitInput input = synthetic_input({.mesh = 7, .markers = 5, .frames = 30, .held_out_from = 30});
  input.recording.start = StartKind::unknown;
  FitOptions options = kSquaredLoss;
  options.start_nodes = 3;
  const DiagnosisSetup setup = validated_setup({&input, 1}, options, 7);
  FittedModel model = model_at(setup, {}, {named(SyntheticCloth().fabric)});
  refine_model(model, setup, {}, {});
  ASSERT_TRUE(model.usable());
  linearise_model(model);

  const CrossValidation validated = cross_validate(setup, model, 5, 1e300);

  ASSERT_TRUE(validated.usable);
  ASSERT_EQ(validated.block.size(), 4u);
  const double seen = model.residual().squaredNorm() / static_cast<double>(model.residual_count());
  for (const double block : validated.block) EXPECT_LT(block, 2 * seen);
}

}  // namespace
}  // namespace clothfit
