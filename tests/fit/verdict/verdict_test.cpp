// What is said of a fit, from its numbers alone. Whether fits deserve it is checked in
// tests/fit/recordings_test.cpp.

#include "fit/verdict/verdict.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "fit/verdict/contradicted_pose.h"
#include "fit/verdict/contradicting.h"

namespace clothfit {
namespace {

FitResult result_with(double fitted, double held_out, double discretisation = 0) {
  FitResult result;
  result.parameters = {{"shear", "N/m", 20, 0.5, ParameterState::fitted, "", Interval{19, 21}}};
  result.errors = {{.kind = "tracks3d",
                    .unit = "m",
                    .fitted = {.rms = fitted, .count = 100},
                    .held_out = {.rms = held_out, .count = held_out > 0 ? 50 : 0},
                    .noise = 1,
                    .trivial = {.first_frame = 60, .last_velocity = 80, .rigid = 60},
                    .discretisation = discretisation,
                    .discretisation_found = discretisation}};
  return result;
}

FitVerdict verdict_of(FitResult result) {
  judge(result);
  return result.verdict;
}

TEST(Verdict, GradesByTheErrorOverTheFloor) {
  EXPECT_EQ(verdict_of(result_with(1.0, 1.2)), FitVerdict::good);
  EXPECT_EQ(verdict_of(result_with(1.0, 1.6)), FitVerdict::usable_with_care);
  EXPECT_EQ(verdict_of(result_with(1.6, 1.2)), FitVerdict::usable_with_care);
  EXPECT_EQ(verdict_of(result_with(2.6, 1.2)), FitVerdict::model_lacks);
  EXPECT_EQ(verdict_of(result_with(1.2, 40)), FitVerdict::model_lacks);
}

TEST(Verdict, CountsMeshAndTimeStepAsFloor) {
  EXPECT_EQ(verdict_of(result_with(1.5, 2.2)), FitVerdict::usable_with_care);
  // The root of 1 + 1.2^2 is 1.56: 2.2 is 1.41 times as much.
  EXPECT_EQ(verdict_of(result_with(1.5, 2.2, 1.2)), FitVerdict::good);
}

TEST(Verdict, CountsOnFittedFramesWhatWasFoundOfMeshAndTimeStep) {
  FitResult result = result_with(2, 4, 3);
  EXPECT_EQ(verdict_of(result), FitVerdict::good);
  result.errors.front().discretisation_found = 0.5;
  judge(result);
  // The root of 1 + 0.5^2 is 1.12: 2 is 1.79 times as much.
  EXPECT_EQ(result.verdict, FitVerdict::usable_with_care);
  EXPECT_NEAR(errors_over_floor(result).held_out, 4 / std::hypot(1, 3), 1e-12);
}

TEST(Verdict, CountsNoMoreOfMeshAndTimeStepThanExpected) {
  FitResult result = result_with(3, 1.2, 1);
  result.errors.front().discretisation_found = 4;
  EXPECT_NEAR(errors_over_floor(result).fitted, 3 / std::hypot(1, 1), 1e-12);
}

TEST(Verdict, IsNoBetterThanAGuess) {
  EXPECT_EQ(verdict_of(result_with(1, 61)), FitVerdict::do_not_use);
}

TEST(Verdict, CountsNoGuessThatCannotBeMade) {
  FitResult result = result_with(1, 1.2);
  TrivialErrors& guesses = result.errors.front().trivial;
  guesses.first_frame = guesses.last_velocity = guesses.rigid = NAN;
  EXPECT_EQ(verdict_of(result), FitVerdict::good);
  guesses.rigid = 1.1;
  EXPECT_EQ(verdict_of(result), FitVerdict::do_not_use);
}

TEST(Verdict, NeedsSomethingDetermined) {
  FitResult result = result_with(1, 1);
  result.parameters.front().state = ParameterState::undetermined;
  EXPECT_EQ(verdict_of(result), FitVerdict::do_not_use);
  result.effects = {{"wind", {{"q_x", "Pa", 0.2, 0.01, ParameterState::fitted, ""}}}};
  EXPECT_EQ(verdict_of(result), FitVerdict::good);
}

TEST(Verdict, IsNotGoodWithoutFramesHeldOutOrConvergence) {
  EXPECT_EQ(verdict_of(result_with(1, 0)), FitVerdict::usable_with_care);
  FitResult result = result_with(1, 1);
  result.converged = false;
  EXPECT_EQ(verdict_of(result), FitVerdict::usable_with_care);
}

TEST(Verdict, WithdrawsIntervalsOfAModelThatLacksSomething) {
  FitResult result = result_with(3, 5);
  judge(result);

  EXPECT_FALSE(result.usable());
  EXPECT_EQ(result.parameters.front().state, ParameterState::misfit);
  EXPECT_FALSE(result.parameters.front().interval_90);
  EXPECT_THAT(result.verdict_reason, testing::HasSubstr("5.0 times"));
}

TEST(Verdict, LeavesIntervalsOfAGoodOne) {
  FitResult result = result_with(1, 1.1);
  judge(result);

  EXPECT_TRUE(result.usable());
  EXPECT_EQ(result.parameters.front().state, ParameterState::fitted);
  EXPECT_TRUE(result.parameters.front().interval_90);
}

TEST(Verdict, BelievesNoIntervalWithoutSigma) {
  FitResult result = result_with(1, 1);
  result.parameters.front().sigma = 0;
  EXPECT_EQ(verdict_of(result), FitVerdict::model_lacks);
}

/// Markers off by about one sigma in twenty frames, and `wrong` of them by 200 from frame 8.
FitReport report_with(int wrong, int markers = 40) {
  FitReport report;
  report.residuals.push_back({.kind = "tracks3d", .unit = "m"});
  for (int f = 0; f < 20; ++f)
    for (int m = 0; m < markers; ++m) {
      const double off = m < wrong && f >= 8 ? 200 : 1;
      report.residuals.back().rows.push_back({.frame = f,
                                              .marker = m,
                                              .observed = Eigen::Vector3d(off, 0, 0),
                                              .predicted = Eigen::Vector3d::Zero(),
                                              .sigma = 1,
                                              .held_out = f >= 15});
    }
  report.result.errors = {{.kind = "tracks3d",
                           .unit = "m",
                           .fitted = {.rms = 30, .count = 600},
                           .held_out = {.rms = 40, .count = 200},
                           .noise = 1}};
  return report;
}

MarkerSet forty_markers() {
  MarkerSet markers;
  for (int m = 0; m < 40; ++m)
    markers.markers.push_back({.name = std::string("m") + std::to_string(m),
                               .s_m = 0.01 * (m % 8),
                               .t_m = 0.01 * (m / 8)});
  return markers;
}

TEST(ContradictingMarkers, AreNamedAndLeftOutOfErrorsBeside) {
  FitReport report = report_with(2);
  name_contradicting(forty_markers(), report);

  ASSERT_EQ(report.result.contradicting.size(), 2u);
  EXPECT_EQ(report.result.contradicting.back().marker, "m1");
  EXPECT_EQ(report.result.contradicting.back().first_frame, 8);
  EXPECT_EQ(report.result.contradicting.back().last_frame, 19);
  EXPECT_NEAR(report.result.contradicting.back().off, 200, 1e-9);
  const ObservationErrors& errors = report.result.errors.front();
  ASSERT_TRUE(errors.fitted_without && errors.held_out_without);
  EXPECT_EQ(errors.fitted_without->count, 15 * 38);
  EXPECT_NEAR(errors.fitted_without->rms_distance, 1, 1e-12);
  EXPECT_NEAR(errors.held_out_without->rms, 1 / std::sqrt(3), 1e-12);
}

/// One marker of the grid 60 off from frame 8, and the four around it by so much.
FitReport report_of_cross(double around) {
  FitReport report = report_with(0);
  for (FitReport::Residuals::Row& row : report.residuals.front().rows) {
    if (row.frame < 8) continue;
    if (row.marker == 10) row.observed = Eigen::Vector3d(60, 0, 0);
    if (std::set<int>{2, 9, 11, 18}.contains(row.marker)) row.observed.x() = around;
  }
  return report;
}

TEST(ContradictingMarkers, AreNotNamedWhereTheirNeighboursLieOffWithThem) {
  FitReport alone = report_of_cross(1), cloth = report_of_cross(24), apart = report_of_cross(-24);
  for (FitReport* report : {&alone, &cloth, &apart}) name_contradicting(forty_markers(), *report);

  EXPECT_EQ(alone.result.contradicting.size(), 1u);
  EXPECT_TRUE(cloth.result.contradicting.empty());
  EXPECT_EQ(apart.result.contradicting.size(), 1u);
}

TEST(ContradictingMarkers, MayBeAllCornersOfATag) {
  MarkerSet markers = forty_markers();
  FitReport report = report_with(0);
  for (const size_t corner : {9u, 10u, 17u, 18u}) markers.markers[corner].tag = 7;
  for (FitReport::Residuals::Row& row : report.residuals.front().rows)
    if (row.frame >= 8 && markers.markers[static_cast<size_t>(row.marker)].tag)
      row.observed = Eigen::Vector3d(60, 0, 0);
  name_contradicting(markers, report);

  EXPECT_EQ(report.result.contradicting.size(), 4u);
}

TEST(ContradictingMarkers, MayBeOneOfAFew) {
  FitReport one = report_with(1, 7), half = report_with(2, 4);
  name_contradicting(forty_markers(), one);
  name_contradicting(forty_markers(), half);

  EXPECT_EQ(one.result.contradicting.size(), 1u);
  EXPECT_TRUE(half.result.contradicting.empty());
}

TEST(ContradictingMarkers, AreNotNamedWhereManyLieOff) {
  FitReport report = report_with(12);
  name_contradicting(forty_markers(), report);

  EXPECT_TRUE(report.result.contradicting.empty());
  EXPECT_FALSE(report.result.errors.front().fitted_without);
}

TEST(ContradictingMarkers, AreNotNamedByAModelThatDoesNotFit) {
  FitReport report = report_with(2);
  for (FitReport::Residuals::Row& row : report.residuals.front().rows) row.sigma = 0.1;
  name_contradicting(forty_markers(), report);

  EXPECT_TRUE(report.result.contradicting.empty());
}

TEST(Outliers, AreLeftOutWhereTheTrackComesBack) {
  FitReport report = report_with(0);
  std::vector<FitReport::Residuals::Row>& rows = report.residuals.front().rows;
  const auto row = [&](int frame, int marker) -> FitReport::Residuals::Row& {
    return rows[static_cast<size_t>(frame * 40 + marker)];
  };
  row(4, 3).observed = row(16, 5).observed = Eigen::Vector3d(0, 30, 0);
  row(0, 7).observed = Eigen::Vector3d(0, 30, 0);  // nothing before it tells
  row(9, 9).observed = row(10, 9).observed = Eigen::Vector3d(0, 30, 0);
  name_contradicting(forty_markers(), report);

  const ObservationErrors& errors = report.result.errors.front();
  EXPECT_EQ(errors.outliers, 2);
  EXPECT_TRUE(report.result.contradicting.empty());
  ASSERT_TRUE(errors.fitted_without && errors.held_out_without);
  EXPECT_EQ(errors.fitted_without->count, 15 * 40 - 1);
  EXPECT_NEAR(errors.held_out_without->rms_distance, 1, 1e-12);
}

/// Every so many markers jump off in every fourth frame, and are back in the next.
int outliers_of_every(int markers) {
  FitReport report = report_with(0);
  for (FitReport::Residuals::Row& row : report.residuals.front().rows)
    if (row.frame % 4 == 2 && row.marker % markers == 0) row.observed = Eigen::Vector3d(0, 30, 0);
  name_contradicting(forty_markers(), report);
  EXPECT_EQ(report.result.errors.front().fitted_without.has_value(),
            report.result.errors.front().outliers > 0);
  return report.result.errors.front().outliers;
}

TEST(Outliers, AreTheModelsWhereThereAreMany) {
  EXPECT_EQ(outliers_of_every(14), 15);  // of 800: 1.9 %
  EXPECT_EQ(outliers_of_every(8), 0);    // 25 are 3.1 %
}

TEST(Outliers, AreNoneWhereTheModelJumps) {
  FitReport report = report_with(0);
  report.residuals.front().rows[4 * 40 + 3].predicted = Eigen::Vector3d(0, 30, 0);
  name_contradicting(forty_markers(), report);

  EXPECT_EQ(report.result.errors.front().outliers, 0);
}

TEST(Outliers, AreNoneWhereFramesAreMissingAround) {
  FitReport report = report_with(0);
  std::vector<FitReport::Residuals::Row>& rows = report.residuals.front().rows;
  rows[10 * 40 + 3].observed = Eigen::Vector3d(0, 30, 0);
  std::erase_if(rows, [](const FitReport::Residuals::Row& row) {
    return row.marker == 3 && row.frame > 5 && row.frame < 15 && row.frame != 10;
  });
  name_contradicting(forty_markers(), report);

  EXPECT_EQ(report.result.errors.front().outliers, 0);
}

bool contradicts_pose(double tilt_rad, double sigmas) {
  FitReport report;
  warn_of_contradicted_pose({.tilt_rad = tilt_rad, .sigmas = sigmas, .is_stated = true}, "",
                            report);
  EXPECT_EQ(report.result.warnings.size(), report.result.contradicts_pose ? 1u : 0u);
  return report.result.contradicts_pose;
}

TEST(ContradictedPose, NeedsATiltBeyondThePoseAndBeyondWhatModelsMake) {
  EXPECT_TRUE(contradicts_pose(0.05, 50));
  EXPECT_FALSE(contradicts_pose(0.05, 4.9));
  EXPECT_FALSE(contradicts_pose(0.005, 50));
  EXPECT_FALSE(contradicts_pose(0, 0));
  EXPECT_FALSE(contradicts_pose(NAN, NAN));
}

TEST(Verdict, IsNotGoodWhereGravityContradictsThePose) {
  FitResult result = result_with(1, 1);
  result.contradicts_pose = true;
  EXPECT_EQ(verdict_of(result), FitVerdict::usable_with_care);
}

TEST(ContradictingMarkers, JudgeTheFitNoMore) {
  FitReport report = report_with(1);
  report.result.parameters = {{"shear", "N/m", 20, 0.5, ParameterState::fitted, ""}};
  report.result.errors.front().trivial = {60, 80, 60};
  name_contradicting(forty_markers(), report);
  judge(report.result);

  EXPECT_EQ(report.result.verdict, FitVerdict::good);
}

}  // namespace
}  // namespace clothfit
