// Checks projection and hiding of wireframes. Their look is for a person to judge.
#include "apps/report/page/wireframe.h"

#include <gtest/gtest.h>

#include <regex>
#include <vector>

namespace clothfit {
namespace {

/// Returns corners of all faces in the order drawn, in pixels.
std::vector<Eigen::Vector2d> drawn_corners(const std::string& svg) {
  const std::regex corner("[ML]([0-9.-]+) ([0-9.-]+)");
  const std::string faces = svg.substr(svg.find("<g "));
  std::vector<Eigen::Vector2d> corners;
  for (std::sregex_iterator it(faces.begin(), faces.end(), corner), end; it != end; ++it)
    corners.emplace_back(std::stod((*it)[1]), std::stod((*it)[2]));
  return corners;
}

TEST(Wireframe, DrawsNearFacesLastAndUpwardsUp) {
  // The vertices are three along y, two along x. The face at y < 0 is nearer to a viewer at -y.
  Wireframe cloth{.columns = 2, .rows = 3, .position_m = Eigen::Matrix3Xd(3, 6)};
  cloth.position_m << 0, 1, 0, 1, 0, 1,  //
      1, 1, 0, 0, -1, -1,                //
      0, 0, 0, 0, 1, 1;
  const std::string svg = wireframes(
      {.columns = 1, .viewpoint = {.azimuth_rad = 0, .elevation_rad = 0}, .cloths = {cloth}});

  const std::vector<Eigen::Vector2d> corners = drawn_corners(svg);

  ASSERT_EQ(corners.size(), 8u);
  // The far face lies level and is seen from its edge; the near one rises to z = 1.
  for (size_t n = 0; n < 4; ++n) EXPECT_EQ(corners[n].y(), corners[0].y());
  EXPECT_LT(corners[6].y(), corners[0].y());  // up the page
  EXPECT_LT(corners[0].x(), corners[1].x());  // x to the right
  // Both directions have one scale: the rise is as long as the cloth is wide.
  EXPECT_NEAR(corners[0].y() - corners[6].y(), corners[1].x() - corners[0].x(), 0.11);
}

}  // namespace
}  // namespace clothfit
