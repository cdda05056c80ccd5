// Checks where obstacles are looked for that nobody has described. Whole searches for them are
// checked on recordings (diagnosed_recordings_test.cpp).
#include "fit/diagnosis/contacts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "fit/diagnosis/catalogue.h"
#include "fit/diagnosis/criteria.h"
#include "fit/diagnosis/residual_acceleration.h"
#include "fit/diagnosis/search_context.h"
#include "tests/fit/diagnosis/true_model.h"
#include "tests/fit/hidden_effect.h"

namespace clothfit {
namespace {

constexpr double kRadius_m = 0.07;
const Eigen::Vector3d kCentre_m(0.2, 0, -0.28);

DeclaredEffect hidden_ball() {
  DeclaredEffect ball{.name = "contact_sphere", .parameters = {}};
  ball.parameters = {{"stiffness", {2e4}},
                     {"damping", {130}},
                     {"friction", {0}},
                     {"centre_x", {kCentre_m.x()}},
                     {"centre_y", {kCentre_m.y()}},
                     {"centre_z", {kCentre_m.z()}},
                     {"radius", {kRadius_m}}};
  return ball;
}

/// A recording, and its true model but for an obstacle.
struct Scene {
  SyntheticCloth cloth{.frames = 36, .held_out_from = 34};
  FitInput input;
  FitOptions fit;
  DiagnosisSetup setup{.inputs = {&input, 1}, .options = fit, .columns = 9, .rows = 9};
  SearchOptions options;
  FittedModel model;

  explicit Scene(bool has_ball) : input(synthetic_input(cloth)) {
    if (has_ball) input = moved_by(hidden_ball(), input);
    options.contacts = contacts_to_test(input, fit);
    model = true_model(setup, cloth);
  }
  std::vector<Score> scores() const {
    const SearchContext search(setup, options, {});
    return score_contacts(search, setup, model, model, options.contacts);
  }
};

TEST(Contacts, FindABallWhereTheClothMeetsIt) {
  const Scene scene(true);
  ASSERT_EQ(scene.options.contacts.size(), 2u);  // a plane and a ball
  ASSERT_GT(scene.model.misfit(), kCriteria.biased);

  const std::vector<Score> scores = scene.scores();

  const auto ball = std::ranges::find_if(
      scores, [](const Score& score) { return score.hypothesis.effect == "contact_sphere"; });
  ASSERT_NE(ball, scores.end());
  EXPECT_GT(ball->share, 0.9);
  const std::map<std::string, double>& found = ball->hypothesis.shape;
  const Eigen::Vector3d centre_m(found.at("centre_x"), found.at("centre_y"), found.at("centre_z"));
  // A few linearisations place its surface where the cloth meets it. Of its curvature, few of the
  // markers say anything, which lie 67 mm apart.
  const double larger_m = found.at("radius") - kRadius_m;
  EXPECT_LT((centre_m - kCentre_m).norm(), std::abs(larger_m) + 0.2 * kRadius_m);
  EXPECT_LT(std::abs(larger_m), kRadius_m);
  for (const Score& score : scores) EXPECT_LE(score.decrease, ball->decrease);
}

TEST(Contacts, FindNothingWhereNothingIsMet) {
  EXPECT_TRUE(Scene(false).scores().empty());
}

TEST(ResidualAccelerations, OfAParabolaAreItsOwn) {
  Scene scene(false);
  const Eigen::Vector3d a_m_per_s2(3, -2, 1);
  FittedModel model = scene.model;
  const TrajectoryObjective objective = model.objective(0);
  const FitProblem& problem = *model.problems.front();
  for (const Objective::Block& block : objective.blocks()) {
    const double t = problem.frame_time_s[static_cast<size_t>(block.frame)];
    const Observation& row = problem.observations.front().rows[static_cast<size_t>(block.row)];
    // Residuals are predicted less observed.
    model.parts.front().linear.residual.segment<3>(block.offset) =
        -0.5 * t * t * a_m_per_s2 / row.sigma;
  }

  const std::vector<ResidualAcceleration> found = residual_accelerations(model, 0);

  ASSERT_GT(found.size(), 1000u);
  for (const ResidualAcceleration& of : found) {
    EXPECT_LT((of.acceleration_m_per_s2 - a_m_per_s2).norm(), 1e-9);
    // Five frames of 0.5 mm at 60 Hz: 2 sigma / sqrt(14) / (1/60 s)^2.
    if (of.frame > 1 && of.frame < model.parts.front().frames - 2) {
      EXPECT_NEAR(of.sigma_m_per_s2, 2 * 5e-4 / std::sqrt(14) * 3600, 1e-6);
    }
  }
}

}  // namespace
}  // namespace clothfit
