// Checks the pieces of texts that tell fitted values. Not checked here: whole texts
// (tests/model/effects/effect_words_test.cpp).

#include "model/cloth/wording.h"

#include <gtest/gtest.h>

namespace clothfit {
namespace {

FittedEffect held_in_four_places() {
  FittedEffect found;
  found.mesh = {9, 9, 0.4, 0.3};
  found.held = {{.at_m = {0.4, 0.3}}, {.at_m = {0.1, 0}}, {.at_m = {0, 0.2}}, {.at_m = {0.1, 0.2}}};
  return found;
}

TEST(Wording, RoundsToThreeDigitsWithoutAnExponent) {
  EXPECT_EQ(rounded(0.25), "0.250");
  EXPECT_EQ(rounded(9.996), "10.0");
  EXPECT_EQ(rounded(1234.6), "1235");
  EXPECT_EQ(rounded(-0.000216), "-0.000216");
  EXPECT_EQ(rounded(0), "0");
}

TEST(Wording, NamesTheSenseOfAShare) {
  EXPECT_EQ(percent(0.014, "longer", "shorter"), "1.40 % longer");
  EXPECT_EQ(percent(-0.014, "longer", "shorter"), "1.40 % shorter");
}

TEST(Wording, WritesDirectionsAndPlacesWithoutANegativeNothing) {
  EXPECT_EQ(unit_vector({-0.001, 3, -4}), "(0.00, 0.60, -0.80)");
  EXPECT_EQ(world_place({-0.0001, 0.1, -0.25}), "(0.000, 0.100, -0.250) m");
}

TEST(Wording, LeavesOutTheSmallPartOfAWay) {
  EXPECT_EQ(way_over_cloth({0.003, -0.0012}), "3.00 mm to the right and 1.20 mm up");
  EXPECT_EQ(way_over_cloth({-0.003, 0.00002}), "3.00 mm to the left");
  EXPECT_EQ(way_over_cloth({0, 0.002}), "2.00 mm down");
  EXPECT_EQ(way_over_cloth({0, 0}), "");
}

TEST(Wording, NamesAHeldPointByItsPlace) {
  const FittedEffect found = held_in_four_places();
  EXPECT_EQ(at_held_point(found, 0), "at every held point");
  EXPECT_EQ(at_held_point(found, 1), "at held point 1 (bottom right corner)");
  EXPECT_EQ(at_held_point(found, 2), "at held point 2 (top edge, 100 mm from the left)");
  EXPECT_EQ(at_held_point(found, 3), "at held point 3 (left edge, 200 mm from the top)");
  EXPECT_EQ(at_held_point(found, 4), "at held point 4 (100 mm from the left, 200 mm from the top)");
  EXPECT_EQ(at_held_point(found, 5), "at held point 5");
}

TEST(Wording, ListsTextsThatAreThere) {
  EXPECT_EQ(listed({"", "one", "", "two"}), "one, two");
  EXPECT_EQ(listed({"", ""}), "");
}

}  // namespace
}  // namespace clothfit
