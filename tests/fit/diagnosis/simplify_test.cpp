// Checks that a simpler hypothesis takes the place of one that does no better, and only then. The
// searches that lead there are in search_test.cpp.
#include "fit/diagnosis/simplify.h"

#include <gtest/gtest.h>

#include <map>
#include <string>

#include "fit/diagnosis/beam.h"
#include "fit/diagnosis/rival.h"
#include "fit/diagnosis/search_context.h"
#include "fit/diagnosis/twin.h"
#include "fit/problem/parameterised_model.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

constexpr unsigned kTwinSeed = 5;
const SyntheticCloth kBlown{.mesh = 7, .markers = 5, .frames = 24, .held_out_from = 20};
const Hypothesis kSteady{.effect = "wind", .mode = "pressure", .amplitudes = {"q_x", "q_y", "q_z"}};

/// Returns a wind that comes and goes, cos(2 pi f t), at a frequency that is not fitted.
Hypothesis gust_of(double frequency_hz) {
  return {.effect = "gust",
          .mode = "",
          .amplitudes = {"q_x", "q_y", "q_z"},
          .shape = {{"frequency", frequency_hz}, {"phase", 0}},
          .shape_sigma = {{"frequency", 1}, {"phase", 0.1}}};
}

NamedValues truth_with(const Hypothesis& hidden) {
  NamedValues values = named(kBlown.fabric);
  values[hidden.effect + ".q_x"] = 0.05;
  values[hidden.effect + ".q_y"] = 0.1;
  values[hidden.effect + ".q_z"] = 0.02;
  for (const auto& [name, value] : hidden.shape) values[hidden.effect + "." + name] = value;
  return values;
}

FitOptions options_with_hidden(const Hypothesis& hidden) {
  FitOptions options;
  options.mesh_columns = options.mesh_rows = kBlown.mesh;
  options.hypotheses = {hidden};
  return options;
}

/// Returns a recording of a cloth on which something hidden acts.
FitInput recording_of(const Hypothesis& hidden) {
  const FitInput input = synthetic_input(kBlown);
  const FitReport report =
      report_at(input, options_with_hidden(hidden), {.values = truth_with(hidden), .sigma = {}});
  EXPECT_TRUE(report.usable()) << report.message;
  return twin_of(input, report, kTwinSeed);
}

/// An entry that accepted a gust, for which a steady wind was tried too.
struct GustAccepted {
  FitInput input;
  FitOptions fit;
  DiagnosisSetup setup{
      .inputs = {&input, 1}, .options = fit, .columns = kBlown.mesh, .rows = kBlown.mesh};
  SearchOptions options;
  SearchContext search{setup, options, {}};
  BeamEntry entry{.model = {}, .accepted = {}, .last = {}, .refused = {}};

  GustAccepted(const Hypothesis& hidden, const Hypothesis& accepted) : input(recording_of(hidden)) {
    NamedValues start = truth_with(accepted);
    entry.model = model_at(setup, {accepted}, {start});
    refine_model(entry.model, setup, {}, {});
    EXPECT_TRUE(entry.model.usable());
    Trial trial{.hypothesis = accepted, .decrease = 1e5};
    trial.criteria.push_back({"clear_of_neutral", 50, 5, true, ""});
    entry.accepted.push_back(
        {.trial = trial, .alike = {}, .refused = {Trial{.hypothesis = kSteady}}});
  }
};

TEST(Simplify, PutsASteadyWindInPlaceOfAGustThatHardlyChanges) {
  SCOPED_TRACE("seed " + std::to_string(kTwinSeed));
  const Hypothesis slow = gust_of(0.05);
  GustAccepted gust(kSteady, slow);
  simplify(gust.search, gust.entry);

  const AcceptedEffect& accepted = gust.entry.accepted.front();
  EXPECT_EQ(accepted.trial.hypothesis.effect, "wind");
  ASSERT_EQ(accepted.alike.size(), 1u);
  EXPECT_EQ(accepted.alike.front().effect, "gust");
  EXPECT_TRUE(accepted.refused.empty());
  EXPECT_EQ(accepted.trial.criteria.back().name, "as_simple");
  ASSERT_EQ(gust.entry.model.hypotheses.size(), 1u);
  const NamedValues found = gust.entry.model.values().front();
  EXPECT_NEAR(found.at("wind.q_y"), 0.1, 0.02);
  EXPECT_NEAR(gust.entry.model.misfit(), 1, 0.1);
}

TEST(Simplify, KeepsAGustThatDoesBetter) {
  SCOPED_TRACE("seed " + std::to_string(kTwinSeed));
  const Hypothesis fast = gust_of(2.5);
  GustAccepted gust(fast, fast);
  simplify(gust.search, gust.entry);
  EXPECT_EQ(gust.entry.accepted.front().trial.hypothesis.effect, "gust");
  EXPECT_EQ(gust.entry.model.hypotheses.front().effect, "gust");
}

TEST(Rival, IsNotFittedWhereItChangesResidualsOtherwise) {
  const Hypothesis slow = gust_of(0.05);
  GustAccepted gust(kSteady, slow);
  const Change change = change_by(gust.setup, gust.entry.model, 0);
  ASSERT_GT(change.of_residuals.size(), 0);
  const Hypothesis scale{.effect = "scale", .mode = "", .amplitudes = {"factor"}};
  EXPECT_FALSE(with_rival(gust.setup, gust.entry.model, 0, change, scale, {}, {}).usable());
  EXPECT_TRUE(with_rival(gust.setup, gust.entry.model, 0, change, kSteady, {}, {}).usable());
}

}  // namespace
}  // namespace clothfit
