#include "model/kernels/strain_limit.h"

// This source is compiled once for each instruction set, in a namespace of its own.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "model/kernels/strain_limit.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "model/kernels/lane_vector-inl.h"

#ifndef CLOTHFIT_MODEL_KERNELS_STRAIN_LIMIT_ONCE
#define CLOTHFIT_MODEL_KERNELS_STRAIN_LIMIT_ONCE
namespace clothfit {

/// Where the springs of a type begin and end: from [i, j] to [i + down, j + right].
struct SpringReach {
  int down = 0, right = 0;
};
inline constexpr SpringReach kReach[kSpringTypes] = {{1, 0},  {0, 1}, {1, 1},
                                                     {1, -1}, {2, 0}, {0, 2}};

/// What one pass works on; element (vertex * kLanes + lane) of each array is one vertex in one
/// lane.
struct LimitArrays {
  Mesh mesh;
  const LaneLimits<>& limits;
  const std::array<std::vector<SpringShares>, kSpringTypes>& shares;
  std::array<double*, 3> position_m;
  std::array<double*, 3> velocity_m_per_s;  ///< null: not corrected
  double steps_per_s = 0;
  LaneValue<> active = LaneValue<>::Ones();     ///< 1 in lanes to work on, else 0
  LaneValue<> shortened = LaneValue<>::Zero();  ///< counts the springs that a sweep has shortened
  LaneValue<> intolerable =
      LaneValue<>::Zero();  ///< set to 1 where a spring is longer than tolerated
};

}  // namespace clothfit
#endif

HWY_BEFORE_NAMESPACE();
namespace clothfit {
namespace {
namespace HWY_NAMESPACE {

enum class Pass {
  sweep,  ///< shortens springs
  check   ///< only looks for springs that are longer than tolerated
};

/// The springs of one type in the lanes from `lane` on.
template <Pass pass>
HWY_INLINE void visit(LimitArrays& arrays, size_t type, std::ptrdiff_t lane) {
  using Mask = hn::Mask<Tag>;
  const Tag d;
  const auto [down, right] = kReach[type];
  const std::ptrdiff_t columns = arrays.mesh.columns, rows = arrays.mesh.rows;
  const std::ptrdiff_t other = (down * columns + right) * kLanes;
  const std::array<double*, 3> position = arrays.position_m, velocity = arrays.velocity_m_per_s;
  const bool correct_velocity = velocity[0] != nullptr;
  const Vector one = hn::Set(d, 1.0);
  const Vector steps_per_s = hn::Set(d, arrays.steps_per_s);
  const Vector longest = hn::LoadU(d, arrays.limits.longest_m[type].data() + lane);
  const Vector tolerated = hn::LoadU(d, arrays.limits.tolerated_m[type].data() + lane);
  const Vector allowed = pass == Pass::sweep ? longest : tolerated;
  const Vector allowed2 = hn::Mul(allowed, allowed);
  const Mask active = hn::Gt(hn::LoadU(d, arrays.active.data() + lane), hn::Zero(d));
  Vector shortened = hn::LoadU(d, arrays.shortened.data() + lane);
  Vector intolerable = hn::LoadU(d, arrays.intolerable.data() + lane);

  const int reach = down > 0 ? down : right;
  for (int group = 0; group < 2; ++group) {
    for (std::ptrdiff_t i = 0; i + down < rows; ++i) {
      if (down > 0 && i / reach % 2 != group) continue;
      for (std::ptrdiff_t j = right < 0 ? 1 : 0; j < columns && j + right < columns; ++j) {
        if (down == 0 && j / reach % 2 != group) continue;
        const std::ptrdiff_t vertex = i * columns + j, self = vertex * kLanes + lane;
        const Vector3 along = load(position, self + other) - load(position, self);
        const Vector length2 = dot(along, along);
        const Mask exceeds = hn::And(active, hn::Gt(length2, allowed2));
        if (hn::AllFalse(d, exceeds)) continue;
        const SpringShares& shares = arrays.shares[type][static_cast<size_t>(vertex)];
        if (shares.first == 0 && shares.second == 0) continue;
        if (pass == Pass::check) {
          intolerable = hn::IfThenElse(exceeds, one, intolerable);
          continue;
        }
        shortened = hn::Add(shortened, hn::IfThenElseZero(exceeds, one));
        const Vector excess = hn::Sub(one, hn::Mul(longest, inverse_square_root(length2)));
        const auto move = [&](const std::array<double*, 3>& of, const Vector& share) HWY_ATTR {
          // Lanes that do not exceed keep their bits.
          const Vector3 first = hn::Mul(share, hn::Set(d, shares.first)) * along;
          const Vector3 second = hn::Mul(share, hn::Set(d, shares.second)) * along;
          const Vector3 a = load(of, self), b = load(of, self + other);
          store(select(exceeds, a + first, a), of, self);
          store(select(exceeds, b - second, b), of, self + other);
        };
        move(position, excess);
        if (correct_velocity) move(velocity, hn::Mul(steps_per_s, excess));
      }
    }
  }
  hn::StoreU(shortened, d, arrays.shortened.data() + lane);
  hn::StoreU(intolerable, d, arrays.intolerable.data() + lane);
}

template <Pass pass>
HWY_INLINE void visit_all(LimitArrays& arrays) {
  const Tag d;
  for (std::ptrdiff_t lane = 0; lane < kLanes; lane += static_cast<std::ptrdiff_t>(hn::Lanes(d)))
    for (size_t type = 0; type < kSpringTypes; ++type) visit<pass>(arrays, type, lane);
}

void sweep_springs(LimitArrays& arrays) {
  visit_all<Pass::sweep>(arrays);
}

void check_springs(LimitArrays& arrays) {
  visit_all<Pass::check>(arrays);
}

}  // namespace HWY_NAMESPACE
}  // namespace
}  // namespace clothfit
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace clothfit {
namespace {
HWY_EXPORT(sweep_springs);
HWY_EXPORT(check_springs);
}  // namespace

template <>
StrainLimiter<ExactLanes>::StrainLimiter(const Mesh& mesh,
                                         const Eigen::VectorXd& inverse_mass_per_kg)
    : mesh_(mesh) {
  for (size_t type = 0; type < kSpringTypes; ++type) {
    const auto [down, right] = kReach[type];
    shares_[type].resize(static_cast<size_t>(mesh.vertex_count()));
    for (int i = 0; i + down < mesh.rows; ++i) {
      for (int j = right < 0 ? 1 : 0; j < mesh.columns && j + right < mesh.columns; ++j) {
        const double first = inverse_mass_per_kg[mesh.vertex(i, j)];
        const double second = inverse_mass_per_kg[mesh.vertex(i + down, j + right)];
        if (first + second > 0)
          shares_[type][static_cast<size_t>(mesh.vertex(i, j))] = {first / (first + second),
                                                                   second / (first + second)};
      }
    }
  }
}

template <>
LimitOutcome<> StrainLimiter<ExactLanes>::limit_positions(const LaneLimits<>& limits,
                                                          LaneVectors<>& position_m) {
  LimitArrays arrays{.mesh = mesh_,
                     .limits = limits,
                     .shares = shares_,
                     .position_m = position_m.data(),
                     .velocity_m_per_s = {}};
  HWY_DYNAMIC_DISPATCH(sweep_springs)(arrays);
  return {.too_long = arrays.shortened};
}

template <>
LimitOutcome<> StrainLimiter<ExactLanes>::limit_consistently(const LaneLimits<>& limits,
                                                             int most_sweeps, double time_step_s,
                                                             LaneVectors<>& position_m,
                                                             LaneVectors<>& velocity_m_per_s) {
  LimitArrays arrays{.mesh = mesh_,
                     .limits = limits,
                     .shares = shares_,
                     .position_m = position_m.data(),
                     .velocity_m_per_s = velocity_m_per_s.data(),
                     .steps_per_s = 1 / time_step_s};
  LimitOutcome<> outcome;
  for (int n = 0; n < most_sweeps; ++n) {
    arrays.shortened.setZero();
    HWY_DYNAMIC_DISPATCH(sweep_springs)(arrays);
    if (n == 0) outcome.too_long = arrays.shortened;
    // A correction may lengthen springs that were visited before: look at all of them again.
    arrays.active = (arrays.shortened > 0).select(arrays.active, 0.0);
    if (!(arrays.active > 0).any()) return outcome;
    arrays.intolerable.setZero();
    HWY_DYNAMIC_DISPATCH(check_springs)(arrays);
    arrays.active = arrays.intolerable;
    if (!(arrays.active > 0).any()) return outcome;
  }
  outcome.unmet = arrays.active;
  return outcome;
}

}  // namespace clothfit
#endif
