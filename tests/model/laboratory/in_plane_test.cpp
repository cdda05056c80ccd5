// Checks strip tension and picture frame against the continuum.

#include "model/laboratory/in_plane.h"

#include <gtest/gtest.h>

#include "data/input_error.h"
#include "tests/model/measured_cloth.h"

namespace clothfit {
namespace {

TEST(StripTension, LiesBetweenTheFreeStripAndTheOneOfKeptWidth) {
  StripTensionOptions options;
  options.points = 1;
  options.largest_strain = 1e-3;
  options.spacing_m = 0.01;

  const LoadCurve warp = stretch_strip(kMeasuredCloth, ThreadDirection::warp, options);
  const LoadCurve weft = stretch_strip(kMeasuredCloth, ThreadDirection::weft, options);

  ASSERT_TRUE(warp.usable() && weft.usable());
  const double drop = 40.0 * 40 / (500 * 400);
  EXPECT_GT(warp.stiffness_n_per_m, 500 * (1 - drop));
  EXPECT_LT(warp.stiffness_n_per_m, 500 * (1 - 0.8 * drop)) << "the strip is long";
  EXPECT_GT(weft.stiffness_n_per_m, 400 * (1 - drop));
  EXPECT_LT(weft.stiffness_n_per_m, 400 * (1 - 0.8 * drop));
  EXPECT_NEAR(warp.lateral_contraction, 40.0 / 400, 0.005);
  EXPECT_NEAR(weft.lateral_contraction, 40.0 / 500, 0.005);
}

TEST(PictureFrame, ResistsByTheMeasuredShear) {
  PictureFrameOptions options;
  options.points = 2;
  options.largest_angle_deg = 2;
  options.spacing_m = 0.02;

  const LoadCurve curve = shear_frame(kMeasuredCloth, options);

  ASSERT_TRUE(curve.usable());
  EXPECT_NEAR(curve.stiffness_n_per_m / kMeasuredCloth.shear_n_per_m, 1, 1e-3);
  EXPECT_NEAR(curve.force_n_per_m[2] / curve.force_n_per_m[1], 2, 1e-2);
}

TEST(InPlaneTests, RefuseOptionsOfNoTest) {
  StripTensionOptions strip;
  strip.largest_strain = -0.1;
  EXPECT_THROW(stretch_strip(kMeasuredCloth, ThreadDirection::warp, strip), InputError);
  PictureFrameOptions frame;
  frame.spacing_m = 0.19;
  EXPECT_THROW(shear_frame(kMeasuredCloth, frame), InputError);
  MeasuredFabric odd = kMeasuredCloth;
  odd.shear_n_per_m = 450;
  EXPECT_THROW(shear_frame(odd), InputError) << "softer along the weft than in shear";
}

}  // namespace
}  // namespace clothfit
