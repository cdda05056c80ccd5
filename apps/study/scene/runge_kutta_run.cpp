#include "apps/study/scene/runge_kutta_run.h"

#include <cassert>

#include "model/integrate/step.h"

namespace clothfit {
namespace {

using Memory = std::vector<EffectMemory<SingleLane>>;

/// The cloth's equation of motion at a time, all held points at their prescribed places.
class Motion {
 public:
  Motion(const Cloth& cloth, const ParameterSet& parameters)
      : cloth_(cloth),
        parameters_(parameters),
        lane_(lane_parameters<SingleLane>(cloth, {&parameters, 1})) {}

  /// Puts held points at their places of `time_s`, with their velocities.
  void hold(double time_s, Eigen::Matrix3Xd& position_m, Eigen::Matrix3Xd& velocity) const {
    constexpr double kApartS = 1e-5;
    for (const HeldVertexWeights& held : cloth_.held) {
      assert(held.weights.size() == 1);
      const int vertex = held.weights.front().vertex;
      if (!held.motion) {
        position_m.col(vertex) = parameters_.start_position_m.col(vertex);
        velocity.col(vertex).setZero();
        continue;
      }
      position_m.col(vertex) = held.motion(time_s);
      velocity.col(vertex) =
          (held.motion(time_s + kApartS) - held.motion(time_s - kApartS)) / (2 * kApartS);
    }
  }

  /// Returns accelerations (m/s2); the memory moves on by `time_step_s`.
  Eigen::Matrix3Xd acceleration(double time_s, double time_step_s,
                                const Eigen::Matrix3Xd& position_m,
                                const Eigen::Matrix3Xd& velocity, Memory& memory) const {
    Eigen::Matrix3Xd force_n = Eigen::Matrix3Xd::Zero(3, position_m.cols());
    for (size_t t = 0; t < kSpringTypes; ++t) {
      const double l0 = parameters_.springs.natural_length_m[t],
                   k = parameters_.springs.stiffness_n_per_m[t],
                   c = parameters_.springs.damping_ns_per_m[t];
      for (const Spring& spring : cloth_.springs[t]) {
        const Eigen::Vector3d along = position_m.col(spring.b) - position_m.col(spring.a);
        const double length = along.norm();
        if (length < 1e-140) continue;  // no direction: no pull
        const Eigen::Vector3d u = along / length;
        const double stretching = u.dot(velocity.col(spring.b) - velocity.col(spring.a));
        const Eigen::Vector3d pull_n = (k * (length - l0) + c * stretching) * u;
        force_n.col(spring.a) += pull_n;
        force_n.col(spring.b) -= pull_n;
      }
    }
    const auto vertices = static_cast<int>(position_m.cols());
    auto p = LaneVectors<SingleLane>::zero(vertices), v = p, force = p;
    p.set_lane(0, position_m);
    v.set_lane(0, velocity);
    force.set_lane(0, force_n);
    const EffectScene<SingleLane> scene{cloth_, lane_.springs, lane_.gravity_m_per_s2, p, v,
                                        time_s, time_step_s};
    for (size_t e = 0; e < cloth_.effects.size(); ++e)
      cloth_.effects[e]->add_force(scene, lane_.effects[e], memory[e], force);
    for (size_t e = 0; e < cloth_.effects.size(); ++e)
      cloth_.effects[e]->change_force(scene, lane_.effects[e], force);
    Eigen::Matrix3Xd acceleration = force.lane(0) * cloth_.mass_kg.cwiseInverse().asDiagonal();
    acceleration.colwise() += parameters_.gravity_m_per_s2;
    for (const HeldVertexWeights& held : cloth_.held)
      acceleration.col(held.weights.front().vertex).setZero();
    return acceleration;
  }

 private:
  const Cloth& cloth_;
  const ParameterSet& parameters_;
  LaneParameters<SingleLane> lane_;
};

}  // namespace

std::vector<Eigen::Matrix3Xd> run_runge_kutta(const Cloth& cloth, const ParameterSet& parameters,
                                              const Schedule& schedule, const StopCheck& stop) {
  StopAsker asker(stop, cloth.spring_count());
  const Motion motion(cloth, parameters);
  const std::vector<double>& time_s = schedule.frame_time_s;
  Eigen::Matrix3Xd p = parameters.start_position_m;
  Eigen::Matrix3Xd v = Eigen::Matrix3Xd::Zero(3, p.cols());
  Memory memory = LaneState<SingleLane>::of(cloth).effect_memory;
  motion.hold(time_s.front(), p, v);
  std::vector<Eigen::Matrix3Xd> position_m{p};
  for (size_t f = 1; f < time_s.size(); ++f) {
    const int steps = schedule.substeps(static_cast<int>(f));
    const double h = (time_s[f] - time_s[f - 1]) / steps;
    for (int n = 0; n < steps; ++n) {
      const double now_s = time_s[f - 1] + n * h;
      const Eigen::Matrix3Xd p0 = p, v0 = v;
      Eigen::Matrix3Xd p_sum = Eigen::Matrix3Xd::Zero(3, p.cols()), v_sum = p_sum;
      const Memory remembered = memory;
      constexpr double kLater[] = {0, 0.5, 0.5, 1}, kWeight[] = {1, 2, 2, 1};
      for (int stage = 0; stage < 4; ++stage) {
        const double at_s = now_s + kLater[stage] * h;
        motion.hold(at_s, p, v);
        Memory tried = remembered;
        const Eigen::Matrix3Xd a = motion.acceleration(at_s, h, p, v, stage == 0 ? memory : tried);
        p_sum += kWeight[stage] / 6 * v;
        v_sum += kWeight[stage] / 6 * a;
        if (stage == 3) break;
        const double later_s = kLater[stage + 1] * h;
        p = p0 + later_s * v;
        v = v0 + later_s * a;
      }
      p = p0 + h * p_sum;
      v = v0 + h * v_sum;
      motion.hold(now_s + h, p, v);
      if (asker.ends()) return {};
    }
    if (left_the_scene(p, parameters.start_position_m, cloth.mesh)) return {};
    position_m.push_back(p);
  }
  return position_m;
}

}  // namespace clothfit
