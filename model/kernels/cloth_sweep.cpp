#include "model/kernels/cloth_sweep.h"

#include <algorithm>
#include <utility>

// This source is compiled once for each instruction set, in a namespace of its own.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "model/kernels/cloth_sweep.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "model/kernels/lane_vector-inl.h"

#ifndef CLOTHFIT_MODEL_KERNELS_CLOTH_SWEEP_ONCE
#define CLOTHFIT_MODEL_KERNELS_CLOTH_SWEEP_ONCE
namespace clothfit {
namespace {

/// What a sweep works on; element (vertex * kLanes + lane) of each array is one vertex in one lane.
struct SweepArrays {
  Mesh mesh;
  const LaneSprings<>& springs;
  std::array<const double*, 3> position_m;
  std::array<const double*, 3> velocity_m_per_s;
  double* scratch;  ///< kScratchRows rows of columns x kLanes
};

struct EulerArrays {
  std::array<double*, 3> position_m;
  std::array<double*, 3> velocity_m_per_s;
  std::array<const double*, 3> gravity_m_per_s2;  ///< per lane
  std::array<const double*, 3> effect_force_n;    ///< or null
  const double* inverse_mass_per_kg;              ///< per vertex
  double time_step_s;
};

/// Three coordinates of the forces that arrive from one row above, and twice three of those from
/// two rows above: one for the row at hand, one for the next.
constexpr int kScratchRows = 9;

}  // namespace
}  // namespace clothfit
#endif

HWY_BEFORE_NAMESPACE();
namespace clothfit {
namespace {
namespace HWY_NAMESPACE {

struct SpringConstants {
  Vector stiffness, damping, natural_length;
};

/// What a spring to a vertex at `along` that moves with `rate`, both relative to its own, exerts.
HWY_INLINE Vector3 pull(const SpringConstants& spring, const Vector3& along, const Vector3& rate) {
  const Vector length2 = dot(along, along);
  const Vector inverse = inverse_square_root(length2);
  const Vector length = hn::Mul(length2, inverse);
  const Vector stretching = hn::Mul(dot(along, rate), inverse);
  const Vector tension = hn::Add(hn::Mul(spring.stiffness, hn::Sub(length, spring.natural_length)),
                                 hn::Mul(spring.damping, stretching));
  return hn::Mul(tension, inverse) * along;
}

/// Calls `sink(vertex, element, force, velocity, position)` for every vertex in row-major order,
/// for as many lanes at once as a vector holds. The sink may move the vertex: no spring of a later
/// one reaches back to it.
template <class Sink>
HWY_INLINE void sweep(const SweepArrays& arrays, const Sink& sink) {
  const Tag d;
  const std::ptrdiff_t columns = arrays.mesh.columns, rows = arrays.mesh.rows;
  const std::ptrdiff_t width = columns * kLanes;
  // Copies, because the compiler must take a store for one that may change what `arrays` holds.
  const std::array<const double*, 3> positions = arrays.position_m;
  const std::array<const double*, 3> velocities = arrays.velocity_m_per_s;
  double* const scratch = arrays.scratch;
  const auto scratch_rows = [&](int n) HWY_ATTR {
    return std::array<double*, 3>{scratch + n * width, scratch + (n + 1) * width,
                                  scratch + (n + 2) * width};
  };
  std::fill_n(scratch, kScratchRows * width, 0.0);
  const std::array<double*, 3> from_above = scratch_rows(0);

  for (std::ptrdiff_t lane = 0; lane < kLanes; lane += static_cast<std::ptrdiff_t>(hn::Lanes(d))) {
    SpringConstants constants[kSpringTypes];
    for (size_t type = 0; type < kSpringTypes; ++type)
      constants[type] = {hn::LoadU(d, arrays.springs.stiffness_n_per_m[type].data() + lane),
                         hn::LoadU(d, arrays.springs.damping_ns_per_m[type].data() + lane),
                         hn::LoadU(d, arrays.springs.natural_length_m[type].data() + lane)};
    for (std::ptrdiff_t i = 0; i < rows; ++i) {
      const std::array<double*, 3> from_two_above = scratch_rows(i % 2 == 0 ? 3 : 6);
      const bool one_below = i + 1 < rows, two_below = i + 2 < rows;
      // What the vertices just passed sent to the right, and below to the right.
      Vector3 right = zero(), right_two = zero(), right_two_next = zero(), down_right = zero();
      Vector3 to_below = zero();  // what the vertex below the one just passed has got so far
      for (std::ptrdiff_t j = 0; j < columns; ++j) {
        const std::ptrdiff_t at = j * kLanes + lane, self = i * width + at;
        const Vector3 position = load(positions, self), velocity = load(velocities, self);
        const auto pull_to = [&](SpringType type, std::ptrdiff_t offset) HWY_ATTR {
          return pull(constants[type], load(positions, self + offset) - position,
                      load(velocities, self + offset) - velocity);
        };
        Vector3 force = zero() - (load(from_above, at) + load(from_two_above, at));
        force = force - right;
        force = force - right_two;
        right_two = right_two_next;
        if (j + 1 < columns) {
          right = pull_to(structural_s, kLanes);
          force = force + right;
        }
        if (j + 2 < columns) {
          right_two_next = pull_to(flexion_s, 2 * kLanes);
          force = force + right_two_next;
        }
        if (two_below) {
          const Vector3 down_two = pull_to(flexion_t, 2 * width);
          force = force + down_two;
          store(down_two, from_two_above, at);
        }
        if (one_below) {
          if (j > 0) {
            const Vector3 down_left = pull_to(shear_up, width - kLanes);
            force = force + down_left;
            store(to_below + down_left, from_above, at - kLanes);
          }
          const Vector3 down = pull_to(structural_t, width);
          force = force + down;
          to_below = down + down_right;
          if (j + 1 < columns) {
            down_right = pull_to(shear_down, width + kLanes);
            force = force + down_right;
          } else {
            store(to_below, from_above, at);
          }
        }
        sink(i * columns + j, self, force, velocity, position);
      }
    }
  }
}

void add_forces(const SweepArrays& arrays, const std::array<double*, 3>& force_n) {
  const std::array<double*, 3> out = force_n;
  sweep(arrays, [&](std::ptrdiff_t, std::ptrdiff_t self, const Vector3& force, const Vector3&,
                    const Vector3&) HWY_ATTR { store(load(out, self) + force, out, self); });
}

void step_euler(const SweepArrays& arrays, const EulerArrays& euler) {
  const Tag d;
  const EulerArrays to = euler;
  const Vector h = hn::Set(d, to.time_step_s);
  const bool any_effect = to.effect_force_n[0] != nullptr;
  sweep(arrays, [&](std::ptrdiff_t vertex, std::ptrdiff_t self, const Vector3& springs,
                    const Vector3& velocity, const Vector3& position) HWY_ATTR {
    const Vector3 force = any_effect ? springs + load(to.effect_force_n, self) : springs;
    const Vector3 gravity = load(to.gravity_m_per_s2, self % kLanes);
    const Vector inverse_mass = hn::Set(d, to.inverse_mass_per_kg[vertex]);
    const Vector3 new_velocity = velocity + h * (gravity + inverse_mass * force);
    store(new_velocity, to.velocity_m_per_s, self);
    store(position + h * new_velocity, to.position_m, self);
  });
}

}  // namespace HWY_NAMESPACE
}  // namespace
}  // namespace clothfit
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace clothfit {
namespace {
HWY_EXPORT(add_forces);
HWY_EXPORT(step_euler);
}  // namespace

template <>
ClothSweep<ExactLanes>::ClothSweep(const Mesh& mesh)
    : mesh_(mesh), scratch_(static_cast<size_t>(kScratchRows * mesh.columns) * kLanes) {}

template <>
void ClothSweep<ExactLanes>::add_spring_forces(const LaneSprings<>& springs,
                                               const LaneVectors<>& position_m,
                                               const LaneVectors<>& velocity_m_per_s,
                                               LaneVectors<>& force_n) {
  const SweepArrays arrays{mesh_, springs, position_m.data(), velocity_m_per_s.data(),
                           scratch_.data()};
  HWY_DYNAMIC_DISPATCH(add_forces)(arrays, force_n.data());
}

template <>
void ClothSweep<ExactLanes>::step_euler(const LaneSprings<>& springs, const LaneVector<>& gravity,
                                        const Eigen::VectorXd& inverse_mass_per_kg,
                                        const LaneVectors<>* effect_force_n, double time_step_s,
                                        LaneVectors<>& position_m,
                                        LaneVectors<>& velocity_m_per_s) {
  const SweepArrays arrays{mesh_, springs, std::as_const(position_m).data(),
                           std::as_const(velocity_m_per_s).data(), scratch_.data()};
  const EulerArrays euler{
      .position_m = position_m.data(),
      .velocity_m_per_s = velocity_m_per_s.data(),
      .gravity_m_per_s2 = {gravity.x.data(), gravity.y.data(), gravity.z.data()},
      .effect_force_n =
          effect_force_n != nullptr ? effect_force_n->data() : std::array<const double*, 3>{},
      .inverse_mass_per_kg = inverse_mass_per_kg.data(),
      .time_step_s = time_step_s};
  HWY_DYNAMIC_DISPATCH(step_euler)(arrays, euler);
}

}  // namespace clothfit
#endif
