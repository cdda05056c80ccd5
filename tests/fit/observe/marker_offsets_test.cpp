// Checks constant offsets of markers, removed from the cost and estimated. Not checked here:
// residuals without them (objective_test.cpp), files that hold them
// (tests/data/fit_result_test.cpp).
#include "fit/observe/marker_offsets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <map>
#include <random>

#include "data/input_error.h"
#include "fit/cost/objective.h"
#include "fit/fit.h"
#include "fit/refine/refine.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double kTimeStep_s = 1.0 / 60 / 150;

/// Random residuals of markers that are seen in different numbers of frames, with different sigma.
struct Scatter {
  std::vector<MarkerResiduals> markers;
  Eigen::VectorXd residual;

  explicit Scatter(unsigned seed) {
    std::mt19937_64 rng(seed);
    std::uniform_real_distribution<double> sigma_m(1e-3, 9e-3);
    std::normal_distribution<double> normal(1, 2);
    int rows = 0;
    for (const int seen : {7, 1, 4}) {
      MarkerResiduals marker;
      marker.marker = static_cast<int>(markers.size());
      for (int k = 0; k < seen; ++k, rows += 3)
        marker.rows.push_back({.first = rows, .sigma_m = sigma_m(rng)});
      markers.push_back(marker);
    }
    residual.resize(rows);
    for (Eigen::Index n = 0; n < residual.size(); ++n) residual[n] = normal(rng);
  }

  /// Returns the least cost over offsets, by a linear solver that is told nothing of the closed
  /// form.
  double least_cost(double tau_m) const {
    const Eigen::Index rows = residual.size();
    const auto unknowns = static_cast<Eigen::Index>(3 * markers.size());
    Eigen::MatrixXd by_offset = Eigen::MatrixXd::Zero(rows + unknowns, unknowns);
    for (size_t m = 0; m < markers.size(); ++m)
      for (const MarkerResiduals::Row& row : markers[m].rows)
        for (int c = 0; c < 3; ++c)
          by_offset(row.first + c, static_cast<Eigen::Index>(3 * m) + c) = 1 / row.sigma_m;
    by_offset.bottomRows(unknowns).diagonal().setConstant(1 / tau_m);
    Eigen::VectorXd all = Eigen::VectorXd::Zero(rows + unknowns);
    all.head(rows) = residual;
    const Eigen::VectorXd offset = -by_offset.colPivHouseholderQr().solve(all);
    return (all + by_offset * offset).squaredNorm();
  }
};

TEST(MarkerOffsets, LeaveTheLeastCostOverAllOffsets) {
  for (const unsigned seed : {1u, 2u, 3u})
    for (const double tau_m : {1e-6, 1e-3, 5e-3, 1.0}) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << ", tau " << tau_m);
      const Scatter scatter(seed);
      Eigen::MatrixXd left = scatter.residual;

      profile_out_offsets(scatter.markers, tau_m, left);

      // The tolerance is rounding of a few dozen numbers.
      EXPECT_NEAR(left.squaredNorm(), scatter.least_cost(tau_m), 1e-10 * left.squaredNorm());
    }
}

TEST(MarkerOffsets, ThatMayNotBeAreNot) {
  const Scatter scatter(4);
  Eigen::MatrixXd left = scatter.residual;

  profile_out_offsets(scatter.markers, 1e-12, left);

  EXPECT_LT((left - scatter.residual).norm(), 1e-15 * scatter.residual.norm());
}

/// Makes a synthetic input each of whose markers is seen beside its place by a vector of its own.
/// The vector is about 8 mm in the frames before `until`, and twice that later. A third of the rows
/// is missing, and rows differ in sigma.
FitInput offset_input(Eigen::Matrix3Xd& offset_m, int until) {
  FitInput input = synthetic_input({.frames = 30, .held_out_from = 20, .noise_m = 3e-4, .seed = 5});
  std::mt19937_64 rng(6);
  std::normal_distribution<double> normal(0, 5e-3);
  offset_m.resize(3, static_cast<Eigen::Index>(input.recording.markers.markers.size()));
  for (double& number : offset_m.reshaped()) number = normal(rng);
  std::erase_if(input.tracks3d,
                [&](const Position3d& row) { return row.frame > 3 && rng() % 3 == 0; });
  for (Position3d& row : input.tracks3d) {
    row.position_m += (row.frame < until ? 1 : 2) * offset_m.col(row.marker);
    if (rng() % 2 == 0) row.sigma_m = 6e-4;
  }
  return input;
}

FitOptions with_offsets(double tau_m) {
  FitOptions options;
  options.observations = ObservationKind::tracks3d;
  options.marker_offset_sigma_m = tau_m;
  return options;
}

TEST(MarkerOffsets, DerivativesOfWhatTheyLeaveAgreeWithDifferences) {
  Eigen::Matrix3Xd offset_m;
  const FitProblem problem = make_problem(offset_input(offset_m, 20), with_offsets(0.01), 5, 5);
  const TrajectoryObjective objective(problem, 12, kTimeStep_s);
  const Eigen::VectorXd values = problem.space.start();

  const Linearisation exact = objective.linearise(values);
  const Linearisation central = objective.linearise(values, Derivatives::central);

  ASSERT_TRUE(exact.usable && central.usable);
  EXPECT_EQ(exact.residual, objective.residuals({values}).front());
  for (int p = 0; p < problem.space.size(); ++p) {
    SCOPED_TRACE(problem.space.parameters[static_cast<size_t>(p)].name);
    const Eigen::VectorXd difference =
        exact.residual_by_coordinate.col(p) - central.residual_by_coordinate.col(p);
    // Differences over 1e-4 are good to about 1e-5 (objective_test.cpp).
    EXPECT_LT(difference.norm(), 2e-5 * central.residual_by_coordinate.col(p).norm());
  }
}

TEST(MarkerOffsets, AreEstimatedFromTheFittedFramesAlone) {
  Eigen::Matrix3Xd offset_m;
  const FitInput input = offset_input(offset_m, 20);
  const FitProblem problem = make_problem(input, with_offsets(1), 9, 9);
  std::vector<Eigen::Matrix3Xd> nowhere(static_cast<size_t>(problem.frames()),
                                        Eigen::Matrix3Xd::Zero(3, offset_m.cols()));
  ObservationSet still = problem.observations.front();
  for (Observation& row : still.rows)
    row.observed = (row.frame < 20 ? 1 : 2) * offset_m.col(row.marker);

  const Eigen::Matrix3Xd wide = estimate_offsets(still, nowhere, 20, 1);
  const Eigen::Matrix3Xd narrow = estimate_offsets(still, nowhere, 20, 1e-6);

  // A prior of 1 m shrinks an offset that is known to 0.2 mm by 4e-8.
  EXPECT_LT((wide - offset_m).norm(), 1e-7 * offset_m.norm());
  EXPECT_LT(narrow.norm(), 1e-2 * offset_m.norm());
}

std::map<std::string, double> true_values() {
  return named(SyntheticCloth{}.fabric);
}

/// Returns how far the worst of the five stiffnesses ends from the truth, as a logarithm. The start
/// is off by a fifth.
double worst_stiffness_error(const FitProblem& problem) {
  Eigen::VectorXd start = problem.space.start();
  for (const auto& [name, value] : true_values()) start[problem.space.index(name)] = 1.2 * value;
  const RefineResult result =
      refine(problem, problem.first_held_out, start, {.loss = Loss::squared}, {});
  EXPECT_TRUE(result.converged) << result.message;
  double worst = 0;
  for (const auto& [name, value] : true_values())
    if (!name.starts_with("damping"))
      worst = std::max(worst, std::abs(std::log(result.values[problem.space.index(name)] / value)));
  return worst;
}

TEST(MarkerOffsets, LeaveStiffnessUnbiasedThatIsBiasedWithoutThem) {
  Eigen::Matrix3Xd offset_m;
  const FitInput input = offset_input(offset_m, 30);

  // Over six seeds of noise and offsets the worst stiffness ended 4 to 10 % off with offsets, which
  // is its noise. Without offsets it ended 51 to 570 % (as a logarithm) off.
  EXPECT_LT(worst_stiffness_error(make_problem(input, with_offsets(0.01), 9, 9)), 0.2);
  EXPECT_GT(worst_stiffness_error(make_problem(input, with_offsets(0), 9, 9)), 0.4);
}

TEST(MarkerOffsets, AreFoundAgainAndForeseeHeldOutFramesAndForecasts) {
  Eigen::Matrix3Xd offset_m;
  const FitInput input = offset_input(offset_m, 30);
  FitOptions options = with_offsets(0.02);
  options.start = true_values();
  options.mesh_columns = options.mesh_rows = 9;
  options.work = 0.02;

  const FitReport report = fit(input, options, {});

  ASSERT_TRUE(report.usable()) << report.message;
  // The held-out frames have a noise of 0.3 mm. They are met to about that although the offsets are
  // seventeen times as large per coordinate.
  EXPECT_LT(report.result.errors.front().held_out.rms, 6e-4);
  // All markers together can move with the sheet, which is placed on them.
  Eigen::Matrix3Xd found(3, offset_m.cols());
  ASSERT_EQ(report.result.marker_offsets.size(), static_cast<size_t>(offset_m.cols()));
  for (const MarkerOffset& offset : report.result.marker_offsets)
    found.col(input.recording.markers.index.at(offset.marker)) = offset.offset_m;
  const Eigen::Matrix3Xd difference = found - offset_m;
  const Eigen::Matrix3Xd own = difference.colwise() - Eigen::Vector3d(difference.rowwise().mean());
  EXPECT_LT(own.norm(), 0.25 * offset_m.norm());

  FitOptions forecast;
  forecast.observations = ObservationKind::tracks3d;
  forecast.mesh_columns = forecast.mesh_rows = 9;
  forecast.forecast = report.result;
  const FitReport with = fit(input, forecast, {});
  forecast.forecast->marker_offsets.clear();
  const FitReport without = fit(input, forecast, {});
  ASSERT_TRUE(with.usable() && without.usable());
  EXPECT_LT(with.result.errors.front().held_out.rms,
            0.7 * without.result.errors.front().held_out.rms);
}

TEST(MarkerOffsets, AreRefusedOfPixelsOfAForecastAndBelowZero) {
  FitOptions options = with_offsets(0.01);
  options.observations = ObservationKind::tracks2d;
  EXPECT_THAT([&] { make_problem(synthetic_input({}), options, 5, 5); },
              ThrowsMessage<InputError>(
                  HasSubstr("FitOptions::marker_offset_sigma_m: the fit looks at pixels")));
  options.marker_offset_sigma_m = -0.01;
  EXPECT_THAT([&] { options.validate(); },
              ThrowsMessage<InputError>(HasSubstr("FitOptions::marker_offset_sigma_m")));
  options.marker_offset_sigma_m = 0.01;
  options.forecast.emplace();
  EXPECT_THAT([&] { options.validate(); },
              ThrowsMessage<InputError>(HasSubstr("takes those of the earlier one")));
}

}  // namespace
}  // namespace clothfit
