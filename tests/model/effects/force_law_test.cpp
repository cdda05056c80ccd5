// Checks an empirical force per mass.

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "model/effects/registry.h"
#include "tests/model/cloth_with_effect.h"

namespace clothfit {
namespace {

std::vector<double> coefficients(const std::map<std::string, double>& named) {
  std::vector<double> values;
  for (const EffectParameter& parameter : find_effect("force_law", "").describe().parameters) {
    const auto found = named.find(parameter.name);
    values.push_back(found != named.end() ? found->second : 0);
  }
  return values;
}

/// Returns the force of some terms on a moving, crumpled cloth, 3 x vertices (N).
class CrumpledCloth {
 public:
  explicit CrumpledCloth(unsigned seed) {
    Uniform uniform(seed);
    position_m = crumpled(bare.mesh, 0.5, uniform);
    velocity_m_per_s = uniform.vectors(36, 2);
  }
  Eigen::Matrix3Xd force_n(const std::string& effect, const std::vector<double>& values) const {
    return ClothWithEffect(bare, effect, values, position_m).force_n(position_m, velocity_m_per_s);
  }
  Eigen::Matrix3Xd force_n(const std::map<std::string, double>& named) const {
    return force_n("force_law", coefficients(named));
  }

  Cloth bare = square_cloth(6);
  Eigen::Matrix3Xd position_m, velocity_m_per_s;
};

TEST(ForceLaw, KeepsTheContractOfEffects) {
  expect_effect_contract("force_law", {});
}

TEST(ForceLaw, IsTheSumOfItsTerms) {
  Uniform uniform(1);
  const CrumpledCloth cloth(1);
  const EffectDescription effect = find_effect("force_law", "").describe();
  const std::vector<double> all = effect_contract::random_parameters(effect, uniform);

  Eigen::Matrix3Xd sum = Eigen::Matrix3Xd::Zero(3, 36);
  for (size_t k = 0; k < all.size(); ++k) {
    std::vector<double> one(all.size(), 0);
    one[k] = all[k];
    const Eigen::Matrix3Xd force = cloth.force_n("force_law", one);
    EXPECT_GT(force.norm(), 0) << effect.parameters[k].name;
    sum += force;
  }

  EXPECT_LT((cloth.force_n("force_law", all) - sum).norm(), 1e-14 * sum.norm());
}

TEST(ForceLaw, OfVelocityIsViscousDamping) {
  const CrumpledCloth cloth(2);

  const Eigen::Matrix3Xd force = cloth.force_n({{"drag", 0.7}});

  const Eigen::Matrix3Xd expected = cloth.force_n("viscous_damping", {0.7});
  EXPECT_LT((force - expected).norm(), 1e-14 * expected.norm());
}

TEST(ForceLaw, AlongTheNormalIsTheForceOfWindAndDrag) {
  const CrumpledCloth cloth(3);
  const Eigen::Vector3d q(0.03, -0.02, 0.05);  // Pa

  const Eigen::Matrix3Xd force = cloth.force_n(
      {{"normal_drag", 0.07}, {"pressure_x", q.x()}, {"pressure_y", q.y()}, {"pressure_z", q.z()}});
  const Eigen::Matrix3Xd squared = cloth.force_n({{"normal_drag_squared", 0.6}});

  const Eigen::Matrix3Xd wind = cloth.force_n("wind", {0.07, q.x(), q.y(), q.z()});
  const Eigen::Matrix3Xd drag = cloth.force_n("quadratic_drag", {1.2, 0});
  EXPECT_LT((force - wind).norm(), 1e-14 * wind.norm());
  EXPECT_LT((squared - drag).norm(), 1e-14 * drag.norm());
}

TEST(ForceLaw, OfTheSquaredVelocityInTheSurfaceIsQuadraticDragOnAFlatSheet) {
  // A / m is 1 / areal density where the sheet is not stretched: c = c_t / (2 sigma).
  CrumpledCloth cloth(4);
  Uniform uniform(4);
  cloth.position_m = uniform.rotation() * flat_positions(cloth.bare.mesh);
  const double c_t = 0.4;

  const Eigen::Matrix3Xd force =
      cloth.force_n({{"tangential_drag_squared", c_t / (2 * kSquareClothDensity_kg_per_m2)}});

  const Eigen::Matrix3Xd expected = cloth.force_n("quadratic_drag", {0, c_t});
  EXPECT_LT((force - expected).norm(), 1e-13 * expected.norm());
}

TEST(ForceLaw, PushesAlongTheAxesEveryVertexAlike) {
  const CrumpledCloth cloth(5);

  const Eigen::Matrix3Xd force =
      cloth.force_n({{"push_x", 0.3}, {"push_y", -0.2}, {"push_z", 0.1}});

  for (Eigen::Index k = 0; k < force.cols(); ++k)
    EXPECT_LT((force.col(k) - cloth.bare.mass_kg[k] * Eigen::Vector3d(0.3, -0.2, 0.1)).norm(),
              1e-16);
}

TEST(ForceLaw, OverTheClothAndWithTheHeightRunsInStraightLines) {
  CrumpledCloth cloth(6);
  const Mesh& mesh = cloth.bare.mesh;
  // The cloth is upright: t runs down, so that the height is -t.
  cloth.position_m = upright() * flat_positions(mesh);
  const double height_at_top = cloth.position_m(2, 0);
  const double height_at_bottom = cloth.position_m(2, mesh.vertex(mesh.rows - 1, 0));

  const Eigen::Matrix3Xd by_t = cloth.force_n({{"drag_by_t", 0.5}});
  const Eigen::Matrix3Xd by_s = cloth.force_n({{"normal_push_by_s", 0.5}});
  const Eigen::Matrix3Xd by_height = cloth.force_n({{"push_by_height_x", 2.0}});

  for (int i = 0; i < mesh.rows; ++i) {
    for (int j = 0; j < mesh.columns; ++j) {
      const int k = mesh.vertex(i, j);
      const double s = static_cast<double>(j) / (mesh.columns - 1);
      const double t = static_cast<double>(i) / (mesh.rows - 1);
      const double mass = cloth.bare.mass_kg[k];
      EXPECT_LT((by_t.col(k) + mass * 0.5 * (2 * t - 1) * cloth.velocity_m_per_s.col(k)).norm(),
                1e-15);
      EXPECT_NEAR(by_s.col(k).norm(),
                  mass / kSquareClothDensity_kg_per_m2 * 0.5 * std::abs(2 * s - 1), 1e-15);
      EXPECT_NEAR(by_height(0, k), mass * 2 * ((1 - t) * height_at_top + t * height_at_bottom),
                  1e-15);
    }
  }
}

TEST(ForceLaw, NamesWhatEachCoefficientMultiplies) {
  const std::vector<EffectParameter> parameters =
      find_effect("force_law", "").describe().parameters;
  const auto squared = std::ranges::find(parameters, "drag_squared", &EffectParameter::name);
  ASSERT_NE(squared, parameters.end());
  EXPECT_EQ(squared->law_side + " = " + squared->law_factor, "a = -|v| v");
  for (const EffectParameter& parameter : parameters) {
    EXPECT_FALSE(parameter.law_side.empty()) << parameter.name;
    EXPECT_FALSE(parameter.law_factor.empty()) << parameter.name;
  }
}

TEST(ForceLaw, AsksForEachCoefficientOnceAVectorAsOne) {
  const EffectDescription effect = find_effect("force_law", "").describe();
  std::vector<std::string> asked;
  for (const EffectMode& mode : effect.modes)
    asked.insert(asked.end(), mode.amplitudes.begin(), mode.amplitudes.end());

  std::vector<std::string> names;
  for (const EffectParameter& parameter : effect.parameters) names.push_back(parameter.name);
  EXPECT_EQ(asked, names);
  EXPECT_EQ(std::ranges::count_if(
                effect.modes, [](const EffectMode& mode) { return mode.amplitudes.size() == 3; }),
            4);
}

}  // namespace
}  // namespace clothfit
