// Checks cells, gaps and marks of heat maps. Their look is for a person to judge.
#include "apps/report/page/heat_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <regex>

#include "apps/report/page/colour_map.h"

namespace clothfit {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(HeatMap, ColoursByTheLogarithmAndLeavesOutWhatHasNone) {
  HeatMap map{.title = "cost", .x = {1, 10, 100}, .y = {0, 1}, .value = Eigen::MatrixXd(3, 2)};
  map.value << 0, INFINITY,  //
      1e-4, 1e-2,            //
      1, 1;
  map.marks = {{.x = 10, .y = 1, .filled = true, .label = "lowest"}};

  const std::string svg = heat_maps({.value_label = "m²", .log_x = true, .maps = {map}});

  const std::regex cell(
      "<rect x=\"[0-9.]+\" y=\"[0-9.]+\" width=\"[0-9.]+\" height=\"[0-9.]+\" "
      "fill=\"(#[0-9a-f]+)\"");
  const std::string cells =
      svg.substr(svg.find("<g shape"), svg.find("</g>") - svg.find("<g shape"));
  std::vector<std::string> colours;
  for (std::sregex_iterator it(cells.begin(), cells.end(), cell), end; it != end; ++it)
    colours.push_back((*it)[1]);
  EXPECT_THAT(colours, ::testing::ElementsAre(viridis(0), viridis(0.5), viridis(1), viridis(1)));
  EXPECT_THAT(svg, HasSubstr("<title>lowest</title>"));
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  EXPECT_THAT(svg, Not(HasSubstr("inf")));
}

}  // namespace
}  // namespace clothfit
