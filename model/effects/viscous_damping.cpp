#include "model/effects/viscous_damping.h"

namespace clothfit::viscous_damping {
namespace {

class ViscousDamping final : public Effect {
 public:
  void add_force(const EffectScene& scene, const std::vector<LaneValue<>>& parameters,
                 LaneVectors<>& force_n) const override {
    const LaneValue<>& rate_per_s = parameters[0];
    const LaneVectors<>& v = scene.velocity_m_per_s;
    for (Eigen::Index k = 0; k < scene.mass_kg.size(); ++k) {
      const LaneValue<> c = rate_per_s * scene.mass_kg[k];
      force_n.x.col(k) -= c * v.x.col(k);
      force_n.y.col(k) -= c * v.y.col(k);
      force_n.z.col(k) -= c * v.z.col(k);
    }
  }

  double damping_rate_per_s(const Mesh&, const Eigen::VectorXd&,
                            const std::vector<double>& parameters) const override {
    return parameters[0];
  }
};

}  // namespace

EffectDescription describe() {
  return {.name = "viscous_damping",
          .summary = "drag of still air on every vertex, F = -rate m v",
          .parameters = {{.name = "rate",
                          .unit = "1/s",
                          .neutral = 0,
                          .lower = 0,
                          .upper = 30,
                          .typical = 0.1,
                          .scale = ParameterScale::linear}}};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<ViscousDamping>();
}

}  // namespace clothfit::viscous_damping
