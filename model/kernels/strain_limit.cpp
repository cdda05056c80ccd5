#include "model/kernels/strain_limit.h"

#include <utility>

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

/// What one sweep works on; element (vertex * kLanes + lane) of each array is one vertex in one
/// lane.
struct LimitArrays {
  Mesh mesh;
  const LaneLimits& limits;
  const std::array<std::vector<SpringShares>, kSpringTypes>& shares;
  std::array<double*, 3> position_m;
  std::array<double*, 3> velocity_m_per_s;  ///< null: not corrected
  double steps_per_s = 0;
  LaneValue active = LaneValue::Ones();    ///< 1 in lanes to work on, else 0
  LaneValue found = LaneValue::Zero();     ///< set to 1 where a spring was longer than tolerated
  LaneValue too_long = LaneValue::Zero();  ///< counts the springs that were too long
};

}  // namespace clothfit
#endif

HWY_BEFORE_NAMESPACE();
namespace clothfit {
namespace {
namespace HWY_NAMESPACE {

/// The springs of one type in the lanes from `lane` on.
HWY_INLINE void limit_type(LimitArrays& arrays, size_t type, std::ptrdiff_t lane) {
  using Mask = hn::Mask<Tag>;
  const Tag d;
  const auto [down, right] = kReach[type];
  const std::ptrdiff_t columns = arrays.mesh.columns, rows = arrays.mesh.rows;
  const std::ptrdiff_t other = (down * columns + right) * kLanes;
  const std::array<double*, 3> position = arrays.position_m, velocity = arrays.velocity_m_per_s;
  const bool correct_velocity = velocity[0] != nullptr;
  const Vector steps_per_s = hn::Set(d, arrays.steps_per_s);
  const Vector longest = hn::LoadU(d, arrays.limits.longest_m[type].data() + lane);
  const Vector tolerated = hn::LoadU(d, arrays.limits.tolerated_m[type].data() + lane);
  const Vector longest2 = hn::Mul(longest, longest), tolerated2 = hn::Mul(tolerated, tolerated);
  const Mask active = hn::Gt(hn::LoadU(d, arrays.active.data() + lane), hn::Zero(d));
  Vector too_long = hn::LoadU(d, arrays.too_long.data() + lane);
  Vector found = hn::LoadU(d, arrays.found.data() + lane);

  const int reach = down > 0 ? down : right;
  for (int group = 0; group < 2; ++group) {
    for (std::ptrdiff_t i = 0; i + down < rows; ++i) {
      if (down > 0 && i / reach % 2 != group) continue;
      for (std::ptrdiff_t j = right < 0 ? 1 : 0; j < columns && j + right < columns; ++j) {
        if (down == 0 && j / reach % 2 != group) continue;
        const std::ptrdiff_t vertex = i * columns + j, self = vertex * kLanes + lane;
        const Vector3 along = load(position, self + other) - load(position, self);
        const Vector length2 = dot(along, along);
        const Mask exceeds = hn::And(active, hn::Gt(length2, longest2));
        if (hn::AllFalse(d, exceeds)) continue;
        found =
            hn::IfThenElse(hn::And(exceeds, hn::Gt(length2, tolerated2)), hn::Set(d, 1.0), found);
        too_long = hn::Add(too_long, hn::IfThenElseZero(exceeds, hn::Set(d, 1.0)));
        const Vector excess =
            hn::Sub(hn::Set(d, 1.0), hn::Mul(longest, inverse_square_root(length2)));
        const Vector3 correction = hn::IfThenElseZero(exceeds, excess) * along;
        const SpringShares& shares = arrays.shares[type][static_cast<size_t>(vertex)];
        const Vector3 first = hn::Set(d, shares.first) * correction;
        const Vector3 second = hn::Set(d, shares.second) * correction;
        store(load(position, self) + first, position, self);
        store(load(position, self + other) - second, position, self + other);
        if (!correct_velocity) continue;
        store(load(velocity, self) + steps_per_s * first, velocity, self);
        store(load(velocity, self + other) - steps_per_s * second, velocity, self + other);
      }
    }
  }
  hn::StoreU(too_long, d, arrays.too_long.data() + lane);
  hn::StoreU(found, d, arrays.found.data() + lane);
}

void limit(LimitArrays& arrays) {
  const Tag d;
  for (std::ptrdiff_t lane = 0; lane < kLanes; lane += static_cast<std::ptrdiff_t>(hn::Lanes(d)))
    for (size_t type = 0; type < kSpringTypes; ++type) limit_type(arrays, type, lane);
}

}  // namespace HWY_NAMESPACE
}  // namespace
}  // namespace clothfit
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace clothfit {
namespace {
HWY_EXPORT(limit);

std::array<double*, 3> data_of(LaneVectors& vectors) {
  return {vectors.x.data(), vectors.y.data(), vectors.z.data()};
}
}  // namespace

StrainLimiter::StrainLimiter(const Mesh& mesh, const Eigen::VectorXd& inverse_mass_per_kg)
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

LaneValue StrainLimiter::limit_positions(const LaneLimits& limits, LaneVectors& position_m) {
  LimitArrays arrays{.mesh = mesh_,
                     .limits = limits,
                     .shares = shares_,
                     .position_m = data_of(position_m),
                     .velocity_m_per_s = {}};
  HWY_DYNAMIC_DISPATCH(limit)(arrays);
  return arrays.too_long;
}

LaneValue StrainLimiter::limit_consistently(const LaneLimits& limits, int most_sweeps,
                                            double time_step_s, LaneVectors& position_m,
                                            LaneVectors& velocity_m_per_s) {
  LimitArrays arrays{.mesh = mesh_,
                     .limits = limits,
                     .shares = shares_,
                     .position_m = data_of(position_m),
                     .velocity_m_per_s = data_of(velocity_m_per_s),
                     .steps_per_s = 1 / time_step_s};
  LaneValue too_long = LaneValue::Zero();
  for (int n = 0; n < most_sweeps && (arrays.active > 0).any(); ++n) {
    HWY_DYNAMIC_DISPATCH(limit)(arrays);
    if (n == 0) too_long = arrays.too_long;
    arrays.active = arrays.found;
    arrays.found.setZero();
  }
  return too_long;
}

}  // namespace clothfit
#endif
