#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "model/effects/registry.h"
#include "tests/model/effect_contract.h"

namespace clothfit {

/// Makes a fabric of which only the structural springs along t pull.
inline SpringParameters warp_springs(const Mesh& mesh, double stiffness_n_per_m) {
  return spring_parameters({.tension_warp_n_per_m = stiffness_n_per_m}, mesh);
}

/// A ribbon of two columns whose rows are put at a test's places. It has an effect that answers
/// with tensions and remembers.
class DrivenRibbon {
 public:
  DrivenRibbon(int rows, double stiffness_n_per_m, const std::string& effect,
               const std::vector<double>& parameters)
      : cloth_(ribbon(rows)),
        effect_(find_effect(effect, "test").make()),
        parameters_(effect_contract::every_lane<SingleLane>(parameters)),
        memory_(EffectMemory<SingleLane>::Zero(1, effect_->memory_size(cloth_))) {
    set_lane(0, warp_springs(cloth_.mesh, stiffness_n_per_m), {}, springs_);
  }

  double natural_length_m() const { return cloth_.mesh.spacing_t_m(); }

  /// Takes one step: returns the effect's tension in each spring of the first column (N). The
  /// springs have these elongations (ratios), which grow at these rates (1/s).
  Eigen::VectorXd tensions_n(const Eigen::VectorXd& elongation, const Eigen::VectorXd& rate_per_s,
                             double time_step_s) {
    const Mesh& mesh = cloth_.mesh;
    Eigen::Matrix3Xd position_m = flat_positions(mesh);
    Eigen::Matrix3Xd velocity_m_per_s = at_rest(position_m);
    for (int i = 1; i < mesh.rows; ++i) {
      for (int j = 0; j < 2; ++j) {
        const int here = mesh.vertex(i, j), above = mesh.vertex(i - 1, j);
        position_m(1, here) = position_m(1, above) + natural_length_m() * (1 + elongation[i - 1]);
        velocity_m_per_s(1, here) =
            velocity_m_per_s(1, above) + natural_length_m() * rate_per_s[i - 1];
      }
    }
    LaneVectors<SingleLane> p = LaneVectors<SingleLane>::zero(mesh.vertex_count()), v = p, f = p;
    p.set_lane(0, position_m);
    v.set_lane(0, velocity_m_per_s);
    const EffectScene<SingleLane> scene{cloth_, springs_.springs, springs_.gravity_m_per_s2, p, v,
                                        0,      time_step_s};
    effect_->add_force(scene, parameters_, memory_, f);
    Eigen::VectorXd tension_n(mesh.rows - 1);
    double sum_n = 0;
    for (int i = 0; i < mesh.rows - 1; ++i) tension_n[i] = sum_n += f.y(0, mesh.vertex(i, 0));
    return tension_n;
  }
  /// Does the same for a single spring.
  double tension_n(double elongation, double rate_per_s, double time_step_s) {
    return tensions_n(Eigen::VectorXd::Constant(1, elongation),
                      Eigen::VectorXd::Constant(1, rate_per_s), time_step_s)[0];
  }

 private:
  static Cloth ribbon(int rows) {
    const Mesh mesh{.columns = 2, .rows = rows, .width_m = 0.1, .height_m = 0.4};
    return Cloth::of(mesh, masses_by_area(mesh, 0.02));
  }

  Cloth cloth_;
  std::unique_ptr<Effect> effect_;
  LaneParameters<SingleLane> springs_;
  EffectValues<SingleLane> parameters_;
  EffectMemory<SingleLane> memory_;
};

/// Two masses that swing side by side on a spring each, below held ones, without weight.
class SpringOscillator {
 public:
  static constexpr double kLength_m = 0.4, kMass_kg = 0.01, kStiffness_n_per_m = 40;

  SpringOscillator(const std::string& effect, const std::vector<double>& parameters,
                   double extension_m) {
    const Mesh mesh{.columns = 2, .rows = 2, .width_m = 0.1, .height_m = kLength_m};
    cloth_ = Cloth::of(mesh, Eigen::VectorXd::Constant(4, kMass_kg));
    cloth_.held = {held_at(mesh, 0, 0), held_at(mesh, mesh.width_m, 0)};
    add_effect(cloth_, effect, "test");
    set_ = {.springs = warp_springs(mesh, kStiffness_n_per_m),
            .gravity_m_per_s2 = Eigen::Vector3d::Zero(),
            .effects = {parameters},
            .start_position_m = flat_positions(mesh)};
    set_.start_position_m.row(1).tail<2>().array() += extension_m;
  }

  /// Returns the extension (m) at the start and after each of `steps` steps.
  std::vector<double> extensions_m(double time_step_s, int steps) const {
    SteppedCloth<> run(cloth_, set_, at_rest(set_.start_position_m));
    std::vector<double> extension_m{run.position_m()(1, 2) - kLength_m};
    for (int n = 0; n < steps; ++n) {
      run.step(time_step_s);
      extension_m.push_back(run.position_m()(1, 2) - kLength_m);
    }
    return extension_m;
  }

 private:
  Cloth cloth_;
  ParameterSet set_;
};

}  // namespace clothfit
