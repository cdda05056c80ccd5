#pragma once

#include <Eigen/Dense>
#include <string>

#include "model/cloth/cloth.h"
#include "model/effects/linearisation.h"
#include "tests/model/random_cloth.h"

namespace clothfit {

/// The three things that an effect may do.
enum class EffectDeed { add_force, change_force, shift_supports };

/// An effect's action on one simulation as a map between plain vectors. Its linearisation can then
/// be compared with differences.
///
/// In:  positions, velocities, forces (on vertices; for `shift_supports` pulls on held points),
///      memory, parameters by ParameterNumber.
/// Out: forces or shifts, memory after the step.
class EffectMap {
 public:
  EffectMap(const Effect& effect, const Cloth& cloth, int own_parameters, EffectDeed deed)
      : effect_(effect),
        cloth_(cloth),
        deed_(deed),
        vertices_(cloth.mesh.vertex_count()),
        acted_on_(deed == EffectDeed::shift_supports ? static_cast<int>(cloth.held.size())
                                                     : vertices_),
        memory_(effect.memory_size(cloth)),
        own_(own_parameters) {}

  int inputs() const { return first_parameter() + ParameterNumber::own(own_); }
  int outputs() const { return 3 * acted_on_ + memory_; }
  int first_velocity() const { return 3 * vertices_; }
  int first_force() const { return 6 * vertices_; }
  int first_memory() const { return first_force() + 3 * acted_on_; }
  int first_parameter() const { return first_memory() + memory_; }

  /// Returns everything that an effect looks at, nothing remembered and no forces.
  Eigen::VectorXd input(const Eigen::Matrix3Xd& position_m,
                        const Eigen::Matrix3Xd& velocity_m_per_s, const SpringParameters& springs,
                        const Eigen::Vector3d& gravity_m_per_s2,
                        const std::vector<double>& own) const {
    Eigen::VectorXd in = Eigen::VectorXd::Zero(inputs());
    in.head(6 * vertices_) << position_m.reshaped(), velocity_m_per_s.reshaped();
    auto parameters = in.tail(inputs() - first_parameter());
    for (int type = 0; type < kSpringTypes; ++type) {
      const auto t = static_cast<size_t>(type);
      parameters[ParameterNumber::natural_length(type)] = springs.natural_length_m[t];
      parameters[ParameterNumber::stiffness(type)] = springs.stiffness_n_per_m[t];
      parameters[ParameterNumber::damping(type)] = springs.damping_ns_per_m[t];
    }
    for (int axis = 0; axis < 3; ++axis)
      parameters[ParameterNumber::gravity(axis)] = gravity_m_per_s2[axis];
    for (int p = 0; p < own_; ++p)
      parameters[ParameterNumber::own(p)] = own[static_cast<size_t>(p)];
    return in;
  }

  Eigen::VectorXd operator()(const Eigen::VectorXd& in) const {
    const Arguments at(*this, in);
    LaneVectors<SingleLane> result =
        deed_ == EffectDeed::change_force ? at.force_n : LaneVectors<SingleLane>::zero(acted_on_);
    EffectMemory<SingleLane> memory = at.memory;
    switch (deed_) {
      case EffectDeed::add_force:
        effect_.add_force(at.scene(cloth_), at.own, memory, result);
        break;
      case EffectDeed::change_force:
        effect_.change_force(at.scene(cloth_), at.own, result);
        break;
      case EffectDeed::shift_supports:
        effect_.shift_supports(at.scene(cloth_), at.own, at.force_n, memory, result);
        break;
    }
    Eigen::VectorXd out(outputs());
    out << result.lane(0).reshaped(), memory.matrix().transpose();
    return out;
  }

  /// Returns the effect's own derivative, outputs x inputs.
  Eigen::MatrixXd stated_jacobian(const Eigen::VectorXd& in) const {
    const Arguments at(*this, in);
    EffectLinearisation d;
    switch (deed_) {
      case EffectDeed::add_force:
        effect_.linearise_force(at.scene(cloth_), at.own, at.memory, d);
        break;
      case EffectDeed::change_force:
        effect_.linearise_change(at.scene(cloth_), at.own, at.force_n, d);
        break;
      case EffectDeed::shift_supports:
        effect_.linearise_supports(at.scene(cloth_), at.own, at.force_n, at.memory, d);
        break;
    }
    Eigen::MatrixXd j = Eigen::MatrixXd::Zero(outputs(), inputs());
    for (const auto& b : d.by_motion) {
      j.block<3, 3>(3 * b.on, 3 * b.of) += b.by_position;
      j.block<3, 3>(3 * b.on, first_velocity() + 3 * b.of) += b.by_velocity;
    }
    for (const auto& b : d.by_spring) {
      const Eigen::Matrix3d by_along = b.tension_ratio_n_per_m * Eigen::Matrix3d::Identity() +
                                       b.direction * b.w_n_per_m.transpose();
      const Eigen::Matrix3d by_rate = b.damping_ns_per_m * b.direction * b.direction.transpose();
      for (const auto& [on, sign] : {std::pair(b.a, 1.0), std::pair(b.b, -1.0)}) {
        j.block<3, 3>(3 * on, 3 * b.b) += sign * by_along;
        j.block<3, 3>(3 * on, 3 * b.a) -= sign * by_along;
        j.block<3, 3>(3 * on, first_velocity() + 3 * b.b) += sign * by_rate;
        j.block<3, 3>(3 * on, first_velocity() + 3 * b.a) -= sign * by_rate;
      }
    }
    const auto add_tension = [&](int spring, int column, double derivative) {
      const auto& b = d.by_spring[static_cast<size_t>(spring)];
      j.block<3, 1>(3 * b.a, column) += derivative * b.direction;
      j.block<3, 1>(3 * b.b, column) -= derivative * b.direction;
    };
    for (const auto& b : d.tension_by_parameter)
      add_tension(b.spring, first_parameter() + b.parameter, b.derivative);
    for (const auto& b : d.tension_by_memory)
      add_tension(b.spring, first_memory() + b.number, b.derivative);
    for (const auto& b : d.by_parameter)
      j.block<3, 1>(3 * b.on, first_parameter() + b.parameter) += b.derivative;
    for (const auto& b : d.by_memory)
      j.block<3, 1>(3 * b.on, first_memory() + b.number) += b.derivative;
    for (const auto& b : d.by_force)
      j.block<3, 3>(3 * b.on, first_force() + 3 * b.on) += b.derivative;

    std::vector<bool> changes(static_cast<size_t>(memory_), false);
    const auto row = [&](int number) {
      changes[static_cast<size_t>(number)] = true;
      return j.row(3 * acted_on_ + number);
    };
    for (const auto& b : d.memory_by_motion) {
      row(b.number).segment<3>(3 * b.of) += b.by_position;
      row(b.number).segment<3>(first_velocity() + 3 * b.of) += b.by_velocity;
    }
    for (const auto& b : d.memory_by_parameter)
      row(b.number)[first_parameter() + b.parameter] += b.derivative;
    for (const auto& b : d.memory_by_memory) row(b.number)[first_memory() + b.of] += b.derivative;
    for (const auto& b : d.memory_by_force)
      row(b.number).segment<3>(first_force() + 3 * b.of) += b.derivative;
    for (int m = 0; m < memory_; ++m)  // without an entry a number stays as it is
      if (!changes[static_cast<size_t>(m)]) j(3 * acted_on_ + m, first_memory() + m) = 1;
    return j;
  }

 private:
  struct Arguments {
    LaneVectors<SingleLane> position_m, velocity_m_per_s, force_n;
    LaneSprings<SingleLane> springs;
    LaneVector<SingleLane> gravity_m_per_s2;
    EffectMemory<SingleLane> memory;
    EffectValues<SingleLane> own;

    Arguments(const EffectMap& map, const Eigen::VectorXd& in)
        : position_m(vectors(in, 0, map.vertices_)),
          velocity_m_per_s(vectors(in, map.first_velocity(), map.vertices_)),
          force_n(vectors(in, map.first_force(), map.acted_on_)),
          memory(in.segment(map.first_memory(), map.memory_).transpose().array()) {
      const auto parameter = [&](int number) {
        return LaneValue<SingleLane>::Constant(in[map.first_parameter() + number]);
      };
      for (int type = 0; type < kSpringTypes; ++type) {
        const auto t = static_cast<size_t>(type);
        springs.natural_length_m[t] = parameter(ParameterNumber::natural_length(type));
        springs.stiffness_n_per_m[t] = parameter(ParameterNumber::stiffness(type));
        springs.damping_ns_per_m[t] = parameter(ParameterNumber::damping(type));
      }
      gravity_m_per_s2 = {parameter(ParameterNumber::gravity(0)),
                          parameter(ParameterNumber::gravity(1)),
                          parameter(ParameterNumber::gravity(2))};
      for (int p = 0; p < map.own_; ++p) own.push_back(parameter(ParameterNumber::own(p)));
    }
    static LaneVectors<SingleLane> vectors(const Eigen::VectorXd& in, int first, int count) {
      LaneVectors<SingleLane> result = LaneVectors<SingleLane>::zero(count);
      result.set_lane(0, in.segment(first, 3 * count).reshaped(3, count));
      return result;
    }
    EffectScene<SingleLane> scene(const Cloth& cloth) const {
      return {cloth, springs, gravity_m_per_s2, position_m, velocity_m_per_s, 0.3, 1e-3};
    }
  };

  const Effect& effect_;
  const Cloth& cloth_;
  EffectDeed deed_;
  int vertices_, acted_on_, memory_, own_;
};

/// Says where a stated derivative differs from central differences; nothing where it agrees.
///
/// `in` is where to compare, `size` the change of each input that matters. Steps are 1e-5 of that:
/// the differences' own error is some 1e-10 of the third derivative and, from rounding, 1e-11 of
/// the output. Laws of springs and surfaces that are nearly folded to nothing bend a few thousand
/// times as much as smooth ones: 1e-6 of a column's largest entry is granted.
std::string derivative_mismatch(const EffectMap& map, const Eigen::VectorXd& in,
                                const Eigen::VectorXd& size);

/// Compares all derivatives that an effect states with differences, in a moving, crumpled cloth
/// that is held at two points.
std::string derivative_mismatch(const Effect& effect, const EffectDescription& description,
                                const std::vector<double>& own, Uniform& uniform);

}  // namespace clothfit
