// Checks what the effects of motion say of fitted values in quantities of people, against closed
// forms. Not checked here: the pieces of such texts (tests/model/cloth/wording_test.cpp), the
// effects of the measurement (tests/fit/measurement_effects/effect_words_test.cpp), where the
// values come from (tests/fit/problem/effect_words_test.cpp).

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "model/cloth/fitted_effect.h"
#include "model/effects/registry.h"

namespace clothfit {
namespace {

using testing::HasSubstr;
using testing::Not;
using Values = std::map<std::string, double>;

constexpr double kToldWidth_m = 0.4, kToldHeight_m = 0.3, kToldDensity_kg_per_m2 = 0.12;
constexpr double kToldWeight_pa = kToldDensity_kg_per_m2 * 9.81;

/// Returns an effect with some values, the others neutral. The cloth is held at its upper corners,
/// which are driven, and was seen for 1.2 s at 60 Hz.
FittedEffect fitted(const std::string& effect, const std::string& mode, const Values& values,
                    int vertices_per_side = 17) {
  FittedEffect found;
  found.mode = mode;
  for (const EffectParameter& parameter : find_effect(effect, "test").describe().parameters)
    found.values[parameter.name] = parameter.neutral;
  for (const auto& [name, value] : values) found.values.at(name) = value;
  found.mesh = {vertices_per_side, vertices_per_side, kToldWidth_m, kToldHeight_m};
  found.mass_kg = masses_by_area(found.mesh, kToldDensity_kg_per_m2 * kToldWidth_m * kToldHeight_m);
  found.held = {{.at_m = {0, 0}, .driven = true}, {.at_m = {kToldWidth_m, 0}, .driven = true}};
  found.end_s = 1.2;
  return found;
}

std::string words(const std::string& effect, const FittedEffect& found) {
  return find_effect(effect, "test").describe().in_words(found);
}

std::string words(const std::string& effect, const std::string& mode, const Values& values) {
  return words(effect, fitted(effect, mode, values));
}

TEST(EffectWords, AreNothingAtNeutralAndNumbersAwayFromItInEveryMode) {
  for (const EffectEntry& entry : effect_registry()) {
    const EffectDescription effect = entry.describe();
    if (effect.in_words == nullptr) continue;
    std::vector<EffectMode> modes = effect.modes;
    if (modes.empty()) modes.push_back({.name = "", .amplitudes = {}, .shapes = {}});
    for (const EffectMode& mode : modes) {
      SCOPED_TRACE(effect.name + " " + mode.name);
      EXPECT_EQ(words(effect.name, mode.name, {}), "");
      Values typical;
      for (const EffectParameter& parameter : effect.parameters)
        if (mode.amplitudes.empty() ||
            std::ranges::find(mode.amplitudes, parameter.name) != mode.amplitudes.end())
          typical[parameter.name] = parameter.neutral + parameter.typical;
      const std::string text = words(effect.name, mode.name, typical);
      EXPECT_NE(text, "");
      EXPECT_THAT(text, Not(HasSubstr("nan")));
      EXPECT_THAT(text, Not(HasSubstr("inf")));
    }
  }
}

TEST(EffectWords, TellAPressureAsAWindAndADragAsASpeedOfFalling) {
  EXPECT_EQ(words("wind", "pressure", {{"q_y", 0.24}, {"q_z", -0.07}}),
            "0.250 Pa towards (0.00, 0.96, -0.28), as of a wind of 0.645 m/s");
  EXPECT_EQ(words("wind", "drag", {{"c", 0.5}, {"q_y", 0.24}}),
            "lying flat, the cloth falls at 2.35 m/s at most");  // 1.1772 Pa / 0.5
  EXPECT_EQ(words("gust", "", {{"q_y", 0.3}, {"frequency", 1.5}}),
            "up to 0.300 Pa along (0.00, 1.00, 0.00), to and fro 1.50 times a second, as of a wind "
            "of 0.707 m/s");
  EXPECT_EQ(words("quadratic_drag", "normal", {{"c_n", 2.4}}),
            "drag coefficient 2.00 in air: lying flat, the cloth falls at 0.990 m/s at most");
  EXPECT_EQ(words("quadratic_drag", "tangential", {{"c_n", 2.4}, {"c_t", 0.06}}),
            "drag coefficient 0.0500 in air: edge-on, the cloth falls at 6.26 m/s at most");
  EXPECT_EQ(words("viscous_damping", "", {{"rate", 1.5}}),
            "half of a speed is gone after 0.462 s");  // ln 2 / 1.5
  EXPECT_EQ(words("added_air_mass", "", {{"mu", 0.09}}),
            "air of 0.750 times the cloth's mass moves along with it, as a layer of 75.0 mm");
}

TEST(EffectWords, TellWhereDownIsAndHowTheFrameShakes) {
  EXPECT_EQ(words("gravity_scale", "", {{"excess", 0.02}}), "gravity of 10.0 m/s2, stated 9.81");
  // 2 atan(0.025); a turn about x leads -z to y.
  EXPECT_EQ(words("gravity_tilt", "", {{"about_x", 0.05}}),
            "down leans by 2.86 degrees towards (0.00, 1.00, 0.00)");
  EXPECT_EQ(words("frame_acceleration", "", {{"a_x", 3}, {"frequency", 2}}),
            "the frame shakes by 19.0 mm to either side along (1.00, 0.00, 0.00), 2.00 times a "
            "second");
}

TEST(EffectWords, WeighAHemEdgesAndAPatch) {
  // 0.12 kg/m2 times 1.5 over the band, 0.4 x 0.3 less 0.38 x 0.28 m2.
  EXPECT_EQ(words("nonuniform_mass", "hem", {{"hem", 1.5}, {"hem_width", 0.01}}),
            "2.45 g in a hem of 10.0 mm all round");
  EXPECT_EQ(words("nonuniform_mass", "edges",
                  {{"hem_bottom", 5}, {"hem_left", -0.5}, {"hem_top", 0.01}, {"hem_width", 0.012}}),
            "2.88 g along the bottom edge, -0.216 g along the left edge");
  // 0.8 times 0.12 kg/m2 over a quarter of the disc.
  const FittedEffect patch =
      fitted("nonuniform_mass", "patch", {{"patch", 0.8}, {"patch_radius", 0.1}}, 65);
  EXPECT_EQ(words("nonuniform_mass", patch),
            "0.754 g within 100 mm of a place 200 mm from the left, 150 mm from the top");
}

// Half of a border vertex's flat area carries as much mass as a whole one's: the hem weighs twice.
TEST(EffectWords, WeighAnEdgeByTheMassesOfTheVertices) {
  FittedEffect edge =
      fitted("nonuniform_mass", "edges", {{"hem_bottom", 32}, {"hem_width", 0.00125}}, 9);
  const double cloth_kg = edge.mass_kg.sum();
  edge.mass_kg = masses_equal(edge.mesh, edge.mesh, cloth_kg);

  // The last row's share of the band is 2 w - w^2, that of the row above w^2 / 2, w = 1 / 30.
  EXPECT_NEAR(1e3 * cloth_kg / 9 * 32 * (2.0 / 30 - 0.5 / 900), 3.3849, 1e-4);
  EXPECT_EQ(words("nonuniform_mass", edge), "3.38 g along the bottom edge");
}

TEST(EffectWords, TellAModeBesideTheOthers) {
  // The band of 0.64 spacings has 0.4352 of a row's mass in the last row, where the gradient leaves
  // 0.9, and 0.2048 in the row above, where it leaves 0.9125: 0.904 of 2.88 g.
  EXPECT_EQ(words("nonuniform_mass", "edges",
                  {{"hem_bottom", 5}, {"hem_width", 0.012}, {"gradient_t", -0.2}}),
            "2.60 g along the bottom edge");
  // Trapezoids on 16 intervals: side times gradient / 12 (1 + 2 / 256).
  EXPECT_EQ(words("nonuniform_mass", "gradient", {{"gradient_s", 0.4}, {"gradient_t", -0.2}}),
            "centre of mass 13.4 mm to the right and 5.04 mm up");
}

TEST(EffectWords, TellWhatTheFabricDoes) {
  EXPECT_EQ(words("anisotropy", "", {{"a", -0.1}}),
            "warp 10.0 % softer, weft 10.0 % stiffer than the fabric's numbers");
  // L^3 = 8 B / (10 w)
  EXPECT_EQ(words("bending_energy", "", {{"B", 1e-5}}),
            "by this alone, a strip of 18.9 mm that is clamped at one end sags by a tenth of that");
  EXPECT_EQ(words("hysteresis", "", {{"ratio", 0.3}, {"yield", 0.005}}),
            "1.30 times as stiff up to a stretch of 0.500 %, where it slips");
  EXPECT_EQ(words("natural_size", "", {{"warp", -0.02}, {"weft", 0.0075}}),
            "unloaded, the cloth is 6.00 mm shorter from top to bottom, 3.00 mm longer from left "
            "to right");
  EXPECT_EQ(words("relaxation", "", {{"ratio", 0.7}, {"time", 0.1}}),
            "1.70 times as stiff at once; half of the excess is gone after 0.0693 s");
  EXPECT_EQ(words("stiffening", "stretched", {{"stretched", 0.5}, {"strain", 0.02}}),
            "stretched by 2.00 %, it pulls 1.25 times as hard as its stiffness says");
  EXPECT_EQ(words("stiffening", "compressed", {{"compressed", 0.4}, {"strain", 0.02}}),
            "compressed by 2.00 %, it pushes 0.800 times as hard as its stiffness says");
  EXPECT_EQ(words("nonuniform_stiffness", "patch", {{"patch", 2}, {"patch_s", 0.25}}),
            "3.00 times as stiff at 100 mm from the left, 150 mm from the top");
  EXPECT_EQ(words("nonuniform_stiffness", "rectangle",
                  {{"rectangle", 2}, {"rectangle_s", 0.2}, {"rectangle_half_s", 0.3}}),
            "3.00 times as stiff from 0 mm to 200 mm off the left and 75.0 mm to 225 mm off the "
            "top edge");
  EXPECT_EQ(words("nonuniform_stiffness", "edge", {{"edge", 0.5}}),
            "1.50 times as stiff on the border");
  EXPECT_EQ(words("nonuniform_stiffness", "gradient", {{"gradient_s", 0.1}}),
            "0.900 times as stiff on the left and 1.10 times on the right");
}

TEST(EffectWords, TellWhatTheClothTouches) {
  // At z = 2 d / 3 the pressure is pi stiffness z / 9.
  const double stiffness = 9 * kToldWeight_pa / (std::numbers::pi * 0.02);
  EXPECT_EQ(words("self_contact", "", {{"stiffness", stiffness}, {"thickness", 0.03}}),
            "one layer rests on another 20.0 mm away");
  // At most, at z = d / 3, it is 4 / 27 pi stiffness d.
  EXPECT_EQ(words("self_contact", "", {{"stiffness", 10}, {"thickness", 0.03}}),
            "too soft for one layer to carry another");
  EXPECT_EQ(words("contact_sphere", "",
                  {{"stiffness", 1000},
                   {"radius", 0.15},
                   {"centre_x", 0.1},
                   {"centre_y", -0.25},
                   {"centre_z", 0.4}}),
            "a ball of 150 mm radius about (0.100, -0.250, 0.400) m");
  EXPECT_EQ(words("contact_plane", "", {{"stiffness", 1000}, {"n_z", 2}, {"offset", -0.5}}),
            "a plane through (0.000, 0.000, -0.500) m that keeps the cloth on its side towards "
            "(0.00, 0.00, 1.00)");
}

TEST(EffectWords, TellHowHeldPointsMove) {
  EXPECT_EQ(words("support_drift", "single",
                  {{"velocity_x", 0.006}, {"velocity_z", -0.008}, {"point", 1}}),
            "12.0 mm at held point 1 (top left corner) by the end, towards (0.60, 0.00, -0.80)");
  EXPECT_EQ(
      words("support_motion", "",
            {{"amplitude_y", 0.003}, {"amplitude_z", 0.004}, {"frequency", 1.3}}),
      "5.00 mm to either side along (0.00, 0.60, 0.80), 1.30 times a second, at every held point");
  EXPECT_EQ(words("support_offset", "single", {{"offset_x", 0.003}, {"point", 2}}),
            "3.00 mm towards (1.00, 0.00, 0.00), at held point 2 (top right corner)");
  EXPECT_EQ(words("support_slip", "", {{"mobility", 0.01}, {"threshold", 0.0981}}),
            "holds a pull of up to 10.0 g, creeps by 0.0981 mm a second for each gram beyond, at "
            "every held point");
  EXPECT_EQ(words("rigid_support", "", {{"share", 0.97}, {"slack", -0.03}}),
            "the two held points are drawn to 388 mm apart, 12.0 mm less than over the flat cloth, "
            "97.0 % of the way");
}

TEST(EffectWords, TellTheEndOfAPathAndItsFurthestPoint) {
  Values path{{"shift_1_x", 0.006}, {"shift_2_x", 0.012}, {"shift_3_x", 0.011},
              {"shift_4_x", 0.010}, {"until", 1.2},       {"point", 1}};
  EXPECT_EQ(words("support_path", "single", path),
            "10.0 mm at held point 1 (top left corner) by the end, 12.0 mm at most");

  path["until"] = 4.8;  // the recording ends at the first knot
  EXPECT_EQ(words("support_path", "single", path),
            "6.00 mm at held point 1 (top left corner) by the end, 6.00 mm at most");
}

TEST(EffectWords, TellWhenAHeldPointMoved) {
  EXPECT_EQ(words("support_move", "single",
                  {{"by_z", -0.008}, {"from", 0.2}, {"lasts", 0.6}, {"point", 1}}),
            "8.00 mm at held point 1 (top left corner) between 0.200 and 0.800 s, towards "
            "(0.00, 0.00, -1.00)");
}

TEST(EffectWords, SayNothingOfWeightsWhereThereIsNoGravity) {
  FittedEffect drag = fitted("wind", "drag", {{"c", 0.5}});
  drag.gravity_m_per_s2.setZero();
  EXPECT_EQ(words("wind", drag), "");
}

}  // namespace
}  // namespace clothfit
