// Checks the colour scales of reports. Their use on both panels of maps: svg_test.cpp.
#include "apps/report/page/colour_map.h"

#include <gtest/gtest.h>

#include <cmath>

namespace clothfit {
namespace {

/// Returns CIE lightness L* of "#rrggbb": how light the eye finds it.
double lightness(const std::string& colour) {
  const auto linear = [&](size_t at) {
    const double c = std::stoi(colour.substr(at, 2), nullptr, 16) / 255.0;
    return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
  };
  const double y = 0.2126 * linear(1) + 0.7152 * linear(3) + 0.0722 * linear(5);
  return y > 0.008856 ? 116 * std::cbrt(y) - 16 : 903.3 * y;
}

TEST(Viridis, GetsLighterInEvenSteps) {
  // A perceptually uniform scale gains lightness at a constant rate. From about 15 to 91 in 20
  // steps is 3.8 each; 40 % is allowed for interpolation between samples in sRGB.
  for (int step = 0; step < 20; ++step) {
    const double gain = lightness(viridis((step + 1) / 20.0)) - lightness(viridis(step / 20.0));
    EXPECT_NEAR(gain, 3.8, 0.4 * 3.8) << "step " << step;
  }
}

TEST(Viridis, ClampsToItsEnds) {
  EXPECT_EQ(viridis(-1), "#440154");
  EXPECT_EQ(viridis(0), "#440154");
  EXPECT_EQ(viridis(1), "#fde725");
  EXPECT_EQ(viridis(2), "#fde725");
}

TEST(Diverging, StaysLightEnoughForDarkText) {
  for (const double value : {-1.0, -0.5, 0.0, 0.5, 1.0})
    EXPECT_GT(lightness(diverging(value)), 70) << value;
  EXPECT_EQ(diverging(0), "#ffffff");
}

}  // namespace
}  // namespace clothfit
