// Checks a wind that differs from place to place and from time to time. Not checked here: drag,
// which wind has, and which of its modes are harmonics (tests/fit/diagnosis/catalogue_test.cpp).

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/effects/registry.h"
#include "tests/model/cloth_with_effect.h"

namespace clothfit {
namespace {

constexpr double kSheetSide_m = 0.4, kSheetArea_m2 = kSheetSide_m * kSheetSide_m;  // square_cloth's
constexpr double kForcesAt_s = 0.3;  // ClothWithEffect::force_n

struct WindField {
  double p = 0, p_s = 0, p_t = 0;
  Eigen::Vector3d slope = Eigen::Vector3d::Zero();
  double h = 0, h_s = 0, h_t = 0;
  Eigen::Vector3d q = Eigen::Vector3d::Zero();
  double frequency = 1, phase = 0;
  std::vector<double> values() const {
    return {p,   p_s, p_t,   slope.x(), slope.y(), slope.z(), h,
            h_s, h_t, q.x(), q.y(),     q.z(),     frequency, phase};
  }
};

/// A sheet anywhere in space, with the axes of its s and t and its normal s x t.
struct PressedSheet {
  Cloth bare;
  Eigen::Matrix3d axes;
  Eigen::Matrix3Xd position_m;

  PressedSheet(int vertices_per_side, const Eigen::Matrix3d& attitude,
               const Eigen::Vector3d& corner_m)
      : bare(square_cloth(vertices_per_side)),
        axes(attitude),
        position_m((attitude * flat_positions(bare.mesh)).colwise() + corner_m) {}
  Eigen::Matrix3Xd force_n(const WindField& wind) const {
    return ClothWithEffect(bare, "wind_field", wind.values(), position_m)
        .force_n(position_m, at_rest(position_m));
  }
  Eigen::Vector3d middle_m() const {
    return position_m.col(0) + axes * Eigen::Vector3d(kSheetSide_m / 2, kSheetSide_m / 2, 0);
  }
  /// Returns the pressure along the normal at every vertex (Pa), from its share of the area.
  Eigen::RowVectorXd pressure_pa(const WindField& wind) const {
    const Eigen::Matrix3Xd force = force_n(wind);
    const Eigen::RowVectorXd along_n = axes.col(2).transpose() * force;
    EXPECT_LT((force - axes.col(2) * along_n).norm(), 1e-15);
    return along_n.cwiseQuotient(masses_by_area(bare.mesh, kSheetArea_m2).transpose());
  }
};

TEST(WindField, KeepsTheContractOfEffects) {
  expect_effect_contract("wind_field", {});
}

TEST(WindField, IsTheSumOfItsParts) {
  Uniform uniform(1);
  const Cloth bare = square_cloth(6);
  const Eigen::Matrix3Xd x = crumpled(bare.mesh, 0.5, uniform);
  const EffectDescription effect = find_effect("wind_field", "test").describe();
  const std::vector<double> all = effect_contract::random_parameters(effect, uniform);
  const auto force_n = [&](const std::vector<double>& values) {
    return ClothWithEffect(bare, "wind_field", values, x).force_n(x, at_rest(x));
  };

  const size_t amplitudes = all.size() - 2;  // then frequency and phase
  Eigen::Matrix3Xd sum = Eigen::Matrix3Xd::Zero(3, x.cols());
  for (size_t k = 0; k < amplitudes; ++k) {
    std::vector<double> one = all;
    for (size_t other = 0; other < amplitudes; ++other)
      if (other != k) one[other] = 0;
    const Eigen::Matrix3Xd part = force_n(one);
    EXPECT_GT(part.norm(), 0) << effect.parameters[k].name;
    sum += part;
  }

  EXPECT_LT((force_n(all) - sum).norm(), 1e-14 * sum.norm());
}

TEST(WindField, PressesOnAFlatSheetByAPlaneOverTheCloth) {
  const WindField wind{.p = 0.3, .p_s = -0.2, .p_t = 0.5};
  for (const unsigned seed : {2u, 3u}) {
    SCOPED_TRACE(seed);
    Uniform uniform(seed);
    const Eigen::Matrix3d attitude = uniform.rotation();
    for (const int vertices : {2, 3, 9}) {
      SCOPED_TRACE(vertices);
      const PressedSheet sheet(vertices, attitude, uniform.vectors(1, 0.5));

      const Eigen::RowVectorXd pressure = sheet.pressure_pa(wind);

      for (int i = 0; i < vertices; ++i) {
        for (int j = 0; j < vertices; ++j) {
          const double across = 2.0 * j / (vertices - 1) - 1, down = 2.0 * i / (vertices - 1) - 1;
          EXPECT_NEAR(pressure[sheet.bare.mesh.vertex(i, j)], 0.3 - 0.2 * across + 0.5 * down,
                      1e-12);
        }
      }
    }
  }
}

// The moment about the middle is int r x P n dA with r = (a s + b t) side / 2, and so the area
// times side / 6 (p_t s - p_s t). The mean of a^2 is 1/3; trapezoids on N intervals give
// (1 + 2 / N^2) / 3.
TEST(WindField, PushesByItsMeanAndTurnsByItsSlopes) {
  Uniform uniform(4);
  const WindField wind{.p = 0.3, .p_s = -0.2, .p_t = 0.5};
  const Eigen::Matrix3d attitude = uniform.rotation();
  for (const int intervals : {1, 2, 8}) {
    SCOPED_TRACE(intervals);
    const PressedSheet sheet(intervals + 1, attitude, {0.1, -0.2, 0.3});

    const Eigen::Matrix3Xd force = sheet.force_n(wind);

    EXPECT_LT((force.rowwise().sum() - kSheetArea_m2 * 0.3 * attitude.col(2)).norm(), 1e-15);
    const Eigen::Vector3d moment = torque(sheet.position_m.colwise() - sheet.middle_m(), force);
    const Eigen::Vector3d expected = kSheetArea_m2 * kSheetSide_m / 6 *
                                     (1 + 2.0 / (intervals * intervals)) *
                                     (0.5 * attitude.col(0) + 0.2 * attitude.col(1));
    EXPECT_LT((moment - expected).norm(), 1e-15);
  }
}

TEST(WindField, HasAPlaneInTheWorldThatClothDoesNotTakeAlong) {
  Uniform uniform(5);
  const Eigen::Matrix3d attitude = uniform.rotation();
  const PressedSheet here(5, attitude, {0.1, -0.2, 0.3});
  const WindField over_cloth{.p = 0.3, .p_s = -0.2, .p_t = 0.5};
  // A slope of p_s over half a side along s, and so along t, about the sheet's middle.
  WindField in_world{.p = 0.3,
                     .slope = 2 / kSheetSide_m * (-0.2 * attitude.col(0) + 0.5 * attitude.col(1))};
  in_world.p -= in_world.slope.dot(here.middle_m());

  EXPECT_LT((here.pressure_pa(in_world) - here.pressure_pa(over_cloth)).norm(), 1e-12);

  // Elsewhere the one is higher by its slope, the other is the same.
  const Eigen::Vector3d moved_m = attitude * Eigen::Vector3d(0.05, 0.1, -0.2);
  const PressedSheet there(5, attitude, Eigen::Vector3d(0.1, -0.2, 0.3) + moved_m);
  const double higher_pa = in_world.slope.dot(moved_m);
  EXPECT_NEAR(higher_pa, 2 / kSheetSide_m * (-0.2 * 0.05 + 0.5 * 0.1), 1e-15);
  EXPECT_LT((there.pressure_pa(in_world).array() - higher_pa - here.pressure_pa(in_world).array())
                .matrix()
                .norm(),
            1e-12);
  EXPECT_LT((there.pressure_pa(over_cloth) - here.pressure_pa(over_cloth)).norm(), 1e-12);
}

TEST(WindField, ComesAndGoesOverTheClothWithItsHarmonic) {
  Uniform uniform(6);
  const PressedSheet sheet(4, uniform.rotation(), {0.1, -0.2, 0.3});
  const Eigen::RowVectorXd plane = sheet.pressure_pa({.p = 0.3, .p_s = -0.2, .p_t = 0.5});
  WindField wind{.h = 0.3, .h_s = -0.2, .h_t = 0.5, .frequency = 1.7};

  constexpr int kPhases = 8;
  Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(plane.size());
  for (int k = 0; k < kPhases; ++k) {
    wind.phase = static_cast<double>(k) / kPhases - 0.5;
    const Eigen::RowVectorXd pressure = sheet.pressure_pa(wind);
    const double wave = std::sin(2 * std::numbers::pi * (1.7 * kForcesAt_s + wind.phase));
    EXPECT_LT((pressure - wave * plane).norm(), 1e-12) << wind.phase;
    sum += pressure;
  }
  EXPECT_LT(sum.norm(), 1e-11);  // nothing is left over a turn
}

TEST(WindField, LeavesAFlatSheetNoVelocityAfterAWholePeriodOfItsHarmonic) {
  const double h = 0.4, phase = 0.1, time_step_s = 1e-3;
  Uniform uniform(7);
  const PressedSheet sheet(5, uniform.rotation(), {0, 0, 0});
  const WindField wind{.h = h, .frequency = 2.5, .phase = phase};
  ClothWithEffect free(sheet.bare, "wind_field", wind.values(), sheet.position_m);
  free.set.gravity_m_per_s2.setZero();

  double expected = 0, fastest = 0;
  const ClothWithEffect::State end =
      free.after(400, time_step_s, [&](int step, const ClothWithEffect::State& state) {
        // Every vertex has the same area per mass: V += dt h sin / sigma n.
        expected += time_step_s * h / kSquareClothDensity_kg_per_m2 *
                    std::sin(2 * std::numbers::pi * (2.5 * (step - 1) * time_step_s + phase));
        EXPECT_LT(
            (state.velocity_m_per_s.colwise() - expected * sheet.axes.col(2)).cwiseAbs().maxCoeff(),
            1e-12)
            << step;
        fastest = std::max(fastest, std::abs(expected));
      });

  EXPECT_GT(fastest, 0.1);
  EXPECT_LT(end.velocity_m_per_s.cwiseAbs().maxCoeff(), 1e-12);
}

/// A crumpled cloth at rest, for this effect and others.
struct CrumpledAtRest {
  Cloth bare = square_cloth(6);
  Eigen::Matrix3Xd position_m;

  explicit CrumpledAtRest(unsigned seed) {
    Uniform uniform(seed);
    position_m = crumpled(bare.mesh, 0.5, uniform);
  }
  Eigen::Matrix3Xd force_n(const std::string& effect, const std::vector<double>& values) const {
    return ClothWithEffect(bare, effect, values, position_m)
        .force_n(position_m, at_rest(position_m));
  }
};

TEST(WindField, PulsesAreHalfAWindAndHalfAGust) {
  const CrumpledAtRest cloth(8);
  const Eigen::Vector3d q(0.3, -0.2, 0.5), half = q / 2;

  const Eigen::Matrix3Xd force =
      cloth.force_n("wind_field", WindField{.q = q, .frequency = 1.7, .phase = 0.1}.values());

  const Eigen::Matrix3Xd expected = cloth.force_n("wind", {0, half.x(), half.y(), half.z()}) +
                                    cloth.force_n("gust", {half.x(), half.y(), half.z(), 1.7, 0.1});
  EXPECT_LT((force - expected).norm(), 1e-14 * expected.norm());
}

TEST(WindField, PulsesRunBetweenNothingAndTheirWind) {
  const CrumpledAtRest cloth(9);
  const Eigen::Vector3d q(0.3, -0.2, 0.5);
  const Eigen::Matrix3Xd wind = cloth.force_n("wind", {0, q.x(), q.y(), q.z()});
  // At 0.3 s a quarter turn and three quarters.
  const auto at_phase = [&](double phase) {
    return cloth.force_n("wind_field", WindField{.q = q, .phase = phase}.values());
  };

  EXPECT_LT((at_phase(0.25 - kForcesAt_s) - wind).norm(), 1e-12 * wind.norm());
  EXPECT_LT(at_phase(0.75 - kForcesAt_s).norm(), 1e-12 * wind.norm());
}

TEST(WindField, TurnsWithTheSceneWhenItsVectorsTurnToo) {
  Uniform uniform(10);
  const CrumpledAtRest cloth(10);
  const Eigen::Matrix3d turn = uniform.rotation();
  WindField wind{.p = 0.3,
                 .p_s = -0.2,
                 .p_t = 0.5,
                 .slope = {1, -2, 0.5},
                 .h = 0.1,
                 .h_s = 0.2,
                 .h_t = -0.3,
                 .q = {0.3, -0.2, 0.5},
                 .phase = 0.1};

  const Eigen::Matrix3Xd force = cloth.force_n("wind_field", wind.values());

  CrumpledAtRest turned = cloth;
  turned.position_m = turn * cloth.position_m;
  wind.slope = turn * wind.slope;
  wind.q = turn * wind.q;
  EXPECT_LT((turned.force_n("wind_field", wind.values()) - turn * force).norm(),
            1e-13 * force.norm());
}

TEST(WindField, IsNothingWhereTheSurfaceIsFoldedToNothing) {
  CrumpledAtRest cloth(11);
  cloth.position_m.setZero();

  EXPECT_EQ(cloth.force_n("wind_field", WindField{.p = 1, .h = 1, .q = {0.3, 0.2, 0.1}}.values())
                .cwiseAbs()
                .maxCoeff(),
            0);
}

}  // namespace
}  // namespace clothfit
