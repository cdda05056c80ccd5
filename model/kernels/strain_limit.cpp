#include "model/kernels/strain_limit.h"

#include <algorithm>

#include "model/kernels/limit_arrays.h"

// This source is compiled once for each instruction set, in a namespace of its own.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "model/kernels/strain_limit.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "model/kernels/lane_vector-inl.h"
#include "model/kernels/single_limit-inl.h"

HWY_BEFORE_NAMESPACE();
namespace clothfit {
namespace {
namespace HWY_NAMESPACE {

/// The bounds of the springs of one group, in the lanes from `lane` on.
template <class L>
struct GroupLimit {
  std::ptrdiff_t lane;
  std::ptrdiff_t offset;  ///< from a spring's first end to its second, in elements
  Vector<L> longest;
  Vector<L> allowed2;  ///< square of the length that springs may have; infinite in idle lanes
  const typename L::Number* first_share;
  const typename L::Number* second_share;
};

/// Lists the springs of `group` that may be longer than allowed in any lane and returns how many.
/// It takes no branch, which would be hard to predict. The springs are measured again, to the bit,
/// before anything is done, so this may round as it likes within its margin.
template <class L>
HWY_INLINE size_t list_long(const std::array<const typename L::Number*, 3>& position_m,
                            const GroupLimit<L>& limit, const SpringGroup& group,
                            std::int32_t* found) {
  const Tag<L> d;
  const std::array<const typename L::Number*, 3> position = position_m;
  const Vector<L> from2 =
      hn::Mul(limit.allowed2, hn::Set(d, static_cast<typename L::Number>(1 - 1e-6)));
  size_t count = 0;
  for (const std::int32_t vertex : group) {
    const std::ptrdiff_t self = vertex * L::kCount + limit.lane;
    const Vector3<Vector<L>> along =
        load(d, position, self + limit.offset) - load(d, position, self);
    const Vector<L> length2 = fused_squared_length(along);
    found[count] = vertex;
    count += hn::AllFalse(d, hn::Gt(length2, from2)) ? 0 : 1;
  }
  return count;
}

/// Returns the lanes in which the spring that leaves `vertex` is longer than allowed.
template <class L>
HWY_INLINE hn::Mask<Tag<L>> exceeds(const std::array<const typename L::Number*, 3>& position,
                                    const GroupLimit<L>& limit, std::int32_t vertex) {
  const Tag<L> d;
  const std::ptrdiff_t self = vertex * L::kCount + limit.lane;
  const Vector3<Vector<L>> along = load(d, position, self + limit.offset) - load(d, position, self);
  return hn::Gt(squared_length(along), limit.allowed2);
}

/// Shortens the springs of one group that leave `n` vertices, in the lanes in which they are too
/// long. If `lanes` is not null it names the lanes, kMaskBytes for each.
template <class L, size_t n>
HWY_INLINE void shorten(LimitArrays<L>& arrays, const GroupLimit<L>& limit,
                        const std::int32_t* vertices, const std::uint8_t* lanes,
                        Vector<L>& shortened) {
  using V = Vector<L>;
  using Number = typename L::Number;
  const Tag<L> d;
  const std::array<Number*, 3> position = arrays.position_m, velocity = arrays.velocity_m_per_s;
  const V one = hn::Set(d, Number{1});
  std::ptrdiff_t self[n];
  Vector3<V> along[n];
  hn::Mask<Tag<L>> too_long[n];
  V length2[n], excess[n];
  for (size_t s = 0; s < n; ++s) {
    self[s] = vertices[s] * L::kCount + limit.lane;
    along[s] = load(d, position, self[s] + limit.offset) - load(d, position, self[s]);
    length2[s] = squared_length(along[s]);
    too_long[s] = lanes == nullptr ? hn::Gt(length2[s], limit.allowed2)
                                   : hn::LoadMaskBits(d, lanes + s * kMaskBytes);
    shortened = hn::Add(shortened, hn::IfThenElseZero(too_long[s], one));
  }
  if constexpr (kMayContract<V>) {
    twice_inverse_square_roots(length2, excess);
    const V half = hn::Mul(hn::Set(d, 0.5f), limit.longest);
    for (size_t s = 0; s < n; ++s) excess[s] = minus_product(one, half, excess[s]);
  } else {
    V inverse[n];
    inverse_square_roots(length2, inverse);
    for (size_t s = 0; s < n; ++s) excess[s] = minus_product(one, limit.longest, inverse[s]);
  }
  const auto move = [&](size_t s, const std::array<Number*, 3>& of, const V& share) HWY_ATTR {
    // Lanes that do not exceed keep their bits.
    const V first = hn::Mul(share, hn::Set(d, limit.first_share[vertices[s]]));
    const V second = hn::Mul(share, hn::Set(d, limit.second_share[vertices[s]]));
    const std::ptrdiff_t other = self[s] + limit.offset;
    const Vector3<V> a = load(d, of, self[s]), b = load(d, of, other);
    store(select(too_long[s], mul_add(first, along[s], a), a), d, of, self[s]);
    store(select(too_long[s], minus_product(b, second, along[s]), b), d, of, other);
  };
  for (size_t s = 0; s < n; ++s) move(s, position, excess[s]);
  if (velocity[0] != nullptr) {
    const V steps_per_s = hn::Set(d, arrays.steps_per_s);
    for (size_t s = 0; s < n; ++s) move(s, velocity, hn::Mul(steps_per_s, excess[s]));
  }
}

/// Shortens `count` springs of one group.
template <class L>
HWY_INLINE void shorten(LimitArrays<L>& arrays, const GroupLimit<L>& limit,
                        const std::int32_t* vertices, const std::uint8_t* lanes, size_t count,
                        Vector<L>& shortened) {
  constexpr size_t kAtOnce = 3;  // more do not fit the registers
  size_t n = 0;
  const auto lanes_of = [&](size_t k) {
    return lanes == nullptr ? nullptr : lanes + k * kMaskBytes;
  };
  for (; n + kAtOnce <= count; n += kAtOnce)
    shorten<L, kAtOnce>(arrays, limit, vertices + n, lanes_of(n), shortened);
  for (; n < count; ++n) shorten<L, 1>(arrays, limit, vertices + n, lanes_of(n), shortened);
}

template <class L, LimitPass pass>
HWY_INLINE void visit(LimitArrays<L>& arrays, std::ptrdiff_t lane) {
  using V = Vector<L>;
  using Number = typename L::Number;
  const Tag<L> d;
  const std::array<const Number*, 3> position = {arrays.position_m[0], arrays.position_m[1],
                                                 arrays.position_m[2]};
  const auto active = hn::Gt(hn::LoadU(d, arrays.active.data() + lane), hn::Zero(d));
  const auto& allowed_m =
      pass == LimitPass::check ? arrays.limits.tolerated_m : arrays.limits.longest_m;
  const auto limit_of = [&](size_t type) HWY_ATTR {
    const V allowed = hn::LoadU(d, allowed_m[type].data() + lane);
    return GroupLimit<L>{.lane = lane,
                         .offset = offset_of(arrays.mesh, type) * L::kCount,
                         .longest = hn::LoadU(d, arrays.limits.longest_m[type].data() + lane),
                         .allowed2 = hn::IfThenElse(active, hn::Mul(allowed, allowed), hn::Inf(d)),
                         .first_share = arrays.shares[type].first.data(),
                         .second_share = arrays.shares[type].second.data()};
  };
  V shortened = hn::LoadU(d, arrays.shortened.data() + lane);
  std::int32_t* found = arrays.found.data();
  if constexpr (pass == LimitPass::rates_first) {
    size_t counts[kSpringGroups];
    std::uint8_t* lanes = arrays.found_lanes.data();
    for (size_t g = 0; g < kSpringGroups; ++g) {
      const GroupLimit<L> limit = limit_of(g / 2);
      counts[g] = list_long<L>(position, limit, arrays.groups[g], found);
      for (size_t n = 0; n < counts[g]; ++n, ++found, lanes += kMaskBytes)
        hn::StoreMaskBits(d, exceeds<L>(position, limit, *found), lanes);
    }
    found = arrays.found.data();
    lanes = arrays.found_lanes.data();
    for (size_t g = 0; g < kSpringGroups; ++g) {
      shorten<L>(arrays, limit_of(g / 2), found, lanes, counts[g], shortened);
      found += counts[g];
      lanes += counts[g] * kMaskBytes;
    }
  } else {
    for (size_t g = 0; g < kSpringGroups; ++g) {
      const GroupLimit<L> limit = limit_of(g / 2);
      const size_t count = list_long<L>(position, limit, arrays.groups[g], found);
      if constexpr (pass == LimitPass::sweep) {
        shorten<L>(arrays, limit, found, nullptr, count, shortened);
      } else {
        for (size_t n = 0; n < count; ++n)
          hn::BlendedStore(hn::Set(d, Number{1}), exceeds<L>(position, limit, found[n]), d,
                           arrays.intolerable.data() + lane);
      }
    }
  }
  hn::StoreU(shortened, d, arrays.shortened.data() + lane);
}

template <class L, LimitPass pass>
HWY_INLINE void visit(LimitArrays<L>& arrays) {
  if constexpr (L::kCount == 1) {
    for (size_t type = 0; type < kSpringTypes; ++type) visit_along<pass>(arrays, type);
  } else {
    const auto size = static_cast<std::ptrdiff_t>(hn::Lanes(Tag<L>()));
    for (std::ptrdiff_t lane = 0; lane < L::kCount; lane += size) visit<L, pass>(arrays, lane);
  }
}

void look_single(LimitArrays<SingleLane>& arrays) {
  look_along(arrays);
}
void sweep_exact(LimitArrays<ExactLanes>& arrays) {
  visit<ExactLanes, LimitPass::sweep>(arrays);
}
void sweep_fast(LimitArrays<FastLanes>& arrays) {
  visit<FastLanes, LimitPass::sweep>(arrays);
}
void sweep_single(LimitArrays<SingleLane>& arrays) {
  visit<SingleLane, LimitPass::sweep>(arrays);
}
void rates_first_exact(LimitArrays<ExactLanes>& arrays) {
  visit<ExactLanes, LimitPass::rates_first>(arrays);
}
void rates_first_fast(LimitArrays<FastLanes>& arrays) {
  visit<FastLanes, LimitPass::rates_first>(arrays);
}
void rates_first_single(LimitArrays<SingleLane>& arrays) {
  visit<SingleLane, LimitPass::rates_first>(arrays);
}
void check_exact(LimitArrays<ExactLanes>& arrays) {
  visit<ExactLanes, LimitPass::check>(arrays);
}
void check_fast(LimitArrays<FastLanes>& arrays) {
  visit<FastLanes, LimitPass::check>(arrays);
}
void check_single(LimitArrays<SingleLane>& arrays) {
  visit<SingleLane, LimitPass::check>(arrays);
}

}  // namespace HWY_NAMESPACE
}  // namespace
}  // namespace clothfit
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace clothfit {
namespace {

HWY_EXPORT(look_single);
HWY_EXPORT(sweep_exact);
HWY_EXPORT(sweep_fast);
HWY_EXPORT(sweep_single);
HWY_EXPORT(rates_first_exact);
HWY_EXPORT(rates_first_fast);
HWY_EXPORT(rates_first_single);
HWY_EXPORT(check_exact);
HWY_EXPORT(check_fast);
HWY_EXPORT(check_single);

void sweep(LimitArrays<ExactLanes>& arrays) {
  HWY_DYNAMIC_DISPATCH(sweep_exact)(arrays);
}
void sweep(LimitArrays<FastLanes>& arrays) {
  HWY_DYNAMIC_DISPATCH(sweep_fast)(arrays);
}
void sweep(LimitArrays<SingleLane>& arrays) {
  HWY_DYNAMIC_DISPATCH(sweep_single)(arrays);
}
void sweep_by_first_rates(LimitArrays<ExactLanes>& arrays) {
  HWY_DYNAMIC_DISPATCH(rates_first_exact)(arrays);
}
void sweep_by_first_rates(LimitArrays<FastLanes>& arrays) {
  HWY_DYNAMIC_DISPATCH(rates_first_fast)(arrays);
}
void sweep_by_first_rates(LimitArrays<SingleLane>& arrays) {
  HWY_DYNAMIC_DISPATCH(rates_first_single)(arrays);
}
void check(LimitArrays<ExactLanes>& arrays) {
  HWY_DYNAMIC_DISPATCH(check_exact)(arrays);
}
void check(LimitArrays<FastLanes>& arrays) {
  HWY_DYNAMIC_DISPATCH(check_fast)(arrays);
}
void check(LimitArrays<SingleLane>& arrays) {
  HWY_DYNAMIC_DISPATCH(check_single)(arrays);
}

template <class L>
void begin(LimitArrays<L>& arrays) {
  if constexpr (L::kCount == 1) HWY_DYNAMIC_DISPATCH(look_single)(arrays);
}

}  // namespace

template <class L>
StrainLimiter<L>::StrainLimiter(const Mesh& mesh, const Eigen::VectorXd& inverse_mass_per_kg)
    : mesh_(mesh) {
  using Number = typename L::Number;
  const auto vertices = static_cast<size_t>(mesh.vertex_count());
  for (size_t type = 0; type < kSpringTypes; ++type) {
    const auto [down, right] = kSpringReach[type];
    constexpr size_t kPadding = 8;  // a vector of neighbours may reach past the last one
    shares_[type].first.resize(vertices + kPadding);
    shares_[type].second.resize(vertices + kPadding);
    for (int i = 0; i + down < mesh.rows; ++i) {
      for (int j = right < 0 ? 1 : 0; j < mesh.columns && j + right < mesh.columns; ++j) {
        const int vertex = mesh.vertex(i, j);
        const double first = inverse_mass_per_kg[vertex];
        const double second = inverse_mass_per_kg[mesh.vertex(i + down, j + right)];
        if (!(first + second > 0)) continue;
        shares_[type].first[static_cast<size_t>(vertex)] =
            static_cast<Number>(first / (first + second));
        shares_[type].second[static_cast<size_t>(vertex)] =
            static_cast<Number>(second / (first + second));
        const int place = down > 0 ? i / down : j / right;
        groups_[2 * type + static_cast<size_t>(place % 2)].push_back(vertex);
      }
    }
    // The walk goes to and fro: the next begins with what the end of the last brought into the
    // cache.
    std::ranges::reverse(groups_[2 * type]);
  }
  size_t springs = 0;
  for (const SpringGroup& group : groups_) springs += group.size();
  found_.resize(springs);
  found_lanes_.resize(springs * kMaskBytes);
  if constexpr (L::kCount == 1) {
    const size_t words = vertices / 64 + 2;
    single_.moved.resize(words);
    for (VertexSet& set : single_.too_long) set.resize(words);
    for (size_t g = 0; g < kSpringGroups; ++g) {
      single_.groups[g].resize(words);
      for (const std::int32_t vertex : groups_[g]) insert(single_.groups[g], vertex);
    }
  }
}

template <class L>
LimitArrays<L> StrainLimiter<L>::arrays(const LaneLimits<L>& limits, LaneVectors<L>& position_m,
                                        std::vector<LimitMove>* moves) {
  return {.mesh = mesh_,
          .limits = limits,
          .shares = shares_,
          .groups = groups_,
          .found = found_,
          .found_lanes = found_lanes_,
          .single = single_,
          .position_m = position_m.data(),
          .velocity_m_per_s = {},
          .moves = moves};
}

template <class L>
LimitOutcome<L> StrainLimiter<L>::limit(const StrainLimit& how, const LaneLimits<L>& limits,
                                        double time_step_s, LaneVectors<L>& position_m,
                                        LaneVectors<L>& velocity_m_per_s,
                                        std::vector<LimitMove>* moves) {
  switch (how.mode) {
    case StrainLimitMode::positions:
      return limit_positions(limits, position_m, moves);
    case StrainLimitMode::rates_first:
      return limit_by_first_rates(limits, position_m, moves);
    case StrainLimitMode::consistent:
      return limit_consistently(limits, how.most_sweeps, time_step_s, position_m, velocity_m_per_s,
                                moves);
    case StrainLimitMode::off:
      break;
  }
  return {};
}

template <class L>
LimitOutcome<L> StrainLimiter<L>::limit_positions(const LaneLimits<L>& limits,
                                                  LaneVectors<L>& position_m,
                                                  std::vector<LimitMove>* moves) {
  LimitArrays<L> arrays = this->arrays(limits, position_m, moves);
  begin(arrays);
  sweep(arrays);
  return {.too_long = arrays.shortened};
}

template <class L>
LimitOutcome<L> StrainLimiter<L>::limit_by_first_rates(const LaneLimits<L>& limits,
                                                       LaneVectors<L>& position_m,
                                                       std::vector<LimitMove>* moves) {
  LimitArrays<L> arrays = this->arrays(limits, position_m, moves);
  begin(arrays);
  sweep_by_first_rates(arrays);
  return {.too_long = arrays.shortened};
}

template <class L>
LimitOutcome<L> StrainLimiter<L>::limit_consistently(const LaneLimits<L>& limits, int most_sweeps,
                                                     double time_step_s, LaneVectors<L>& position_m,
                                                     LaneVectors<L>& velocity_m_per_s,
                                                     std::vector<LimitMove>* moves) {
  LimitArrays<L> arrays = this->arrays(limits, position_m, moves);
  arrays.velocity_m_per_s = velocity_m_per_s.data();
  arrays.steps_per_s = static_cast<typename L::Number>(1 / time_step_s);
  begin(arrays);
  LimitOutcome<L> outcome;
  for (int n = 0; n < most_sweeps; ++n) {
    arrays.shortened.setZero();
    sweep(arrays);
    if (n == 0) outcome.too_long = arrays.shortened;
    // A correction may lengthen springs that were visited before, so all of them are looked at
    // again.
    arrays.active = (arrays.shortened > 0).select(arrays.active, 0);
    if (!(arrays.active > 0).any()) return outcome;
    arrays.intolerable.setZero();
    check(arrays);
    arrays.active = arrays.intolerable;
    if (!(arrays.active > 0).any()) return outcome;
  }
  outcome.unmet = arrays.active;
  return outcome;
}

template class StrainLimiter<ExactLanes>;
template class StrainLimiter<FastLanes>;
template class StrainLimiter<SingleLane>;

}  // namespace clothfit
#endif
