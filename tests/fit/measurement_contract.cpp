#include "tests/fit/measurement_contract.h"

#include <gtest/gtest.h>

#include "data/input_error.h"
#include "fit/cost/objective.h"
#include "fit/measurement_effects/applicability.h"
#include "fit/measurement_effects/registry.h"

namespace clothfit {

void check_measurement_effect(const std::string& name, const FitInput& input) {
  constexpr int kFrames = 12;
  constexpr double kStepS = 1.0 / 60 / 60;
  for (const ObservationKind kind : {ObservationKind::tracks3d, ObservationKind::tracks2d}) {
    SCOPED_TRACE(kind == ObservationKind::tracks3d ? "3D" : "2D");
    const FitProblem without = make_problem(input, {.observations = kind}, 7, 7);
    const auto effect = measurement_effect_named(name)->make();
    if (effect->needs_camera() && kind == ObservationKind::tracks3d) {
      EXPECT_TRUE(why_inapplicable(*effect, measurement_setting(without)).has_value());
      EXPECT_THROW(make_problem(input, {.observations = kind, .effects = {name}}, 7, 7),
                   InputError);
      continue;
    }
    EXPECT_FALSE(why_inapplicable(*effect, measurement_setting(without)).has_value());
    const FitProblem with = make_problem(input, {.observations = kind, .effects = {name}}, 7, 7);
    const TrajectoryObjective plain(without, kFrames, kStepS), objective(with, kFrames, kStepS);

    // A cubic through two frames at one of them is that one but for rounding. Pixels of 0.3 px
    // sigma and places of 0.5 mm sigma show it as 1e-12.
    const Eigen::VectorXd neutral = objective.residuals({with.space.start()}).front();
    const Eigen::VectorXd bare = plain.residuals({without.space.start()}).front();
    ASSERT_EQ(neutral.size(), bare.size());
    EXPECT_LT((neutral - bare).cwiseAbs().maxCoeff(), 1e-9);

    // The values are away from neutral, on either side, by a typical change of each parameter.
    const EffectDescription description = measurement_effect_named(name)->describe();
    for (const double side : {1.0, -1.0}) {
      SCOPED_TRACE(side);
      Eigen::VectorXd values = with.space.start();
      for (const EffectParameter& parameter : description.parameters)
        values[with.space.index(name + "." + parameter.name)] += side * parameter.typical;
      const Linearisation exact = objective.linearise(values);
      const Linearisation differences = objective.linearise(values, Derivatives::central, 1e-4);
      ASSERT_TRUE(exact.usable && differences.usable);
      for (int p = 0; p < with.space.size(); ++p) {
        SCOPED_TRACE(with.space.parameters[static_cast<size_t>(p)].name);
        const auto column = exact.residual_by_coordinate.col(p);
        const double error = (column - differences.residual_by_coordinate.col(p)).norm();
        EXPECT_LT(error, 1e-5 * column.norm() + 1e-6);
      }
    }
  }
}

}  // namespace clothfit
