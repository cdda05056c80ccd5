// Checks gradients of a cost by whole fields. They are compared with tangents, and with differences
// where no tangent reaches (single springs, single masses, forces over space and time).

#include "model/integrate/adjoint.h"

#include <gtest/gtest.h>

#include <numeric>

#include "model/effects/registry.h"
#include "tests/model/instruction_sets.h"
#include "tests/model/swing.h"

namespace clothfit {
namespace {

/// A cost that looks at every frame, linear so that its derivative is exact.
struct Cost {
  std::vector<Eigen::Matrix3Xd> weight;

  Cost(const Swing& swing, Uniform& uniform) {
    for (size_t f = 0; f < swing.schedule.frame_time_s.size(); ++f)
      weight.push_back(uniform.vectors(swing.cloth.mesh.vertex_count(), 1));
  }
  double of(const std::vector<Eigen::Matrix3Xd>& position_m) const {
    double sum = 0;
    for (size_t f = 0; f < weight.size(); ++f) sum += weight[f].cwiseProduct(position_m[f]).sum();
    return sum;
  }
  CostByPosition by_position() const {
    return
        [this](int frame, const Eigen::Matrix3Xd&) { return weight[static_cast<size_t>(frame)]; };
  }
};

double sum(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

/// Returns the cost's derivative along a direction, from its gradient by fields.
double along(const CostGradient& gradient, const Swing& swing, const Direction& d) {
  double slope = gradient.by_gravity.dot(d.gravity_m_per_s2) +
                 gradient.by_start_position.cwiseProduct(d.start_position_m).sum() +
                 gradient.by_start_velocity.cwiseProduct(d.start_velocity_m_per_s).sum();
  for (size_t type = 0; type < kSpringTypes; ++type) {
    const double critical = swing.set.springs.critical_elongation[type];
    const double longest_change =
        std::isfinite(critical)
            ? d.natural_length_m[type] * (1 + critical) +
                  swing.set.springs.natural_length_m[type] * d.critical_elongation[type]
            : 0;
    slope += gradient.by_longest_m[type] * longest_change +
             (sum(gradient.by_springs.natural_length_m[type]) + gradient.by_types[type]) *
                 d.natural_length_m[type] +
             (sum(gradient.by_springs.stiffness_n_per_m[type]) +
              gradient.by_types[kSpringTypes + type]) *
                 d.stiffness_n_per_m[type] +
             (sum(gradient.by_springs.damping_ns_per_m[type]) +
              gradient.by_types[2 * kSpringTypes + type]) *
                 d.damping_ns_per_m[type];
  }
  for (size_t e = 0; e < d.effects.size(); ++e)
    for (size_t p = 0; p < d.effects[e].size(); ++p)
      slope += gradient.by_effects[e][p] * d.effects[e][p];
  for (size_t e = 0; e < d.start_effect_memory.size(); ++e)
    slope += gradient.by_start_effect_memory[e].dot(d.start_effect_memory[e]);
  return slope;
}

void expect_adjoint_to_equal_tangent(Swing& swing, Uniform& uniform) {
  swing.cloth.held.back().motion = nullptr;  // the adjoint knows no derivative by a path
  const Cost cost(swing, uniform);
  Direction direction = random_direction(swing.cloth, uniform);

  const GradientResult result =
      simulate_with_gradient(swing.cloth, swing.set, swing.schedule, {}, cost.by_position());
  const TangentResult tangent =
      simulate_with_tangents(swing.cloth, swing.set, {&direction, 1}, swing.schedule);

  ASSERT_TRUE(result.run.usable());
  EXPECT_EQ(result.run.position_m, tangent.run.position_m);
  const double expected = cost.of(tangent.position_tangent[0]);
  EXPECT_NEAR(along(result.gradient, swing, direction), expected, 1e-10 * std::abs(expected));
}

TEST(Adjoint, EqualsTheTangent) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Uniform uniform(seed);
    Swing swing(uniform);
    expect_adjoint_to_equal_tangent(swing, uniform);
  }
}

TEST(Adjoint, EqualsTheTangentAtTheStrainLimit) {
  for (const StrainLimitMode mode :
       {StrainLimitMode::positions, StrainLimitMode::rates_first, StrainLimitMode::consistent}) {
    for (const unsigned seed : {1u, 2u}) {
      SCOPED_TRACE(testing::Message() << "mode " << static_cast<int>(mode) << ", seed " << seed);
      Uniform uniform(seed);
      Swing swing(uniform);
      swing.cloth.strain_limit.mode = mode;
      swing.set.springs.critical_elongation.fill(0.03);
      expect_adjoint_to_equal_tangent(swing, uniform);
    }
  }
}

TEST(Adjoint, IsTheSameBitsOnEveryInstructionSet) {
  Uniform uniform(3);
  Swing swing(uniform);
  swing.cloth.held.back().motion = nullptr;
  const Cost cost(swing, uniform);
  const auto gradient = [&] {
    return simulate_with_gradient(swing.cloth, swing.set, swing.schedule, {}, cost.by_position())
        .gradient;
  };
  const CostGradient here = gradient();
  for (const InstructionSet& set : instruction_sets()) {
    SCOPED_TRACE(set);
    const OnInstructionSet on(set);
    const CostGradient there = gradient();
    EXPECT_EQ(there.by_springs.natural_length_m, here.by_springs.natural_length_m);
    EXPECT_EQ(there.by_springs.stiffness_n_per_m, here.by_springs.stiffness_n_per_m);
    EXPECT_EQ(there.by_springs.damping_ns_per_m, here.by_springs.damping_ns_per_m);
    EXPECT_EQ(there.by_mass_kg, here.by_mass_kg);
    EXPECT_EQ(there.by_start_position, here.by_start_position);
    EXPECT_EQ(there.by_start_velocity, here.by_start_velocity);
  }
}

TEST(Adjoint, EqualsTheTangentUnderWindAndDamping) {
  Uniform uniform(4);
  Swing swing(uniform);
  add_effect(swing.cloth, "wind", "test");
  add_effect(swing.cloth, "viscous_damping", "test");
  swing.set.effects = {{0.1, 0.2, -0.3, 0.4}, {0.7}};
  expect_adjoint_to_equal_tangent(swing, uniform);
}

TEST(Adjoint, EqualsTheTangentUnderEveryEffect) {
  for (const EffectEntry& entry : effect_registry()) {
    SCOPED_TRACE(entry.name);
    Uniform uniform(8);
    Swing swing = swing_under(entry, uniform);
    expect_adjoint_to_equal_tangent(swing, uniform);
  }
}

TEST(Adjoint, EqualsTheTangentUnderSeveralEffectsAtOnce) {
  Uniform uniform(9);
  Swing swing(uniform);
  for (const char* name : {"added_air_mass", "relaxation", "nonuniform_mass", "support_slip",
                           "support_motion", "bending_energy"}) {
    add_effect(swing.cloth, name, "test");
    swing.set.effects.push_back(
        effect_contract::random_parameters(find_effect(name, "test").describe(), uniform));
  }
  swing.schedule = {.frame_time_s = {0, 0.004, 0.01}, .time_step_s = 1e-4};
  expect_adjoint_to_equal_tangent(swing, uniform);
}

/// Returns (cost(value + by) - cost(value - by)) / 2 by.
template <class CostOf>
double difference(double& value, double by, const CostOf& cost_of) {
  const double here = value;
  value = here + by;
  const double ahead = cost_of();
  value = here - by;
  const double behind = cost_of();
  value = here;
  return (ahead - behind) / (2 * by);
}

TEST(Adjoint, KnowsSingleSpringsMassesAndForces) {
  // Given a cloth held at vertices, with its own factor on every spring and a force of its own on
  // every vertex in every interval,
  Uniform uniform(5);
  Swing swing(uniform);
  swing.cloth.held = {held_at(swing.cloth.mesh, 0, 0), held_at(swing.cloth.mesh, 0.4, 0)};
  const int vertices = swing.cloth.mesh.vertex_count();
  auto factors = std::make_shared<SpringFactors<SingleLane>>(
      SpringFactors<SingleLane>::ones(swing.cloth.mesh));
  for (size_t type = 0; type < kSpringTypes; ++type)
    for (int v = 0; v < vertices; ++v) {
      factors->stiffness[type][v] = uniform(0.7, 1.3);
      factors->natural_length[type][v] = uniform(0.95, 1.05);
    }
  SimulationFields fields{.spring_factors = factors, .force_n = {}};
  for (size_t f = 1; f < swing.schedule.frame_time_s.size(); ++f)
    fields.force_n.push_back(uniform.vectors(vertices, 1e-3));
  const Cost cost(swing, uniform);
  const auto cost_now = [&] {
    return cost.of(simulate_with_fields(swing.cloth, swing.set, swing.schedule, fields).position_m);
  };

  const CostGradient gradient =
      simulate_with_gradient(swing.cloth, swing.set, swing.schedule, fields, cost.by_position())
          .gradient;

  // then differences agree. A factor's derivative is the spring's own times the type's constant.
  const auto expect_near = [](double derivative, double expected) {
    EXPECT_NEAR(derivative, expected, 2e-6 * std::max(std::abs(expected), 1e-3));
  };
  for (size_t type = 0; type < kSpringTypes; ++type) {
    SCOPED_TRACE(type);
    const Spring spring = swing.cloth.springs[type][7];
    // shear_up is listed from below, but leaves the vertex above.
    const auto leaves = static_cast<size_t>(std::min(spring.a, spring.b));
    expect_near(
        gradient.by_springs.stiffness_n_per_m[type][leaves] *
            swing.set.springs.stiffness_n_per_m[type],
        difference(factors->stiffness[type][static_cast<Eigen::Index>(leaves)], 1e-5, cost_now));
    expect_near(gradient.by_springs.natural_length_m[type][leaves] *
                    swing.set.springs.natural_length_m[type],
                difference(factors->natural_length[type][static_cast<Eigen::Index>(leaves)], 1e-6,
                           cost_now));
  }
  for (const int v : {3, 14, 35})
    expect_near(gradient.by_mass_kg[v], difference(swing.cloth.mass_kg[v], 1e-9, cost_now));
  for (size_t f = 0; f < fields.force_n.size(); ++f)
    expect_near(gradient.by_force_n[f](1, 20),
                difference(fields.force_n[f](1, 20), 1e-6, cost_now));
}

/// Checks the derivatives by some vertices' masses against differences over `share` of a mass.
void expect_masses_to_agree(Swing& swing, double share, Uniform& uniform) {
  const Cost cost(swing, uniform);
  const CostGradient gradient =
      simulate_with_gradient(swing.cloth, swing.set, swing.schedule, {}, cost.by_position())
          .gradient;
  const double scale = gradient.by_mass_kg.cwiseAbs().maxCoeff();
  for (const int v : {0, 3, 9, 20, 35}) {  // 0 and 35 are held, a point between holds 3 and 9
    SCOPED_TRACE(testing::Message() << "vertex " << v);
    double& mass_kg = swing.cloth.mass_kg[v];
    const double expected = difference(mass_kg, share * mass_kg, [&] {
      return cost.of(simulate(swing.cloth, {&swing.set, 1}, swing.schedule).front().position_m);
    });
    EXPECT_NEAR(gradient.by_mass_kg[v], expected, 1e-6 * scale);
  }
}

TEST(Adjoint, KnowsMassesUnderEveryEffect) {
  for (const EffectEntry& entry : effect_registry()) {
    SCOPED_TRACE(entry.name);
    Uniform uniform(10);
    Swing swing = swing_under(entry, uniform);
    expect_masses_to_agree(swing, 1e-5, uniform);
  }
}

TEST(Adjoint, KnowsMassesAtTheStrainLimit) {
  for (const StrainLimitMode mode :
       {StrainLimitMode::positions, StrainLimitMode::rates_first, StrainLimitMode::consistent}) {
    SCOPED_TRACE(static_cast<int>(mode));
    Uniform uniform(11);
    Swing swing(uniform);
    swing.cloth.strain_limit.mode = mode;
    swing.set.springs.critical_elongation.fill(0.03);
    swing.schedule.frame_time_s = {0, 0.002, 0.004};
    // The share is so small that no spring reaches or leaves its limit.
    expect_masses_to_agree(swing, 1e-7, uniform);
  }
}

}  // namespace
}  // namespace clothfit
