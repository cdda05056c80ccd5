// Checks the cantilever test against the elastica of a heavy strip.

#include "model/laboratory/cantilever.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "data/input_error.h"
#include "tests/model/measured_cloth.h"

namespace clothfit {
namespace {

/// Returns the angle of the line from clamp to end of the heavy elastica B theta'' = -w (L - s) cos
/// theta, theta(0) = 0, theta'(L) = 0, by Runge and Kutta's method and bisection.
double angle_of_elastica(double length_m, double bending_length_m) {
  constexpr int kSteps = 1000;
  const double step = length_m / kSteps, cube = std::pow(bending_length_m, 3);
  double angle = 0;
  const auto curvature_at_end = [&](double curvature) {
    double theta = 0, x = 0, y = 0;
    const auto bend = [&](double s, double at) { return -(length_m - s) * std::cos(at) / cube; };
    for (int n = 0; n < kSteps; ++n) {
      const double s = n * step;
      const double k1 = bend(s, theta), t1 = curvature;
      const double k2 = bend(s + step / 2, theta + step / 2 * t1), t2 = curvature + step / 2 * k1;
      const double k3 = bend(s + step / 2, theta + step / 2 * t2), t3 = curvature + step / 2 * k2;
      const double k4 = bend(s + step, theta + step * t3), t4 = curvature + step * k3;
      const double middle = theta + step / 2 * t2,
                   next = theta + step / 6 * (t1 + 2 * t2 + 2 * t3 + t4);
      x += step / 6 * (std::cos(theta) + 4 * std::cos(middle) + std::cos(next));
      y += step / 6 * (std::sin(theta) + 4 * std::sin(middle) + std::sin(next));
      curvature += step / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
      theta = next;
    }
    angle = std::atan2(y, x);
    return curvature;
  };
  double low = 0, high = 10 * length_m * length_m / cube;
  for (int n = 0; n < 100; ++n)
    (curvature_at_end((low + high) / 2) > 0 ? high : low) = (low + high) / 2;
  return angle;
}

double overhang_of_elastica(double bending_length_m, double angle_deg) {
  double low = 0.5 * bending_length_m, high = 5 * bending_length_m;
  for (int n = 0; n < 40; ++n)
    (angle_of_elastica((low + high) / 2, bending_length_m) < angle_deg * std::numbers::pi / 180
         ? low
         : high) = (low + high) / 2;
  return low;
}

TEST(Cantilever, HasTheOverhangOfTheElasticaAlongBothThreads) {
  CantileverOptions options;
  options.cells = 24;
  options.width_m = 0.005;

  const CantileverResult warp = bend_cantilever(kMeasuredCloth, ThreadDirection::warp, options);
  const CantileverResult weft = bend_cantilever(kMeasuredCloth, ThreadDirection::weft, options);

  ASSERT_TRUE(warp.usable());
  ASSERT_TRUE(weft.usable());
  EXPECT_NEAR(warp.overhang_m / overhang_of_elastica(kMeasuredCloth.bending_length_warp_m(), 41.5),
              1, 0.002);
  EXPECT_NEAR(weft.overhang_m / overhang_of_elastica(kMeasuredCloth.bending_length_weft_m(), 41.5),
              1, 0.002);
  // The standard's rigidity is built on half the overhang; it returns what went in.
  EXPECT_NEAR(warp.bending_n_m / kMeasuredCloth.bending_warp_n_m, 1, 0.01);
}

TEST(Cantilever, ConvergesWithTheSquareOfTheSpacing) {
  const double exact = overhang_of_elastica(kMeasuredCloth.bending_length_warp_m(), 41.5);
  const auto error = [&](int cells) {
    CantileverOptions options;
    options.cells = cells;
    options.width_m = 0.005;
    return std::abs(
        bend_cantilever(kMeasuredCloth, ThreadDirection::warp, options).overhang_m / exact - 1);
  };

  EXPECT_NEAR(error(8) / error(16), 4, 0.6);
}

TEST(Cantilever, RefusesOptionsOfNoTest) {
  CantileverOptions options;
  options.angle_deg = 95;
  EXPECT_THROW(bend_cantilever(kMeasuredCloth, ThreadDirection::warp, options), InputError);
  MeasuredFabric stiff = kMeasuredCloth;
  stiff.bending_warp_n_m = 1;
  EXPECT_THROW(bend_cantilever(stiff, ThreadDirection::warp), InputError);
}

}  // namespace
}  // namespace clothfit
