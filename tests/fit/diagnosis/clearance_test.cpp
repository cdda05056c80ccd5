// Checks how sure it is that a hypothesis is true. Not checked here: the structure of residuals
// (adequacy_test.cpp).
#include "fit/diagnosis/clearance.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "fit/diagnosis/projection.h"
#include "fit/diagnosis/refit.h"
#include "fit/diagnosis/worth.h"
#include "tests/fit/diagnosis/true_model.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

constexpr double kNoThreshold = std::numeric_limits<double>::infinity();
const FitOptions kClearanceOptions{.loss = Loss::squared};
constexpr Adequacy kWhite{.chi_square_per_dof = 1};

/// Returns the true model of a recording with `hypothesis` as its last one, linearised.
FittedModel model_with(const Hypothesis& hypothesis, const SyntheticCloth& cloth) {
  const FitInput input = synthetic_input(cloth);
  return true_model({.inputs = {&input, 1}, .options = kClearanceOptions, .columns = 9, .rows = 9},
                    cloth, {hypothesis});
}

const FittedModel& of_drag() {
  static const FittedModel model = model_with(drag_hypothesis(), {.drag_rate_per_s = 0.5});
  return model;
}

/// Returns where the last hypothesis' amplitudes stand in the first recording's space.
std::vector<int> places_of(const FittedModel& model) {
  std::vector<int> places;
  for (const std::string& name : model.hypotheses.back().parameters())
    places.push_back(model.problems.front()->space.index(name));
  return places;
}

/// Computes Fisher's information of the amplitudes of a model of one recording, all else free, in
/// their units. It is the square of their derivatives with all else projected out.
Eigen::MatrixXd information_of_amplitudes(const FittedModel& model) {
  const std::vector<int> amplitudes = places_of(model);
  const FitProblem& problem = *model.problems.front();
  EXPECT_TRUE(problem.priors.empty());
  std::vector<int> others;
  for (int p = 0; p < problem.space.size(); ++p)
    if (std::ranges::find(amplitudes, p) == amplitudes.end()) others.push_back(p);
  const auto rest = static_cast<Eigen::Index>(others.size());
  const PooledPart& part = model.parts.front();
  const Eigen::MatrixXd& jacobian = part.linear.residual_by_coordinate;
  const Eigen::Index rows = jacobian.rows();
  const Projection projection(jacobian(Eigen::all, others), Eigen::MatrixXd::Zero(rest, rest),
                              Eigen::VectorXd::Zero(rest), Eigen::MatrixXd(rows, 0),
                              Eigen::VectorXd::Ones(rows), part.linear.residual);
  const Eigen::VectorXd slope = problem.space.value_by_coordinate(part.values);
  const Eigen::MatrixXd left =
      projection.columns(jacobian(Eigen::all, amplitudes) *
                         Eigen::VectorXd(slope(amplitudes)).cwiseInverse().asDiagonal());
  return left.transpose() * left;
}

/// Returns the model as if there were another recording that shows just the same.
FittedModel twice(const FittedModel& model) {
  FittedModel both = model;
  both.problems.push_back(model.problems.front());
  both.parts.push_back(model.parts.front());
  return both;
}

TEST(ClearOfNeutral, OfOneAmplitudeInWhiteNoiseIsItsNumberOfSigmas) {
  const FittedModel& model = of_drag();
  ASSERT_TRUE(model.usable());
  const double sigma = 1 / std::sqrt(information_of_amplitudes(model)(0, 0));

  const double clear = clear_of_neutral(model, kWhite, kNoThreshold);

  EXPECT_NEAR(clear, 0.5 / sigma, 1e-4 * clear);  // to how far the inverse is regularised
  EXPECT_GT(clear, 5);
}

TEST(ClearOfNeutral, IsLessByWhatSumsOfDependentResidualsScatterMore) {
  const FittedModel& model = of_drag();
  ASSERT_TRUE(model.usable());
  const double white = clear_of_neutral(model, kWhite, kNoThreshold);
  const auto share = [&](double chi_square, double in_time, double along) {
    return clear_of_neutral(model,
                            {.chi_square_per_dof = chi_square,
                             .time_correlation = in_time,
                             .neighbour_correlation = along},
                            kNoThreshold) /
           white;
  };

  // The variance grows by (1 + rho) / (1 - rho) in time and each way along the cloth. It grows by
  // the residuals' own, too.
  EXPECT_NEAR(share(1, 0.6, 0), std::sqrt(0.4 / 1.6), 1e-12);
  EXPECT_NEAR(share(1, 0, 0.5), 0.5 / 1.5, 1e-12);
  EXPECT_NEAR(share(4, 0, 0), 0.5, 1e-12);
  EXPECT_NEAR(share(4, 0.6, 0.5), 0.5 * std::sqrt(0.4 / 1.6) * 0.5 / 1.5, 1e-12);
}

TEST(ClearOfNeutral, IsNoMoreThanNoiseAllows) {
  const FittedModel& model = of_drag();
  ASSERT_TRUE(model.usable());
  const double white = clear_of_neutral(model, kWhite, kNoThreshold);

  EXPECT_EQ(
      clear_of_neutral(
          model,
          {.chi_square_per_dof = 0.7, .time_correlation = -0.2, .neighbour_correlation = -0.3},
          kNoThreshold),
      white);
  // Residuals that never change leave little, but a number.
  const double least = clear_of_neutral(
      model, {.chi_square_per_dof = 1, .time_correlation = 1, .neighbour_correlation = 1},
      kNoThreshold);
  EXPECT_GT(least, 0);
  EXPECT_LT(least, 1e-3 * white);
}

TEST(ClearOfNeutral, CountsSeveralAmplitudesAsOneNumberThatIsAsUnlikely) {
  FittedModel model =
      model_with({.effect = "wind", .mode = "pressure", .amplitudes = {"q_x", "q_y", "q_z"}}, {});
  ASSERT_TRUE(model.usable());
  const Eigen::MatrixXd information = information_of_amplitudes(model);
  Eigen::Vector3d pressure_pa(0.01, -0.02, 0.005);
  pressure_pa *= std::sqrt(least_decrease(3) / pressure_pa.dot(information * pressure_pa));
  const std::vector<int> places = places_of(model);
  for (int axis = 0; axis < 3; ++axis)
    model.parts.front().values[places[static_cast<size_t>(axis)]] = pressure_pa[axis];

  EXPECT_NEAR(clear_of_neutral(model, kWhite, kNoThreshold), 5, 1e-3);
}

// Derivatives of cloth that folds and unfolds are steeper than the residuals' change over any
// distance.
TEST(ClearOfNeutral, GoesByTheTrendWhereDerivativesExplode) {
  const FittedModel& model = of_drag();
  ASSERT_TRUE(model.usable());
  FittedModel rough = model;
  rough.parts.front().linear.residual_by_coordinate *= 1000;

  const double smooth = clear_of_neutral(model, kWhite, kNoThreshold);
  EXPECT_NEAR(clear_of_neutral(rough, kWhite, kNoThreshold), smooth, 0.1 * smooth);
  EXPECT_EQ(typical_roughness(model), 1);
  EXPECT_NEAR(typical_roughness(rough), 1000, 100);
  const NamedValues sigma = sigma_of(model, kWhite, kNoThreshold).front();
  const NamedValues by_trend = sigma_of(rough, kWhite, kNoThreshold).front();
  ASSERT_EQ(by_trend.size(), sigma.size());
  for (const FitParameter& parameter : model.problems.front()->space.parameters) {
    if (!is_physical(parameter.role)) continue;
    const double value = sigma.at(parameter.name);
    EXPECT_NEAR(by_trend.at(parameter.name), value, 0.1 * value) << parameter.name;
  }
}

TEST(ClearOfNeutral, GrowsWithTheRecordingsThatShareAnAmplitude) {
  const FittedModel& model = of_drag();
  ASSERT_TRUE(model.usable());

  const double one = clear_of_neutral(model, kWhite, kNoThreshold);
  EXPECT_NEAR(clear_of_neutral(twice(model), kWhite, kNoThreshold), std::sqrt(2.0) * one,
              1e-4 * one);
}

// Two clocks are off alike. Their squares add, and count as those of two amplitudes.
TEST(ClearOfNeutral, CountsTheAmplitudesThatEachRecordingHasOfItsOwn) {
  FittedModel model =
      model_with({.effect = "clock_offset", .mode = "", .amplitudes = {"time"}}, {});
  ASSERT_TRUE(model.usable());
  model.parts.front().values[places_of(model).front()] = 2e-3;

  const double one = clear_of_neutral(model, kWhite, kNoThreshold);
  EXPECT_GT(one, 0);
  EXPECT_NEAR(clear_of_neutral(twice(model), kWhite, kNoThreshold),
              5 * std::sqrt(2 * one * one / least_decrease(2)), 1e-4 * one);
}

TEST(RiseWithoutLast, IsThatOfAFitWithout) {
  const SyntheticCloth cloth{.drag_rate_per_s = 0.02};
  const FitInput input = synthetic_input(cloth);
  const DiagnosisSetup setup{
      .inputs = {&input, 1}, .options = kClearanceOptions, .columns = 9, .rows = 9};
  FittedModel with = true_model(setup, cloth, {drag_hypothesis()});
  with.parts.front().linear = {};  // so that time steps are as those of the other fit
  refine_model(with, setup, {}, {});
  FittedModel without = with_hypotheses(setup, with, {}, {});
  refine_model(without, setup, {}, {});
  ASSERT_TRUE(with.usable() && without.usable());
  const double rise = without.chi_square(kNoThreshold) - with.chi_square(kNoThreshold);
  ASSERT_GT(rise, 25);

  EXPECT_NEAR(rise_without_last(with, kNoThreshold), rise, 0.1 * rise);
}

}  // namespace
}  // namespace clothfit
