#include "model/integrate/adjoint.h"

#include <algorithm>
#include <cmath>

#include "model/effects/linearisation.h"
#include "model/integrate/step.h"

namespace clothfit {
namespace {

using Vectors = LaneVectors<SingleLane>;

Eigen::Vector3d at(const Vectors& vectors, int k) {
  return {vectors.x(0, k), vectors.y(0, k), vectors.z(0, k)};
}

void add(Vectors& vectors, int k, const Eigen::Vector3d& value) {
  vectors.x(0, k) += value.x();
  vectors.y(0, k) += value.y();
  vectors.z(0, k) += value.z();
}

Vectors vectors_of(const Eigen::Matrix3Xd& values) {
  Vectors vectors = Vectors::zero(static_cast<int>(values.cols()));
  vectors.set_lane(0, values);
  return vectors;
}

/// One time step of a schedule.
struct Step {
  double time_s = 0, end_s = 0, time_step_s = 0;
  int frame = 0;  ///< the step leads to it
  bool ends_frame = false;
};

std::vector<Step> steps_of(const Schedule& schedule) {
  std::vector<Step> steps;
  for (int frame = 1; frame < static_cast<int>(schedule.frame_time_s.size()); ++frame) {
    const double from_s = schedule.frame_time_s[static_cast<size_t>(frame) - 1];
    const int count = schedule.substeps(frame);
    const double h = (schedule.frame_time_s[static_cast<size_t>(frame)] - from_s) / count;
    for (int n = 0; n < count; ++n)
      steps.push_back({from_s + n * h, from_s + (n + 1) * h, h, frame, n + 1 == count});
  }
  return steps;
}

/// The state of a step that is kept for the way back.
struct Record {
  LaneState<SingleLane> before;
  std::vector<LimitMove> moves;
  /// Velocities of the vertices that held points touch, in their order, once these are placed.
  std::vector<Eigen::Vector3d> placed_velocity_m_per_s;
  Vectors driven_velocity_m_per_s;
};

/// One simulation, step by step forwards and back.
class Run {
 public:
  Run(const Cloth& cloth, const ParameterSet& set, const SimulationFields& fields, int intervals)
      : cloth_(cloth),
        set_(set),
        factors_(fields.spring_factors.get()),
        stepper_(cloth),
        sweep_(cloth.mesh),
        tangents_(cloth.mesh),
        parameters_(lane_parameters<SingleLane>(cloth, {&set, 1})),
        state_(LaneState<SingleLane>::of(cloth)),
        inverse_mass_per_kg_(cloth.mass_kg.cwiseInverse()) {
    set_start(0, set, state_);
    start_target_m_ = stepper_.held().locate(state_.position_m);
    for (const Eigen::Matrix3Xd& force : fields.force_n) force_n_.push_back(vectors_of(force));

    const int vertices = cloth.mesh.vertex_count();
    by_state_ = LaneState<SingleLane>::of(cloth);
    by_force_ = Vectors::zero(vertices);
    by_target_ = by_start_target_ = Vectors::zero(stepper_.held().count());
    gradient_.by_springs = TangentSweep::SpringGradients::zero(cloth.mesh);
    gradient_.by_mass_kg = Eigen::VectorXd::Zero(vertices);
    gradient_.by_force_n.assign(static_cast<size_t>(intervals),
                                Eigen::Matrix3Xd::Zero(3, vertices));
    for (const EffectDescription& effect : cloth.effect_descriptions)
      gradient_.by_effects.emplace_back(effect.parameters.size(), 0.0);
  }

  const LaneState<SingleLane>& state() const { return state_; }
  void set_state(const LaneState<SingleLane>& state) { state_ = state; }

  void forward(const Step& step, Record* record = nullptr) {
    StepExtras<SingleLane> extras{.factors = factors_, .force_n = external_force(step)};
    if (record != nullptr) {
      record->before = state_;
      record->moves.clear();
      extras.moves = &record->moves;
      extras.driven_velocity_m_per_s = &record->driven_velocity_m_per_s;
    }
    stepper_.step(parameters_, target_at(step.end_s), step.time_s, step.time_step_s, state_,
                  extras);
    if (record == nullptr) return;
    record->placed_velocity_m_per_s.clear();
    for (const int vertex : stepper_.held().touched())
      record->placed_velocity_m_per_s.push_back(at(state_.velocity_m_per_s, vertex));
  }

  void add_cost(const Eigen::Matrix3Xd& by_position) {
    by_state_.position_m.x.row(0) += by_position.row(0).array();
    by_state_.position_m.y.row(0) += by_position.row(1).array();
    by_state_.position_m.z.row(0) += by_position.row(2).array();
  }

  /// Turns derivatives by the state after a step into those by the state before it.
  void backward(const Step& step, const Record& record) {
    take_back_limit(record.moves, step.time_step_s);
    take_back_placement(step.time_step_s, record);
    take_back_motion(step, record);
  }

  CostGradient finish() {
    // Held points without a motion stay where the start shape has them.
    for (size_t h = 0; h < cloth_.held.size(); ++h) {
      if (cloth_.held[h].motion) continue;
      for (const auto& [vertex, weight] : cloth_.held[h].weights)
        add(by_state_.position_m, vertex, weight * at(by_start_target_, static_cast<int>(h)));
    }
    gradient_.by_start_position = by_state_.position_m.lane(0);
    gradient_.by_start_velocity = by_state_.velocity_m_per_s.lane(0);
    for (const EffectMemory<SingleLane>& by_memory : by_state_.effect_memory)
      gradient_.by_start_effect_memory.emplace_back(by_memory.row(0).matrix().transpose());
    return std::move(gradient_);
  }

 private:
  const Vectors& target_at(double time_s) {
    target_m_ = start_target_m_;
    for (size_t h = 0; h < cloth_.held.size(); ++h) {
      if (!cloth_.held[h].motion) continue;
      const Eigen::Vector3d place = shifted(cloth_.held[h].motion(time_s), set_, h, time_s);
      const auto column = static_cast<Eigen::Index>(h);
      target_m_.x(0, column) = place.x();
      target_m_.y(0, column) = place.y();
      target_m_.z(0, column) = place.z();
    }
    return target_m_;
  }
  const Vectors* external_force(const Step& step) const {
    return force_n_.empty() ? nullptr : &force_n_[static_cast<size_t>(step.frame) - 1];
  }

  void take_back_limit(const std::vector<LimitMove>& moves, double time_step_s) {
    const bool velocities = cloth_.strain_limit.mode == StrainLimitMode::consistent;
    for (auto move = moves.rbegin(); move != moves.rend(); ++move) {
      // The ends move by x_a += s_a m, x_b -= s_b m, the velocities by the same over h, with m = (1
      // - longest / l) L.
      const auto by_end = [&](int k) -> Eigen::Vector3d {
        Eigen::Vector3d sum = at(by_state_.position_m, k);
        if (velocities) sum += at(by_state_.velocity_m_per_s, k) / time_step_s;
        return sum;
      };
      const Eigen::Vector3d by_first = by_end(move->first), by_second = by_end(move->second);
      const Eigen::Vector3d by_move = move->first_share * by_first - move->second_share * by_second;
      const double along_move = by_move.dot(move->along_m);
      const double inverse = move->inverse_length_per_m;
      const Eigen::Vector3d by_along = move->excess * by_move + (1 - move->excess) * inverse *
                                                                    inverse * along_move *
                                                                    move->along_m;
      gradient_.by_longest_m[static_cast<size_t>(move->type)] -= inverse * along_move;
      if (move->first_share > 0 && move->second_share > 0) {
        // s_a = m_b / (m_a + m_b) = 1 - s_b; beside a held end the shares are 1 and 0.
        const double by_first_share = move->excess * (by_first + by_second).dot(move->along_m) /
                                      (cloth_.mass_kg[move->first] + cloth_.mass_kg[move->second]);
        gradient_.by_mass_kg[move->first] -= move->first_share * by_first_share;
        gradient_.by_mass_kg[move->second] += move->second_share * by_first_share;
      }
      add(by_state_.position_m, move->second, by_along);
      add(by_state_.position_m, move->first, -by_along);
    }
  }

  void take_back_placement(double time_step_s, const Record& record) {
    // The step made P += C (target - A P), V += the same / h.
    const HeldPlacement<SingleLane>& held = stepper_.held();
    by_target_.set_zero();
    for (size_t n = 0; n < held.touched().size(); ++n) {
      const int vertex = held.touched()[n];
      const Eigen::Vector3d by_shift =
          at(by_state_.position_m, vertex) + at(by_state_.velocity_m_per_s, vertex) / time_step_s;
      for (int h = 0; h < held.count(); ++h)
        add(by_target_, h, held.correction()(static_cast<Eigen::Index>(n), h) * by_shift);
    }
    for (int h = 0; h < held.count(); ++h)
      for (const auto& [vertex, weight] : cloth_.held[static_cast<size_t>(h)].weights)
        add(by_state_.position_m, vertex, -weight * at(by_target_, h));
    // C = W A' (A W A')^-1 with the inverse masses W: dC (target - A P) = (1 - C A) dW W^-1 shift
    for (size_t n = 0; n < held.touched().size(); ++n) {
      const int vertex = held.touched()[n];
      const Eigen::Vector3d by_shift =
          at(by_state_.position_m, vertex) + at(by_state_.velocity_m_per_s, vertex) / time_step_s;
      const Eigen::Vector3d shift = time_step_s * (record.placed_velocity_m_per_s[n] -
                                                   at(record.driven_velocity_m_per_s, vertex));
      gradient_.by_mass_kg[vertex] -= by_shift.dot(shift) / cloth_.mass_kg[vertex];
    }
    by_start_target_.x += by_target_.x;
    by_start_target_.y += by_target_.y;
    by_start_target_.z += by_target_.z;
  }

  void take_back_motion(const Step& step, const Record& record) {
    const double h = step.time_step_s;
    const LaneState<SingleLane>& before = record.before;
    const EffectScene<SingleLane> scene{cloth_,
                                        parameters_.springs,
                                        parameters_.gravity_m_per_s2,
                                        before.position_m,
                                        before.velocity_m_per_s,
                                        step.time_s,
                                        h};
    // The step made P += h V with the new V, after V += h (g + F / m).
    Vectors &by_position = by_state_.position_m, &by_velocity = by_state_.velocity_m_per_s;
    const Vectors &velocity = before.velocity_m_per_s, &driven = record.driven_velocity_m_per_s;
    const LaneVector<SingleLane>& g = parameters_.gravity_m_per_s2;
    Eigen::VectorXd& by_mass = gradient_.by_mass_kg;
    TangentSweep::take_back_motion(h, g.x[0], inverse_mass_per_kg_, velocity.x, driven.x,
                                   by_position.x, by_velocity.x, by_force_.x, by_mass);
    TangentSweep::take_back_motion(h, g.y[0], inverse_mass_per_kg_, velocity.y, driven.y,
                                   by_position.y, by_velocity.y, by_force_.y, by_mass);
    TangentSweep::take_back_motion(h, g.z[0], inverse_mass_per_kg_, velocity.z, driven.z,
                                   by_position.z, by_velocity.z, by_force_.z, by_mass);
    gradient_.by_gravity +=
        h * Eigen::Vector3d(by_velocity.x.sum(), by_velocity.y.sum(), by_velocity.z.sum());
    take_back_inertia_and_supports(step, scene, before);

    if (!force_n_.empty())
      gradient_.by_force_n[static_cast<size_t>(step.frame) - 1] += by_force_.lane(0);
    for (size_t e = 0; e < cloth_.effects.size(); ++e) {
      derivatives_.clear();
      cloth_.effects[e]->linearise_force(scene, parameters_.effects[e], before.effect_memory[e],
                                         derivatives_);
      apply_transposed(e, by_force_);
    }
    tangents_.add_transposed(
        {parameters_.springs, before.position_m, before.velocity_m_per_s, factors_}, by_force_,
        by_position, by_velocity, gradient_.by_springs);
  }

  /// Takes back the effects that look at the sum of forces, in the reverse of their order.
  void take_back_inertia_and_supports(const Step& step, const EffectScene<SingleLane>& scene,
                                      const LaneState<SingleLane>& before) {
    bool any = false;
    for (const std::shared_ptr<const Effect>& effect : cloth_.effects)
      any = any || effect->changes_force() || effect->shifts_supports();
    if (!any) return;
    // The sum of forces is kept before each effect that changes it, and in the end.
    std::vector<EffectMemory<SingleLane>> memory = before.effect_memory;
    const int vertices = cloth_.mesh.vertex_count();
    Vectors force_n =
        external_force(step) != nullptr ? *external_force(step) : Vectors::zero(vertices);
    for (size_t e = 0; e < cloth_.effects.size(); ++e)
      cloth_.effects[e]->add_force(scene, parameters_.effects[e], memory[e], force_n);
    sweep_.add_spring_forces(parameters_.springs, before.position_m, before.velocity_m_per_s,
                             force_n, factors_);
    Vectors pull_n = Vectors::zero(stepper_.held().count());
    stepper_.held().add_pulls(force_n, parameters_.gravity_m_per_s2, pull_n);
    std::vector<Vectors> force_before;
    for (size_t e = 0; e < cloth_.effects.size(); ++e) {
      force_before.push_back(force_n);
      cloth_.effects[e]->change_force(scene, parameters_.effects[e], force_n);
    }

    Vectors by_pull = Vectors::zero(stepper_.held().count());
    for (size_t e = cloth_.effects.size(); e-- > 0;) {
      if (!cloth_.effects[e]->shifts_supports()) continue;
      derivatives_.clear();
      cloth_.effects[e]->linearise_supports(scene, parameters_.effects[e], pull_n,
                                            before.effect_memory[e], derivatives_);
      for (const EffectLinearisation::ByForce& block : derivatives_.by_force)
        add(by_pull, block.on, block.derivative.transpose() * at(by_target_, block.on));
      for (const EffectLinearisation::MemoryByForce& block : derivatives_.memory_by_force)
        add(by_pull, block.of,
            block.derivative.transpose() * by_state_.effect_memory[e](0, block.number));
      apply_transposed(e, by_target_);
    }
    for (size_t e = cloth_.effects.size(); e-- > 0;) {
      if (!cloth_.effects[e]->changes_force()) continue;
      derivatives_.clear();
      cloth_.effects[e]->linearise_change(scene, parameters_.effects[e], force_before[e],
                                          derivatives_);
      apply_transposed(e, by_force_);
      Vectors by_force = Vectors::zero(vertices);
      for (const EffectLinearisation::ByForce& block : derivatives_.by_force)
        add(by_force, block.on, block.derivative.transpose() * at(by_force_, block.on));
      by_force_ = by_force;
    }
    for (int h = 0; h < stepper_.held().count(); ++h) {
      const Eigen::Vector3d by = at(by_pull, h);
      for (const auto& [vertex, weight] : cloth_.held[static_cast<size_t>(h)].weights) {
        add(by_force_, vertex, weight * by);
        gradient_.by_gravity += weight * cloth_.mass_kg[vertex] * by;
        gradient_.by_mass_kg[vertex] +=
            weight * by.dot(Eigen::Vector3d(parameters_.gravity_m_per_s2.x[0],
                                            parameters_.gravity_m_per_s2.y[0],
                                            parameters_.gravity_m_per_s2.z[0]));
      }
    }
  }

  /// Multiplies by the transpose of `derivatives_` of effect `e`. From derivatives by its action
  /// (forces, or places of held points) it adds those by the state before, the parameters and its
  /// memory.
  void apply_transposed(size_t e, const Vectors& by_action) {
    LaneState<SingleLane>& by = by_state_;
    for (const EffectLinearisation::ByMotion& block : derivatives_.by_motion) {
      const Eigen::Vector3d by_on = at(by_action, block.on);
      add(by.position_m, block.of, block.by_position.transpose() * by_on);
      add(by.velocity_m_per_s, block.of, block.by_velocity.transpose() * by_on);
    }
    by_tension_.clear();
    for (const EffectLinearisation::BySpring& spring : derivatives_.by_spring) {
      const Eigen::Vector3d by_pull = at(by_action, spring.a) - at(by_action, spring.b);
      const double by_tension = spring.direction.dot(by_pull);
      by_tension_.push_back(by_tension);
      const Eigen::Vector3d by_along =
          spring.tension_ratio_n_per_m * by_pull + by_tension * spring.w_n_per_m;
      const Eigen::Vector3d by_rate = spring.damping_ns_per_m * by_tension * spring.direction;
      add(by.position_m, spring.b, by_along);
      add(by.position_m, spring.a, -by_along);
      add(by.velocity_m_per_s, spring.b, by_rate);
      add(by.velocity_m_per_s, spring.a, -by_rate);
    }
    for (const EffectLinearisation::TensionByParameter& of : derivatives_.tension_by_parameter)
      add_by_parameter(e, of.parameter,
                       of.derivative * by_tension_[static_cast<size_t>(of.spring)]);
    for (const EffectLinearisation::ByParameter& column : derivatives_.by_parameter)
      add_by_parameter(e, column.parameter, column.derivative.dot(at(by_action, column.on)));
    for (const EffectLinearisation::ByMass& column : derivatives_.by_mass)
      gradient_.by_mass_kg[column.on] += column.derivative.dot(at(by_action, column.on));

    EffectMemory<SingleLane>& by_memory = by.effect_memory[e];
    if (derivatives_.memory_by_memory.empty() && derivatives_.by_memory.empty()) return;
    const EffectMemory<SingleLane> by_next = by_memory;
    by_memory.setZero();
    for (const EffectLinearisation::ByMemory& column : derivatives_.by_memory)
      by_memory(0, column.number) += column.derivative.dot(at(by_action, column.on));
    for (const EffectLinearisation::TensionByMemory& of : derivatives_.tension_by_memory)
      by_memory(0, of.number) += of.derivative * by_tension_[static_cast<size_t>(of.spring)];
    for (const EffectLinearisation::MemoryByMemory& entry : derivatives_.memory_by_memory)
      by_memory(0, entry.of) += entry.derivative * by_next(0, entry.number);
    for (const EffectLinearisation::MemoryByMotion& row : derivatives_.memory_by_motion) {
      add(by.position_m, row.of, row.by_position.transpose() * by_next(0, row.number));
      add(by.velocity_m_per_s, row.of, row.by_velocity.transpose() * by_next(0, row.number));
    }
    for (const EffectLinearisation::MemoryByParameter& entry : derivatives_.memory_by_parameter)
      add_by_parameter(e, entry.parameter, entry.derivative * by_next(0, entry.number));
  }

  void add_by_parameter(size_t e, int number, double value) {
    if (number >= ParameterNumber::own(0))
      gradient_.by_effects[e][static_cast<size_t>(number - ParameterNumber::own(0))] += value;
    else if (number >= ParameterNumber::gravity(0))
      gradient_.by_gravity[number - ParameterNumber::gravity(0)] += value;
    else
      gradient_.by_types[static_cast<size_t>(number)] += value;
  }

  const Cloth& cloth_;
  const ParameterSet& set_;
  const SpringFactors<SingleLane>* factors_;
  EulerStepper<SingleLane> stepper_;
  ClothSweep<SingleLane> sweep_;
  TangentSweep tangents_;
  LaneParameters<SingleLane> parameters_;
  LaneState<SingleLane> state_;
  Eigen::VectorXd inverse_mass_per_kg_;
  Vectors start_target_m_, target_m_;
  std::vector<Vectors> force_n_;
  EffectLinearisation derivatives_;
  std::vector<double> by_tension_;  ///< of each of its springs

  LaneState<SingleLane> by_state_;
  Vectors by_force_, by_target_, by_start_target_;
  CostGradient gradient_;
};

/// Watches a run frame by frame.
class Frames {
 public:
  Frames(const Cloth& cloth, const ParameterSet& set) : cloth_(cloth), set_(set) {}
  void add(const LaneState<SingleLane>& state) {
    Eigen::Matrix3Xd now = state.position_m.lane(0);
    if (is_running() && left_the_scene(now, set_.start_position_m, cloth_.mesh)) {
      result_.reason = StopReason::diverged;
      result_.diverged_frame = static_cast<int>(result_.position_m.size());
    }
    if (!is_running()) now.setConstant(NAN);
    result_.position_m.push_back(std::move(now));
  }
  void cancel() {
    if (is_running()) result_.reason = StopReason::cancelled;
  }
  /// Returns the run, which is over. Call it once.
  SimulateResult take_result() {
    if (is_running()) result_.reason = StopReason::reached_end;
    return std::move(result_);
  }

 private:
  bool is_running() const { return result_.reason == StopReason::not_run; }

  const Cloth& cloth_;
  const ParameterSet& set_;
  SimulateResult result_;
};

}  // namespace

SimulateResult simulate_with_fields(const Cloth& cloth, const ParameterSet& parameters,
                                    const Schedule& schedule, const SimulationFields& fields,
                                    const StopCheck& stop) {
  StopAsker asker(stop, cloth.spring_count());
  Run run(cloth, parameters, fields, static_cast<int>(schedule.frame_time_s.size()) - 1);
  Frames frames(cloth, parameters);
  frames.add(run.state());
  for (const Step& step : steps_of(schedule)) {
    run.forward(step);
    if (step.ends_frame) frames.add(run.state());
    if (!asker.ends()) continue;
    frames.cancel();
    break;
  }
  return frames.take_result();
}

GradientResult simulate_with_gradient(const Cloth& cloth, const ParameterSet& parameters,
                                      const Schedule& schedule, const SimulationFields& fields,
                                      const CostByPosition& cost_by_position,
                                      const StopCheck& stop) {
  StopAsker asker(stop, cloth.spring_count());
  const std::vector<Step> steps = steps_of(schedule);
  const size_t stride =
      std::max<size_t>(1, static_cast<size_t>(std::ceil(std::sqrt(steps.size()))));
  Run run(cloth, parameters, fields, static_cast<int>(schedule.frame_time_s.size()) - 1);

  // Forwards, a checkpoint is kept every `stride` steps.
  Frames frames(cloth, parameters);
  frames.add(run.state());
  std::vector<LaneState<SingleLane>> checkpoints;
  std::vector<Record> records(std::min(stride, steps.size()));
  const size_t last_stretch = steps.empty() ? 0 : (steps.size() - 1) / stride;
  for (size_t n = 0; n < steps.size(); ++n) {
    if (n % stride == 0) checkpoints.push_back(run.state());
    // The last stretch is taken back first: it need not be computed again.
    run.forward(steps[n], n / stride == last_stretch ? &records[n % stride] : nullptr);
    if (steps[n].ends_frame) frames.add(run.state());
    if (!asker.ends()) continue;
    frames.cancel();
    break;
  }
  GradientResult result;
  result.run = frames.take_result();
  if (!result.run.usable()) return result;

  std::vector<Eigen::Matrix3Xd> by_position;
  for (size_t frame = 0; frame < result.run.position_m.size(); ++frame)
    by_position.push_back(cost_by_position(static_cast<int>(frame), result.run.position_m[frame]));

  // Backwards, one stretch after the other is taken back.
  for (size_t stretch = checkpoints.size(); stretch-- > 0;) {
    const size_t first = stretch * stride, end = std::min(first + stride, steps.size());
    if (stretch != last_stretch) {
      run.set_state(checkpoints[stretch]);
      for (size_t n = first; n < end; ++n) run.forward(steps[n], &records[n - first]);
    }
    for (size_t n = end; n-- > first;) {
      if (steps[n].ends_frame) run.add_cost(by_position[static_cast<size_t>(steps[n].frame)]);
      run.backward(steps[n], records[n - first]);
      if (!asker.ends()) continue;
      result.run.reason = StopReason::cancelled;
      return result;
    }
  }
  run.add_cost(by_position.front());
  result.gradient = run.finish();
  return result;
}

}  // namespace clothfit
