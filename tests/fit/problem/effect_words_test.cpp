// Checks where the words of an effect take their values and their cloth from. Not checked here:
// what effects say (tests/model/effects/effect_words_test.cpp and measurement_effects/).

#include "fit/problem/effect_words.h"

#include <gtest/gtest.h>

namespace clothfit {
namespace {

ParameterEstimate of_value(const std::string& name, double value) {
  return {.name = name, .value = value};
}

/// A report of a cloth of 14.4 g on 9 x 9 equal vertices.
FitReport report_of_equal_masses() {
  FitReport report;
  report.model.cloth = {.width_m = 0.4,
                        .height_m = 0.3,
                        .mass_kg = 0.0144,
                        .masses = MassDistribution::equal,
                        .mesh_columns = 9,
                        .mesh_rows = 9};
  report.model.mesh_columns = report.model.mesh_rows = 9;
  report.model.frame_time_s = {0, 0.02, 0.04, 0.06};
  return report;
}

TEST(WordsOf, WeighTheMassesOfTheModel) {
  FitReport report = report_of_equal_masses();
  report.result.effects = {
      {"nonuniform_mass", {of_value("hem_bottom", 32), of_value("hem_width", 0.00125)}}};

  EXPECT_EQ(words_of({.effect = "nonuniform_mass", .mode = "edges"}, report),
            "3.38 g along the bottom edge");
}

TEST(WordsOf, TakeEffectsOfTheMeasurementAmongTheNuisanceParameters) {
  FitReport report = report_of_equal_masses();
  report.result.nuisance = {of_value("clock_offset.time", 0.005), of_value("scale.factor", 1.014)};

  EXPECT_EQ(words_of({.effect = "scale"}, report),
            "everything is measured 1.40 % larger than it is");
  EXPECT_EQ(words_of({.effect = "clock_offset"}, report),
            "frames show the cloth 5.00 ms (0.250 frames) later than their times say");
}

TEST(WordsOf, CountAPointForEachVertexOfAHeldEdge) {
  FitReport report = report_of_equal_masses();
  report.model.held = {{.point = {.edge = ClothEdge::bottom}, .path = {}},
                       {.point = {.at_m = {0.4, 0}, .motion = HeldMotion::path}, .path = {}}};

  const FittedEffect found = fitted_effect({.effect = "support_drift"}, report);

  ASSERT_EQ(found.held.size(), 10u);
  EXPECT_EQ(found.held[2].at_m, Eigen::Vector2d(0.1, 0.3));
  EXPECT_FALSE(found.held[2].driven);
  EXPECT_EQ(found.held[9].at_m, Eigen::Vector2d(0.4, 0));
  EXPECT_TRUE(found.held[9].driven);
  EXPECT_EQ(found.end_s, 0.06);
}

TEST(WordsOf, AreNothingWithoutWordsOrWithoutAModel) {
  EXPECT_EQ(words_of({.effect = "force_law", .mode = "drag"}, report_of_equal_masses()), "");
  FitReport empty;
  empty.result.effects = {{"viscous_damping", {of_value("rate", 1.5)}}};
  EXPECT_EQ(words_of({.effect = "viscous_damping"}, empty), "");
}

}  // namespace
}  // namespace clothfit
