// Checks ticks, gaps and shared scales of the figures. The page around them: fit_page_test.cpp.
// Their look is for a person to judge.
#include "apps/report/page/svg.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <regex>

#include "apps/report/page/colour_map.h"

namespace clothfit {
namespace {

using ::testing::DoubleEq;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

std::ptrdiff_t count_of(const std::string& text, const std::string& pattern) {
  const std::regex regex(pattern);
  return std::distance(std::sregex_iterator(text.begin(), text.end(), regex), {});
}

TEST(NiceTicks, StandAtRoundNumbersInsideTheRange) {
  EXPECT_THAT(nice_ticks(0, 1, 5),
              ElementsAre(0, DoubleEq(0.2), DoubleEq(0.4), DoubleEq(0.6), DoubleEq(0.8), 1));
  EXPECT_THAT(nice_ticks(-3, 12, 3), ElementsAre(0, 5, 10));
  EXPECT_THAT(nice_ticks(0, 71, 8), ElementsAre(0, 10, 20, 30, 40, 50, 60, 70));
}

TEST(NiceTicks, AreOneForARangeWithoutWidth) {
  EXPECT_THAT(nice_ticks(2, 2, 5), ElementsAre(2));
}

TEST(LogTicks, AreDecadesWhereThereAreEnough) {
  EXPECT_THAT(log_ticks(0.05, 200),
              ElementsAre(DoubleEq(0.1), DoubleEq(1), DoubleEq(10), DoubleEq(100)));
  EXPECT_THAT(log_ticks(0.9, 12), ElementsAre(DoubleEq(1), DoubleEq(2), DoubleEq(5), DoubleEq(10)));
}

TEST(LinePlot, LeavesAGapWhereAValueIsMissing) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  LinePlot plot;
  plot.series = {{"model", {0, 1, 2, 3, 4}, {1, 2, nan, 2, 1}, {"#000", "", 2}}};

  const std::string svg = line_plot(plot);

  EXPECT_EQ(count_of(svg, "<polyline"), 2);
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
}

TEST(LinePlot, LeavesOutZerosOnALogAxis) {
  LinePlot plot;
  plot.log_y = true;
  plot.series = {{"cost", {0, 1, 2, 3}, {0, 10, 100, 1000}, {"#000", "", 2}}};

  const std::string svg = line_plot(plot);

  EXPECT_EQ(count_of(svg, "<polyline"), 1);
  EXPECT_THAT(svg, Not(HasSubstr("inf")));
}

TEST(LinePlot, DrawsAnEmptyFrameWithoutData) {
  LinePlot plot;
  plot.log_y = true;

  const std::string svg = line_plot(plot);

  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  EXPECT_THAT(svg, Not(HasSubstr("inf")));
}

TEST(ClothMaps, ShareOneColourScale) {
  ClothMaps maps;
  maps.width_m = maps.height_m = 0.4;
  maps.maps = {{"fitted", {{0.1, 0.1, 1.0, "a"}}}, {"held out", {{0.1, 0.1, 2.0, "b"}}}};

  const std::string svg = cloth_maps(maps);

  EXPECT_THAT(svg, HasSubstr("fill=\"" + viridis(0.5) + "\"><title>a</title>"));
  EXPECT_THAT(svg, HasSubstr("fill=\"" + viridis(1.0) + "\"><title>b</title>"));
}

TEST(ClothMaps, KeepTheClothsProportions) {
  ClothMaps maps;
  maps.width_m = 0.8;
  maps.height_m = 0.2;
  maps.maps = {{"fitted", {{0, 0, 1, "a"}}}};

  const std::string svg = cloth_maps(maps);

  std::smatch size;
  ASSERT_TRUE(std::regex_search(
      svg, size, std::regex("width=\"([0-9.]+)\" height=\"([0-9.]+)\" fill=\"none\"")));
  EXPECT_NEAR(std::stod(size[1]) / std::stod(size[2]), 4.0, 0.01);
}

TEST(PointOverlay, PlacesMarksOnTheirPixels) {
  PointOverlay overlay;
  overlay.left = overlay.top = -0.5;
  overlay.width = 800;  // one page unit per pixel
  overlay.height = 600;
  overlay.magnification = 10;
  overlay.points = {{99.5, 49.5, 100.5, 49.5, "m"}};

  const std::string svg = point_overlay(overlay);

  EXPECT_THAT(svg, HasSubstr("M100.0 50.0l10.0 0.0"));  // from the observed place, 10 times
  EXPECT_THAT(svg, HasSubstr("cx=\"100.0\" cy=\"50.0\""));
}

}  // namespace
}  // namespace clothfit
