// Whole diagnoses of simulated recordings whose truth is known. Rates over many are a study
// (clothfit recover --undeclared), bundled recordings are tests/fit/recordings_test.cpp.
#include "fit/diagnose.h"

#include <gtest/gtest.h>

#include "data/input_error.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

DiagnoseOptions quick() {
  DiagnoseOptions options;
  options.fit.mesh_columns = options.fit.mesh_rows = 9;
  options.fit.generations = 10;
  options.fit.population = 40;
  options.fit.refine_best = 1;
  return options;
}

TEST(Diagnose, NamesAHiddenDragAndItsAmount) {
  const Diagnosis diagnosis = diagnose(synthetic_input({.drag_rate_per_s = 1.2}), quick(), {});

  ASSERT_TRUE(diagnosis.usable()) << diagnosis.message;
  ASSERT_EQ(diagnosis.accepted.size(), 1u);
  EXPECT_EQ(diagnosis.accepted.front().trial.term.effect, "viscous_damping");
  EXPECT_EQ(diagnosis.verdict, DiagnosisVerdict::explained);
  EXPECT_FALSE(diagnosis.before.adequate);
  ASSERT_EQ(diagnosis.found.result.effects.size(), 1u);
  const ParameterEstimate& rate = diagnosis.found.result.effects.front().parameters.front();
  EXPECT_NEAR(rate.value, 1.2, 4 * rate.sigma);
  const ObservationErrors& before = diagnosis.base.result.errors.front();
  const ObservationErrors& after = diagnosis.found.result.errors.front();
  EXPECT_GT(before.held_out.rms, 2 * before.noise);
  EXPECT_LT(after.held_out.rms, 1.1 * after.noise);
}

TEST(Diagnose, FindsNothingWhereNothingIsHiddenAndSaysWhatItWouldHaveSeen) {
  const Diagnosis diagnosis = diagnose(synthetic_input({}), quick(), {});

  ASSERT_TRUE(diagnosis.usable()) << diagnosis.message;
  EXPECT_TRUE(diagnosis.accepted.empty());
  EXPECT_EQ(diagnosis.verdict, DiagnosisVerdict::adequate);
  ASSERT_FALSE(diagnosis.limits.empty());
  for (const DetectionLimit& limit : diagnosis.limits)
    if (limit.term.effect == "viscous_damping") {
      EXPECT_GT(limit.limit[0], 0);
      EXPECT_LT(limit.limit[0], 0.5);  // 1/s: the drag of the other test is far above it
    }
}

TEST(Diagnose, DoesNotNameWhatItWasNotToTest) {
  DiagnoseOptions options = quick();
  options.without = {"viscous_damping"};
  options.most_effects = 1;
  const Diagnosis diagnosis = diagnose(synthetic_input({.drag_rate_per_s = 1.2}), options, {});

  for (const LawScore& score : diagnosis.scores) EXPECT_NE(score.term.effect, "viscous_damping");
  EXPECT_NE(diagnosis.verdict, DiagnosisVerdict::adequate);
}

TEST(Diagnose, EndsSoonWhenItIsToldTo) {
  int calls = 0;
  const Diagnosis diagnosis =
      diagnose(synthetic_input({}), quick(), [&](const Progress&) { return ++calls < 5; });
  EXPECT_EQ(diagnosis.stop, FitStop::cancelled);
}

TEST(Diagnose, RefusesOptionsThatMakeNoSense) {
  DiagnoseOptions options = quick();
  options.lines = 0;
  EXPECT_THROW(diagnose(synthetic_input({}), options, {}), InputError);
  options = quick();
  options.without = {"aether"};
  EXPECT_THROW(diagnose(synthetic_input({}), options, {}), InputError);
}

}  // namespace
}  // namespace clothfit
