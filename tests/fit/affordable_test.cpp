// Checks the limits of work and memory of fits, and that the estimates are those of what is done.
// Not checked here: ranges of options (tests/apps/program_ending_test.cpp).

#include "fit/affordable.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/input_error.h"
#include "fit/fit.h"
#include "fit/problem/memory_limits.h"
#include "fit/problem/parameterised_model.h"
#include "fit/problem/work_limits.h"
#include "fit/search/evolutionary_strategy.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

const SyntheticCloth kSmall{.mesh = 5, .markers = 4, .frames = 30, .held_out_from = 24};

TEST(WorkOfRun, IsTheStepsThatARunTakes) {
  const FitInput input = synthetic_input(kSmall);
  const FitProblem problem = make_problem(input, {}, 5, 5);
  const std::vector<double> time_s{0, 0.1, 0.25};
  const RunWork plain = work_of_run(problem.cloth, time_s, 0.01, false, 9.81);
  EXPECT_EQ(plain.steps, 25);
  EXPECT_EQ(plain.springs, static_cast<double>(problem.cloth.spring_count()));
  EXPECT_EQ(plain.spring_steps(), plain.steps * plain.springs);
  EXPECT_GT(work_of_run(problem.cloth, time_s, 0.01, true, 9.81).steps, plain.steps);
}

TEST(WorkOfRun, CannotOverflow) {
  const FitProblem problem = make_problem(synthetic_input(kSmall), {}, 5, 5);
  for (const double step_s : {1e-300, 0.0}) {
    const RunWork work = work_of_run(problem.cloth, {0, 1e6}, step_s, true, 9.81);
    EXPECT_GT(work.steps, 1e300);
    EXPECT_THROW(require_affordable_run(work, "here", "less"), InputError);
  }
}

TEST(LeastCost, GrowsWithTheMeshTheFramesTheStepsAndThePopulation) {
  const FitInput input = synthetic_input(kSmall);
  const auto cost = [&](const FitOptions& options, int mesh) {
    return least_cost(make_problem(input, options, mesh, mesh), options);
  };
  const FitCost plain = cost({}, 9);
  FitOptions finer;
  finer.substep_scale = 10;
  EXPECT_NEAR(cost(finer, 9).spring_steps, 10 * plain.spring_steps, plain.spring_steps);
  EXPECT_GT(cost({}, 17).spring_steps, 4 * plain.spring_steps);
  EXPECT_GT(cost({}, 17).bytes, 2 * plain.bytes);
  FitOptions crowd;
  crowd.population = 100'000;
  EXPECT_GT(cost(crowd, 9).spring_steps, 10 * plain.spring_steps);
  EXPECT_GT(cost(crowd, 9).bytes, 10 * plain.bytes);
}

TEST(RequireAffordable, RefusesWhatTakesLongerThanADayBeforeAnythingRuns) {
  FitInput input = synthetic_input(kSmall);
  input.recording.frame_rate_hz.reset();
  for (int frame = 0; frame < kSmall.frames; ++frame)
    input.recording.times_s.push_back(1e6 * frame);
  EXPECT_THAT([&] { fit(input, {}, {}); },
              ThrowsMessage<InputError>(AllOf(HasSubstr("recording.yaml"), HasSubstr("time steps"),
                                              HasSubstr("at most 1e+08"),
                                              HasSubstr("FitOptions::mesh_columns"))));
}

TEST(RequireAffordable, RefusesAForecastOfAClothTooStiffToSimulate) {
  const FitInput input = synthetic_input(kSmall);
  FitOptions options;
  options.mesh_columns = options.mesh_rows = 5;
  options.population = 16;
  options.generations = 2;
  options.work = 1e-3;
  FitReport known = fit(input, options, {});
  ASSERT_TRUE(known.usable());
  for (ParameterEstimate& parameter : known.result.parameters)
    if (parameter.name == "tension_warp") parameter.value = 1e12;
  FitOptions forecast;
  forecast.forecast = known.result;
  EXPECT_THAT(
      [&] { fit(input, forecast, {}); },
      ThrowsMessage<InputError>(AllOf(HasSubstr("FitOptions::forecast"), HasSubstr("time steps"))));
}

TEST(RequireAffordable, RefusesMarkersWhoseWeightsFitIntoNoMemory) {
  FitInput input = synthetic_input(kSmall);
  for (int n = 0; n < 200'000; ++n)
    input.recording.markers.markers.push_back(
        {.name = "more" + std::to_string(n), .s_m = 1e-6 * n, .t_m = 0.1234});
  EXPECT_THAT(
      [&] { make_problem(input, {}, 256, 256); },
      ThrowsMessage<InputError>(AllOf(HasSubstr("200016 markers"), HasSubstr("GB of memory"))));
}

TEST(Evolve, EndsAtItsLimitOfWorkWithWhatItHasAndSaysSo) {
  const std::vector<SearchParameter> parameters{{.name = "x", .lower = 0, .upper = 1}};
  const EvolutionOptions options{
      .population = 10, .generations = 50, .least_gain = 0, .most_evaluations = 30};
  const EvolutionResult result = evolve(parameters, options, [](const Eigen::MatrixXd& x) {
    return Eigen::VectorXd(x.row(0).transpose());
  });
  EXPECT_EQ(result.stop, EvolutionStop::out_of_work);
  EXPECT_TRUE(result.usable());
  EXPECT_GE(result.state.evaluations, 30);
  EXPECT_LT(result.state.evaluations, 40);
  EXPECT_THAT(result.message, HasSubstr("limit of work"));
}

}  // namespace
}  // namespace clothfit
