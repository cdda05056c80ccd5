// Checks that patterns are sewn around bodies and come to rest where closed forms say.

#include "model/garment/drape_garment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "data/input_error.h"
#include "model/garment/surface_nets.h"
#include "tests/model/garment/patterns.h"
#include "tests/model/measured_cloth.h"

namespace clothfit {
namespace {

/// A bar along the x axis, round at its ends.
TriangleMesh bar(double radius_m, double cell_m) {
  const double half_m = 0.15;
  return zero_surface(
      [=](const Eigen::Vector3d& x) {
        const double along = std::clamp(x.x(), -half_m, half_m);
        return (x - Eigen::Vector3d(along, 0, 0)).norm() - radius_m;
      },
      {-0.25, -0.1, -0.1}, {0.25, 0.1, 0.1}, cell_m);
}

/// A tube of two panels, before and behind a bar along the x axis.
Pattern sleeve(double width_m) {
  Pattern pattern = tube(width_m, 0.1, 0.08);
  for (Panel& panel : pattern.panels) {
    panel.placement.pretranslate(Eigen::Vector3d(0, 0, -0.05));
    panel.placement.prerotate(Eigen::AngleAxisd(0.5 * std::numbers::pi, Eigen::Vector3d::UnitY()));
  }
  return pattern;
}

GarmentOptions quick() {
  GarmentOptions options;
  options.spacing_m = 0.01;
  options.coarsest_m = 0.02;
  options.tolerance = 1e-4;
  return options;
}

TEST(DrapeGarment, LetsATightSleeveKeepTheDistanceOfItsTension) {
  const double radius_m = 0.05, width_m = 0.155;
  const Obstacle body(bar(radius_m, 0.004));
  const GarmentOptions options = quick();
  const GarmentDrape drape = drape_garment(sleeve(width_m), {kMeasuredCloth}, &body, options);
  ASSERT_EQ(drape.state, GarmentState::at_rest);
  EXPECT_EQ(drape.inside, 0);
  EXPECT_LT(drape.widest_gap_m, 5e-4);

  // A ring of n chords: E e dl/dr = p per area, with the stiffness of a strip that may contract.
  const int chords = 2 * static_cast<int>(std::ceil(width_m / options.spacing_m));
  const double length_by_radius = 2 * chords * std::sin(std::numbers::pi / chords);
  const double stiffness_n_per_m = kMeasuredCloth.tension_weft_n_per_m -
                                   kMeasuredCloth.shear_n_per_m * kMeasuredCloth.shear_n_per_m /
                                       kMeasuredCloth.tension_warp_n_per_m;
  const auto pull_pa = [&](double r_m) {
    const double strain = length_by_radius * r_m / (2 * width_m) - 1;
    return stiffness_n_per_m * strain * length_by_radius / (2 * width_m);
  };
  // Half of the area is pressed on at the vertices, half in the chords' middles.
  const auto pressure_pa = [&](double r_m) {
    const double u = 12 * (1 - (r_m - radius_m) / options.hold_off_m);
    return std::exp(u) - 1 - u;
  };
  const double nearer = std::cos(std::numbers::pi / chords);
  const auto push_pa = [&](double r_m) {
    return 0.5 * (pressure_pa(r_m) + nearer * pressure_pa(nearer * r_m));
  };
  double low = radius_m, high = radius_m + options.hold_off_m;
  for (int n = 0; n < 60; ++n)
    (push_pa(0.5 * (low + high)) > pull_pa(0.5 * (low + high)) ? low : high) = 0.5 * (low + high);

  double sum_m = 0;
  const auto vertices = drape.position_m.cols();
  for (Eigen::Index v = 0; v < vertices; ++v)
    sum_m += drape.position_m.col(v).tail<2>().norm() / static_cast<double>(vertices);
  // The bar's flat triangles lie up to 0.04 mm below the cylinder.
  EXPECT_NEAR(sum_m, low, 1e-4);
  EXPECT_NEAR(low - radius_m, 1.6e-3, 2e-4) << "the case presses with some hundred pascals";
}

TEST(DrapeGarment, EndsTheSameOnEveryMeshThatItCameFrom) {
  const Obstacle body(bar(0.05, 0.004));
  GarmentOptions alone = quick();
  alone.coarsest_m = alone.spacing_m;
  const GarmentDrape by_levels = drape_garment(sleeve(0.155), {kMeasuredCloth}, &body, quick()),
                     at_once = drape_garment(sleeve(0.155), {kMeasuredCloth}, &body, alone);
  ASSERT_EQ(by_levels.levels.size(), 2U);
  ASSERT_EQ(at_once.levels.size(), 1U);
  // The tube may turn around the bar and slide along it; its energy says that it is the same. It
  // settles onto flat triangles, which differ.
  EXPECT_NEAR(by_levels.levels[1].work.energy_j / at_once.levels[0].work.energy_j, 1, 2e-3);
}

TEST(DrapeGarment, RefusesABodyWithoutAnInsideAndAStartWithin) {
  const auto problem = [](const Pattern& pattern, const TriangleMesh& body) -> std::string {
    const Obstacle obstacle(body);
    try {
      drape_garment(pattern, {kMeasuredCloth}, &obstacle, quick());
    } catch (const InputError& error) {
      return error.problem();
    }
    return "accepted";
  };
  const TriangleMesh good = bar(0.05, 0.01);
  TriangleMesh open = good, inside_out = good;
  open.triangle = good.triangle.leftCols(good.triangle.cols() - 1).eval();
  EXPECT_EQ(problem(sleeve(0.2), open),
            "3 of its edges do not lie between two triangles that face the same way");
  inside_out.triangle.row(0).swap(inside_out.triangle.row(1));
  EXPECT_NE(problem(sleeve(0.2), inside_out).find("its volume is -0.00"), std::string::npos);
  Pattern within = sleeve(0.2);
  within.panels[1].placement.pretranslate(Eigen::Vector3d(0, -0.06, 0));
  EXPECT_NE(problem(within, good).find("begins inside the body, 30 mm deep"), std::string::npos)
      << problem(within, good);
  GarmentOptions fine = quick();
  fine.hold_off_m = 1e-4;
  const Obstacle long_bar(zero_surface(
      [](const Eigen::Vector3d& x) {
        return (x - Eigen::Vector3d(std::clamp(x.x(), -0.3, 0.3), 0, 0)).norm() - 0.05;
      },
      {-0.4, -0.1, -0.1}, {0.4, 0.1, 0.1}, 0.01));
  EXPECT_THROW(drape_garment(sleeve(0.2), {kMeasuredCloth}, &long_bar, fine), InputError);
  const TriangleMesh thick =
      zero_surface([](const Eigen::Vector3d& x) { return x.norm() - 1.5; },
                   Eigen::Vector3d::Constant(-2), Eigen::Vector3d::Constant(2), 0.2);
  EXPECT_NE(problem(sleeve(0.2), thick).find("begins inside the body, 1"), std::string::npos)
      << problem(sleeve(0.2), thick);
}

TEST(DrapeGarment, SaysThatASleeveIsTooTight) {
  // A tube of 16 cm girth around a bar of 31 cm.
  const Obstacle body(bar(0.05, 0.01));
  const GarmentDrape drape = drape_garment(sleeve(0.08), {kMeasuredCloth}, &body, quick());
  EXPECT_EQ(drape.state, GarmentState::too_tight);
  EXPECT_GT(drape.stretched_share, kMostStretched);
  EXPECT_FALSE(drape.usable());
}

TEST(DrapeGarment, NamesTheSeamThatStaysOpen) {
  // A cloth a hundred times as stiff cannot stretch around the bar: threads of 2 kN/m do not close
  // it.
  MeasuredFabric stiff = kMeasuredCloth;
  for (double* stiffness : {&stiff.tension_warp_n_per_m, &stiff.tension_weft_n_per_m})
    *stiffness *= 100;
  // Balls at the bar's ends keep the sleeve from sliding off.
  const Obstacle body(zero_surface(
      [](const Eigen::Vector3d& x) {
        const double along = std::clamp(x.x(), -0.15, 0.15);
        const double bar_m = (x - Eigen::Vector3d(along, 0, 0)).norm() - 0.05,
                     ball_m = (x - Eigen::Vector3d(std::copysign(0.16, x.x()), 0, 0)).norm() - 0.1;
        return std::min(bar_m, ball_m);
      },
      {-0.3, -0.15, -0.15}, {0.3, 0.15, 0.15}, 0.01));
  const GarmentDrape drape = drape_garment(sleeve(0.08), {stiff}, &body, quick());
  EXPECT_EQ(drape.state, GarmentState::not_sewn);
  EXPECT_GT(drape.widest_gap_m, 1e-3);
  EXPECT_GE(drape.widest_seam, 0);
  EXPECT_FALSE(drape.usable());
}

TEST(DrapeGarment, StopsWhereItIsAskedTo) {
  const Obstacle body(bar(0.05, 0.01));
  GarmentOptions options = quick();
  int calls = 0;
  options.go_on = [&](const GarmentProgress& progress) {
    EXPECT_TRUE(progress.sewing);
    EXPECT_GT(progress.particles, 0);
    return ++calls < 3;
  };
  EXPECT_EQ(drape_garment(sleeve(0.155), {kMeasuredCloth}, &body, options).state,
            GarmentState::cancelled);
  EXPECT_EQ(calls, 3);

  options.hold_off_m = 1;
  EXPECT_THROW(drape_garment(sleeve(0.155), {kMeasuredCloth}, &body, options), InputError);
}

}  // namespace
}  // namespace clothfit
