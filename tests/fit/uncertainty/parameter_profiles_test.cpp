// Checks which parameters of a cloth are profiled and what that says of them. How ends are found is
// checked in profile_likelihood_test.cpp.
#include "fit/uncertainty/parameter_profiles.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

struct Profiled {
  FitProblem problem;
  RefineResult at;
  Uncertainty uncertainty;
  std::vector<ParameterProfile> profiles;
};

/// Fits a 5 x 5 cloth over 20 frames of 3D tracks under the squared loss, and profiles it.
Profiled profiled(double noise_m) {
  Profiled result{.problem = make_problem(synthetic_input({.mesh = 5,
                                                           .markers = 5,
                                                           .frames = 20,
                                                           .held_out_from = 20,
                                                           .noise_m = noise_m,
                                                           .seed = 6}),
                                          {}, 5, 5),
                  .at = {},
                  .uncertainty = {},
                  .profiles = {}};
  const Fabric fabric = SyntheticCloth{}.fabric;
  Eigen::VectorXd truth = result.problem.space.start();
  truth.head<7>() << fabric.tension_warp_n_per_m, fabric.tension_weft_n_per_m, fabric.shear_n_per_m,
      fabric.flexion_warp_n_per_m, fabric.flexion_weft_n_per_m, fabric.damping_warp_s,
      fabric.damping_weft_s;
  result.at = refine(result.problem, 20, truth, {.loss = Loss::squared}, {});
  const TrajectoryObjective objective(result.problem, 20, result.at.time_step_s);
  result.uncertainty = estimate_uncertainty(objective, result.at.values, {.loss = Loss::squared});
  result.profiles =
      parameter_profiles(objective, result.at.values, result.uncertainty, Loss::squared, {});
  return result;
}

TEST(ParameterProfiles, LeaveAloneWhatIsAParabola) {
  const Profiled found = profiled(2e-4);

  ASSERT_EQ(found.profiles.size(), 7u);
  for (const char* name : {"tension_warp", "tension_weft", "shear"}) {  // known to some percent
    SCOPED_TRACE(name);
    const ParameterProfile& profile =
        found.profiles[static_cast<size_t>(found.problem.space.index(name))];
    EXPECT_FALSE(profile.profiled);
    EXPECT_NEAR(profile.rise_below, 1, 0.1);
    EXPECT_NEAR(profile.rise_above, 1, 0.1);
  }
}

TEST(ParameterProfiles, EndWhereTheLeastCostHasRisenAsFarAsTheParabolaWould) {
  // Given noise of 2 mm, which leaves several numbers known to a factor only
  const Profiled found = profiled(2e-3);
  const TrajectoryObjective objective(found.problem, 20, found.at.time_step_s);
  const auto half_squares = [&](const Eigen::VectorXd& values) {
    const Eigen::VectorXd residual = objective.residuals({values}).front();
    return 0.5 * residual.squaredNorm();
  };
  const double least = half_squares(found.at.values);

  int checked = 0;
  for (const ParameterProfile& profile : found.profiles) {
    if (!profile.profiled) continue;
    const int p = profile.parameter;
    SCOPED_TRACE(found.problem.space.parameters[static_cast<size_t>(p)].name);
    EXPECT_LE(profile.lower, found.at.values[p]);
    EXPECT_GE(profile.upper, found.at.values[p]);
    const double parabola = 0.5 * std::pow(found.uncertainty.half_width[p], 2) /
                            found.uncertainty.inverse_hessian(p, p);
    if (profile.profile.upper_end != ProfileEnd::found) continue;
    // Then the others' best at the upper end, by the fit's own solver, costs that much more
    FitProblem held = found.problem;
    held.space.parameters[static_cast<size_t>(p)].lower = profile.upper * (1 - 1e-9);
    held.space.parameters[static_cast<size_t>(p)].upper = profile.upper;
    Eigen::VectorXd start = found.at.values;
    start[p] = profile.upper;
    const RefineResult there =
        refine(held,
               [&](const TimeSteps&) {
                 return std::make_unique<TrajectoryObjective>(held, 20, found.at.time_step_s);
               },
               start, {.loss = Loss::squared}, {});
    ASSERT_TRUE(there.usable) << there.message;
    EXPECT_NEAR(half_squares(there.values) - least, parabola, 0.06 * parabola);
    ++checked;
  }
  EXPECT_GE(checked, 1);
}

}  // namespace
}  // namespace clothfit
