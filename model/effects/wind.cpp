#include "model/effects/wind.h"

#include <algorithm>

namespace clothfit::wind {
namespace {

LaneVector<> difference(const LaneVectors<>& position, int to, int from) {
  return {position.x.col(to) - position.x.col(from), position.y.col(to) - position.y.col(from),
          position.z.col(to) - position.z.col(from)};
}

/// The vector area of the surface that belongs to vertex [i, j]: normal to it, as long as the area
/// is large. From differences to the neighbours on both sides, or the one there is at an edge; in a
/// flat cloth it is a cell's area inside, half of one at an edge, a quarter at a corner.
LaneVector<> vector_area(const Mesh& mesh, const LaneVectors<>& position, int i, int j) {
  const LaneVector<> along_s =
      difference(position, mesh.vertex(i, std::min(j + 1, mesh.columns - 1)),
                 mesh.vertex(i, std::max(j - 1, 0)));
  const LaneVector<> along_t = difference(position, mesh.vertex(std::min(i + 1, mesh.rows - 1), j),
                                          mesh.vertex(std::max(i - 1, 0), j));
  return {0.25 * (along_s.y * along_t.z - along_s.z * along_t.y),
          0.25 * (along_s.z * along_t.x - along_s.x * along_t.z),
          0.25 * (along_s.x * along_t.y - along_s.y * along_t.x)};
}

class Wind final : public Effect {
 public:
  void add_force(const EffectScene& scene, const std::vector<LaneValue<>>& parameters,
                 LaneVectors<>& force_n) const override {
    const LaneValue<>&c = parameters[0], &qx = parameters[1], &qy = parameters[2],
          &qz = parameters[3];
    const LaneVectors<>& velocity = scene.velocity_m_per_s;
    for (int i = 0; i < scene.mesh.rows; ++i) {
      for (int j = 0; j < scene.mesh.columns; ++j) {
        const int k = scene.mesh.vertex(i, j);
        const LaneVector<> area = vector_area(scene.mesh, scene.position_m, i, j);
        const LaneValue<> size = (area.x * area.x + area.y * area.y + area.z * area.z).sqrt();
        const LaneValue<> flow = area.x * (qx - c * velocity.x.col(k)) +
                                 area.y * (qy - c * velocity.y.col(k)) +
                                 area.z * (qz - c * velocity.z.col(k));
        // A vertex whose surface is folded to nothing catches no wind.
        const LaneValue<> pressure = (size > 0).select(flow / size, 0.0);
        force_n.x.col(k) += pressure * area.x;
        force_n.y.col(k) += pressure * area.y;
        force_n.z.col(k) += pressure * area.z;
      }
    }
  }

  double damping_rate_per_s(const Mesh& mesh, const Eigen::VectorXd& mass_kg,
                            const std::vector<double>& parameters) const override {
    constexpr double kStretched = 1.5;  // of the flat area
    const Eigen::VectorXd area_m2 = masses_by_area(mesh, mesh.width_m * mesh.height_m);
    return parameters[0] * kStretched * area_m2.cwiseQuotient(mass_kg).maxCoeff();
  }
};

}  // namespace

EffectDescription describe() {
  const auto pressure = [](const char* name) {
    return EffectParameter{.name = name,
                           .unit = "Pa",
                           .neutral = 0,
                           .lower = -3,
                           .upper = 3,
                           .typical = 0.05,
                           .scale = ParameterScale::linear};
  };
  return {.name = "wind",
          .summary = "wind and drag along the surface's normal, F = A [n . (q - c v)] n",
          .parameters = {{.name = "c",
                          .unit = "Pa s/m",
                          .neutral = 0,
                          .lower = 0,
                          .upper = 5,
                          .typical = 0.02,
                          .scale = ParameterScale::linear},
                         pressure("q_x"),
                         pressure("q_y"),
                         pressure("q_z")}};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<Wind>();
}

}  // namespace clothfit::wind
