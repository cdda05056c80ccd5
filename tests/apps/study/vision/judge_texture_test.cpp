// Checks the tracker of textures on rendered pictures of a recording's motion, and the spline that
// the motion is drawn with.

#include "apps/study/vision/judge_texture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>

namespace clothfit {
namespace {

TEST(JudgeTexture, SplineReproducesACubicBetweenAndBeyondItsNodes) {
  const std::vector<double> nodes = {0.1, 0.3, 0.35, 0.6, 0.9}, places = {0, 0.2, 0.35, 0.7, 1};
  const auto cubic = [](double x) { return 1 - 2 * x + 3 * x * x - 4 * x * x * x; };
  Eigen::VectorXd values(5);
  for (int i = 0; i < 5; ++i) values[i] = cubic(nodes[static_cast<size_t>(i)]);
  const Eigen::VectorXd found = cubic_spline_weights(nodes, places) * values;
  for (int i = 0; i < 5; ++i) EXPECT_NEAR(found[i], cubic(places[static_cast<size_t>(i)]), 1e-12);
}

/// The first frames, with bounds below the targets. `clothfit study vision` draws the whole
/// recording.
TEST(JudgeTexture, ATexturedSheetIsTrackedWithinTheTargets) {
  const char* data = std::getenv("CLOTHFIT_DATA");
  const std::filesystem::path folder =
      std::filesystem::path(data ? data : "") / "recordings/tags_onecam";
  if (!data || !std::filesystem::exists(folder))
    GTEST_SKIP() << "CLOTHFIT_DATA names no folder with recordings/tags_onecam";
  const std::uint64_t seed = 7;
  SCOPED_TRACE(seed);
  TexturedFootageOptions options{.texture = {.seed = seed}, .frames = 8, .instants = 1};
  const TexturedFootage footage = render_textured(folder, options);
  const TagScore score = score_texture(footage);
  EXPECT_EQ(score.visible, 7 * 256);
  EXPECT_GE(score.found_share(), 0.99);
  EXPECT_LE(score.error_quantile_px(0.5), 0.08);
  EXPECT_LE(score.error_quantile_px(0.95), 0.25);
  EXPECT_EQ(score.hidden_reported, 0);
  // Cloth that hardly moves shows noise on the same pixels again and again.
  EXPECT_NEAR(score.error_over_sigma_rms(), 1, 0.4);
}

}  // namespace
}  // namespace clothfit
