// Checks pictures of surfaces: the sides' colours, the background, shadows, the same bytes again.
// How they look is for a person to judge.

#include "vision/render/render_surfaces.h"

#include <gtest/gtest.h>

#include <numbers>

namespace clothfit {
namespace {

/// A square of a metre that faces -y, at a distance along y.
ColouredSurface square(double half_m, double y_m) {
  ColouredSurface surface;
  surface.vertex_m.resize(3, 4);
  surface.vertex_m << -half_m, half_m, half_m, -half_m, y_m, y_m, y_m, y_m, -half_m, -half_m,
      half_m, half_m;
  surface.triangle.resize(3, 2);
  surface.triangle << 0, 0, 1, 2, 2, 3;
  surface.front = {0.8, 0.1, 0.1};
  surface.back = {0.1, 0.1, 0.8};
  return surface;
}

constexpr SurfaceView kFront{.azimuth_rad = 0, .elevation_rad = 0, .width_px = 60, .height_px = 60};

TEST(RenderSurfaces, ShowsTheSideThatIsSeenOnWhite) {
  const cv::Mat front = render_surfaces({square(0.5, 0)}, kFront);
  SurfaceView behind = kFront;
  behind.azimuth_rad = std::numbers::pi;
  const cv::Mat back = render_surfaces({square(0.5, 0)}, behind);
  const auto of_front = front.at<cv::Vec3b>(30, 30), of_back = back.at<cv::Vec3b>(30, 30);
  EXPECT_GT(of_front[2], 2 * of_front[0]);
  EXPECT_GT(of_back[0], 2 * of_back[2]);
  EXPECT_EQ(front.at<cv::Vec3b>(0, 0), cv::Vec3b(255, 255, 255));
}

TEST(RenderSurfaces, ThrowsShadows) {
  // The lamp stands above and to the left of the viewer: the shadow of the small square falls to
  // the right and down.
  const cv::Mat alone = render_surfaces({square(0.5, 0)}, kFront),
                shaded = render_surfaces({square(0.5, 0), square(0.1, -0.2)}, kFront);
  int darker = 0, right_below = 0;
  for (int v = 0; v < 60; ++v)
    for (int u = 0; u < 60; ++u) {
      if (shaded.at<cv::Vec3b>(v, u)[2] + 30 > alone.at<cv::Vec3b>(v, u)[2]) continue;
      ++darker;
      right_below += u > 30 && v > 30;
    }
  EXPECT_GT(darker, 40);
  EXPECT_GT(right_below, darker / 2);
}

TEST(RenderSurfaces, GivesTheSameBytesAgain) {
  const std::vector<ColouredSurface> surfaces{square(0.5, 0), square(0.1, -0.2)};
  const cv::Mat one = render_surfaces(surfaces, kFront), other = render_surfaces(surfaces, kFront);
  EXPECT_TRUE(std::equal(one.datastart, one.dataend, other.datastart, other.dataend));
}

}  // namespace
}  // namespace clothfit
