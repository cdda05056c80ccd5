// Checks that the checker of effects' derivatives catches a wrong one. Not checked here: the
// effects' own derivatives (effect_contract.h asks that of each).

#include "tests/model/effect_derivatives.h"

#include <gtest/gtest.h>

#include "model/effects/number.h"

namespace clothfit {
namespace {

/// Pulls every vertex to the origin by a spring that creeps, m'' = ... - k (x - y) with y
/// remembered along x. Its derivatives are wrong by chosen factors.
class CreepingAnchor final : public Effect {
 public:
  double position_factor = 1, memory_factor = 1, parameter_factor = 1, force_factor = 1;

  using Effect::add_force;
  using Effect::change_force;
  int memory_size(const Cloth& cloth) const override { return cloth.mesh.vertex_count(); }
  bool changes_force() const override { return true; }

  void add_force(const EffectScene<SingleLane>& scene, const EffectValues<SingleLane>& p,
                 EffectMemory<SingleLane>& memory,
                 LaneVectors<SingleLane>& force_n) const override {
    for (int k = 0; k < scene.cloth.mesh.vertex_count(); ++k) {
      const double x = scene.position_m.x(0, k), v = scene.velocity_m_per_s.x(0, k);
      force_n.x(0, k) -= p[0][0] * (x - memory(0, k)) * (x - memory(0, k));
      memory(0, k) += 0.1 * (x - memory(0, k)) + 0.01 * v;
    }
  }
  void change_force(const EffectScene<SingleLane>& scene, const EffectValues<SingleLane>& p,
                    LaneVectors<SingleLane>& force_n) const override {
    for (int k = 0; k < scene.cloth.mesh.vertex_count(); ++k) force_n.y(0, k) *= 1 + p[0][0];
  }
  void linearise_force(const EffectScene<SingleLane>& scene, const EffectValues<SingleLane>& p,
                       const EffectMemory<SingleLane>& memory,
                       EffectLinearisation& d) const override {
    for (int k = 0; k < scene.cloth.mesh.vertex_count(); ++k) {
      const double reach = scene.position_m.x(0, k) - memory(0, k);
      Eigen::Matrix3d by_position = Eigen::Matrix3d::Zero();
      by_position(0, 0) = position_factor * -2 * p[0][0] * reach;
      d.by_motion.push_back({k, k, by_position, Eigen::Matrix3d::Zero()});
      d.by_memory.push_back({k, k, Eigen::Vector3d(2 * p[0][0] * reach, 0, 0)});
      d.by_parameter.push_back(
          {k, ParameterNumber::own(0), Eigen::Vector3d(-parameter_factor * reach * reach, 0, 0)});
      d.memory_by_motion.push_back({k, k, {0.1, 0, 0}, {0.01, 0, 0}});
      d.memory_by_memory.push_back({k, k, 0.9 * memory_factor});
    }
  }
  void linearise_change(const EffectScene<SingleLane>& scene, const EffectValues<SingleLane>& p,
                        const LaneVectors<SingleLane>& force_n,
                        EffectLinearisation& d) const override {
    for (int k = 0; k < scene.cloth.mesh.vertex_count(); ++k) {
      d.by_force.push_back({k, Eigen::Vector3d(1, force_factor * (1 + p[0][0]), 1).asDiagonal()});
      d.by_parameter.push_back({k, ParameterNumber::own(0), {0, force_n.y(0, k), 0}});
    }
  }
  EffectRates rates(const Cloth&, const SpringParameters&,
                    const std::vector<double>&) const override {
    return {};
  }
};

std::string mismatch(const CreepingAnchor& effect) {
  Uniform uniform(1);
  return derivative_mismatch(effect, {.parameters = {{.typical = 1}}}, {3.0}, uniform);
}

TEST(EffectDerivatives, PassWhereTheyAreRight) {
  EXPECT_EQ(mismatch({}), "");
}

TEST(EffectDerivatives, ACheckCatchesAWrongOneOfEveryKind) {
  constexpr double kWrong = 1.0001;
  for (const auto factor : {&CreepingAnchor::position_factor, &CreepingAnchor::memory_factor,
                            &CreepingAnchor::parameter_factor, &CreepingAnchor::force_factor}) {
    CreepingAnchor effect;
    effect.*factor = kWrong;

    EXPECT_NE(mismatch(effect), "");
  }
}

}  // namespace
}  // namespace clothfit
