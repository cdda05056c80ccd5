// Checks the force per mass that simulated tracks ask for beyond a model that lacks a known one.
#include "fit/diagnosis/residual_force.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "fit/problem/simulation.h"
#include "tests/fit/hidden_effect.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

/// A recording and its true model but for what is hidden.
struct Truth {
  FitInput input;
  FitOptions options{.loss = Loss::squared};
  DiagnosisSetup setup{.inputs = {&input, 1}, .options = options, .columns = 9, .rows = 9};
  FittedModel model;

  Truth(FitInput recorded, int frames) : input(std::move(recorded)) {
    model = model_at(setup, {}, {named(SyntheticCloth{}.fabric)});
    model.parts.front().frames = frames;
    model.parts.front().steps = TimeSteps(1.0 / 60 / 200);
    linearise_model(model);
    EXPECT_TRUE(model.usable());
  }
};

const ResidualForce::Regression& regression(const ResidualForce& force, const std::string& on) {
  const auto found = std::ranges::find(force.regressions, on, &ResidualForce::Regression::on);
  EXPECT_NE(found, force.regressions.end()) << on;
  return *found;
}

// A cloth that nothing holds answers a push on all of it with nothing.
TEST(ResidualForce, OnAFreeClothIsTheMissingOne) {
  const Eigen::Vector3d push(0.6, -0.4, 0.3);
  FitInput free = synthetic_input({});
  free.recording.held.clear();
  DeclaredEffect hidden{.name = "frame_acceleration", .parameters = {}};
  hidden.parameters = {{"a_x", {-push.x()}},
                       {"a_y", {-push.y()}},
                       {"a_z", {-push.z()}},
                       {"frequency", {0.05}},
                       {"phase", {0.25}}};
  const Truth truth(moved_by(hidden, free), 26);

  const ResidualForce force = residual_force(truth.model);

  ASSERT_EQ(force.markers.size(), 49u);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const ResidualForce::OfMarker& of : force.markers) mean += of.mean_m_per_s2 / 49;
  // cos(2 pi 0.05 t) falls to 0.99 within the frames. The mean of 49 parabolas of 26 points with
  // noise of 0.5 mm has a sigma of 0.01.
  EXPECT_LT((mean - push).norm(), 0.05 * push.norm());
}

TEST(ResidualForce, OfAHiddenDragGoesAgainstTheVelocityAndIsLessThanIt) {
  const Truth truth(synthetic_input({.drag_rate_per_s = 1.2}), 20);

  const ResidualForce force = residual_force(truth.model);

  const ResidualForce::Regression& velocity = regression(force, "velocity");
  EXPECT_LT(velocity.correlation, -0.5);
  EXPECT_LT(velocity.slope, -5 * velocity.sigma);
  EXPECT_GT(velocity.slope, -1.2 - 3 * velocity.sigma);  // the springs' answer is in it
  EXPECT_GT(std::abs(velocity.correlation),
            std::abs(regression(force, "strain rate along the warp").correlation));
  // Drag acts on what moves: on the free edge, and more while it falls than at first.
  const auto rms = [&](int marker) {
    return std::ranges::find(force.markers, marker, &ResidualForce::OfMarker::marker)
        ->rms_m_per_s2.norm();
  };
  EXPECT_GT(rms(45), 3 * rms(3));
  EXPECT_GT(force.rms_by_frame_m_per_s2[14], force.rms_by_frame_m_per_s2[3]);
}

TEST(ResidualForce, OfATrueModelGoesWithNothing) {
  const Truth truth(synthetic_input({}), 26);

  const ResidualForce force = residual_force(truth.model);

  for (const ResidualForce::Regression& on : force.regressions)
    EXPECT_LT(std::abs(on.correlation), 0.2) << on.on;
}

TEST(ResidualForce, IsNotKnownFromPixels) {
  FitInput pixels = synthetic_input({});
  pixels.tracks3d.clear();
  const Truth truth(std::move(pixels), 12);

  const ResidualForce force = residual_force(truth.model);

  EXPECT_TRUE(force.markers.empty());
  EXPECT_FALSE(force.why_none.empty());
}

}  // namespace
}  // namespace clothfit
