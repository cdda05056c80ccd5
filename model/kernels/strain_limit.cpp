#include "model/kernels/strain_limit.h"

#include <algorithm>
#include <bit>

#include "model/kernels/spring_reach.h"

// This source is compiled once for each instruction set, in a namespace of its own.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "model/kernels/strain_limit.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "model/kernels/lane_vector-inl.h"

#ifndef CLOTHFIT_MODEL_KERNELS_STRAIN_LIMIT_ONCE
#define CLOTHFIT_MODEL_KERNELS_STRAIN_LIMIT_ONCE
namespace clothfit {

inline std::ptrdiff_t offset_of(const Mesh& mesh, size_t type) {
  return kSpringReach[type].offset(mesh);
}

/// What the passes over the springs work on; element (vertex * kCount + lane) of each array is one
/// vertex in one lane.
template <class L>
struct LimitArrays {
  using Number = typename L::Number;
  Mesh mesh;
  const LaneLimits<L>& limits;
  const std::array<SpringShares<Number>, kSpringTypes>& shares;
  const std::array<std::array<VertexSet, 2>, kSpringTypes>& groups;
  std::array<VertexSet, kSpringTypes>& too_long;
  VertexSet& moved;
  std::vector<std::int32_t>& found;
  std::array<Number*, 3> position_m;
  std::array<Number*, 3> velocity_m_per_s;  ///< null: not corrected
  std::vector<LimitMove>* moves = nullptr;  ///< of a single lane, where they are asked for
  Number steps_per_s = 0;
  LaneValue<L> active = LaneValue<L>::Ones();     ///< 1 in lanes to work on, else 0
  LaneValue<L> shortened = LaneValue<L>::Zero();  ///< counts the springs that a sweep has shortened
  LaneValue<L> intolerable =
      LaneValue<L>::Zero();  ///< set to 1 where a spring is longer than tolerated
};

inline void insert(VertexSet& set, std::ptrdiff_t vertex) {
  set[static_cast<size_t>(vertex / 64)] |= std::uint64_t{1} << (vertex % 64);
}

/// Inserts the vertices `first` + k for every bit k of `bits`.
inline void insert(VertexSet& set, std::ptrdiff_t first, std::uint64_t bits) {
  const auto word = static_cast<size_t>(first / 64);
  const auto shift = static_cast<int>(first % 64);
  const std::uint64_t beyond = shift > 0 ? bits >> (64 - shift) : 0;
  if (bits << shift != 0) set[word] |= bits << shift;
  if (beyond != 0) set[word + 1] |= beyond;
}

/// Word `w` of the set of vertices v with v + offset in `set`.
inline std::uint64_t word_before(const VertexSet& set, size_t w, std::ptrdiff_t offset) {
  const size_t at = w + static_cast<size_t>(offset / 64);
  const auto shift = static_cast<int>(offset % 64);
  const auto word = [&](size_t n) { return n < set.size() ? set[n] : 0; };
  return shift == 0 ? word(at) : word(at) >> shift | word(at + 1) << (64 - shift);
}

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

/// Finds the springs that are longer than `longest_m` in a lane from `lane` on.
template <class L>
HWY_INLINE void look(LimitArrays<L>& arrays, std::ptrdiff_t lane) {
  using V = Vector<L>;
  const Tag<L> d;
  const std::ptrdiff_t vertices = arrays.mesh.vertex_count();
  const std::array<const typename L::Number*, 3> position = {
      arrays.position_m[0], arrays.position_m[1], arrays.position_m[2]};
  std::ptrdiff_t offset[kSpringTypes];
  V allowed2[kSpringTypes];
  for (size_t type = 0; type < kSpringTypes; ++type) {
    offset[type] = offset_of(arrays.mesh, type);
    const V longest = hn::LoadU(d, arrays.limits.longest_m[type].data() + lane);
    allowed2[type] = hn::Mul(longest, longest);
  }
  // Which of the pairs that are `offset` apart are springs is looked up in `groups` later.
  const auto look_at = [&](std::ptrdiff_t vertex, const Vector3<V>& from, size_t type) HWY_ATTR {
    const Vector3<V> along = load(d, position, (vertex + offset[type]) * L::kCount + lane) - from;
    const bool any = !hn::AllFalse(d, hn::Gt(squared_length(along), allowed2[type]));
    return static_cast<std::uint64_t>(any) << (vertex % 64);
  };
  for (std::ptrdiff_t first = 0; first < vertices; first += 64) {
    std::uint64_t found[kSpringTypes] = {};
    const std::ptrdiff_t end = std::min(first + 64, vertices);
    const std::ptrdiff_t inner_end = std::min(end, vertices - 2 * arrays.mesh.columns);
    std::ptrdiff_t vertex = first;
    for (; vertex < inner_end; ++vertex) {
      const Vector3<V> from = load(d, position, vertex * L::kCount + lane);
#pragma GCC unroll 6
      for (size_t type = 0; type < kSpringTypes; ++type) found[type] |= look_at(vertex, from, type);
    }
    for (; vertex < end; ++vertex) {
      const Vector3<V> from = load(d, position, vertex * L::kCount + lane);
      for (size_t type = 0; type < kSpringTypes; ++type)
        if (vertex + offset[type] < vertices) found[type] |= look_at(vertex, from, type);
    }
    for (size_t type = 0; type < kSpringTypes; ++type)
      arrays.too_long[type][static_cast<size_t>(first / 64)] |= found[type];
  }
}

/// What the springs of one type are held to, and by which shares.
template <class L>
struct TypeLimit {
  std::ptrdiff_t offset;  ///< from a spring's first end to its second, in vertices
  Vector<L> longest, longest2;
  const typename L::Number* first_share;
  const typename L::Number* second_share;
};

/// The springs among `vertices`, `n` of them that share no vertex, are shortened where they exceed.
template <class L, size_t n>
HWY_INLINE void shorten(LimitArrays<L>& arrays, const TypeLimit<L>& type, std::ptrdiff_t lane,
                        const hn::Mask<Tag<L>>& active, const std::int32_t* vertices,
                        Vector<L>& shortened) {
  using V = Vector<L>;
  using Number = typename L::Number;
  const Tag<L> d;
  const std::array<Number*, 3> position = arrays.position_m, velocity = arrays.velocity_m_per_s;
  const V one = hn::Set(d, Number{1});
  std::ptrdiff_t self[n], other[n];
  Vector3<V> along[n];
  hn::Mask<Tag<L>> exceeds[n];
  V length2[n], excess[n];
  for (size_t s = 0; s < n; ++s) {
    self[s] = vertices[s] * L::kCount + lane;
    other[s] = self[s] + type.offset * L::kCount;
    along[s] = load(d, position, other[s]) - load(d, position, self[s]);
    length2[s] = squared_length(along[s]);
    exceeds[s] = hn::And(active, hn::Gt(length2[s], type.longest2));
    shortened = hn::Add(shortened, hn::IfThenElseZero(exceeds[s], one));
  }
  if constexpr (kMayContract<V>) {
    twice_inverse_square_roots(length2, excess);
    const V half = hn::Mul(hn::Set(d, 0.5f), type.longest);
    for (size_t s = 0; s < n; ++s) excess[s] = minus_product(one, half, excess[s]);
  } else {
    V inverse[n];
    inverse_square_roots(length2, inverse);
    for (size_t s = 0; s < n; ++s) excess[s] = minus_product(one, type.longest, inverse[s]);
  }
  const auto move = [&](size_t s, const std::array<Number*, 3>& of, const V& share) HWY_ATTR {
    // Lanes that do not exceed keep their bits.
    const V first = hn::Mul(share, hn::Set(d, type.first_share[vertices[s]]));
    const V second = hn::Mul(share, hn::Set(d, type.second_share[vertices[s]]));
    const Vector3<V> a = load(d, of, self[s]), b = load(d, of, other[s]);
    store(select(exceeds[s], mul_add(first, along[s], a), a), d, of, self[s]);
    store(select(exceeds[s], minus_product(b, second, along[s]), b), d, of, other[s]);
  };
  for (size_t s = 0; s < n; ++s) move(s, position, excess[s]);
  if (velocity[0] != nullptr) {
    const V steps_per_s = hn::Set(d, arrays.steps_per_s);
    for (size_t s = 0; s < n; ++s) move(s, velocity, hn::Mul(steps_per_s, excess[s]));
  }
}

template <class L, Pass pass>
HWY_INLINE void visit(LimitArrays<L>& arrays, size_t type, std::ptrdiff_t lane) {
  using V = Vector<L>;
  using Mask = hn::Mask<Tag<L>>;
  using Number = typename L::Number;
  const Tag<L> d;
  const std::ptrdiff_t offset = offset_of(arrays.mesh, type);
  const std::array<const Number*, 3> position = {arrays.position_m[0], arrays.position_m[1],
                                                 arrays.position_m[2]};
  const V longest = hn::LoadU(d, arrays.limits.longest_m[type].data() + lane);
  const V tolerated = hn::LoadU(d, arrays.limits.tolerated_m[type].data() + lane);
  const V allowed = pass == Pass::sweep ? longest : tolerated;
  const V allowed2 = hn::Mul(allowed, allowed);
  const TypeLimit<L> limit{offset, longest, allowed2, arrays.shares[type].first.data(),
                           arrays.shares[type].second.data()};
  const Mask active = hn::Gt(hn::LoadU(d, arrays.active.data() + lane), hn::Zero(d));
  V shortened = hn::LoadU(d, arrays.shortened.data() + lane);
  V intolerable = hn::LoadU(d, arrays.intolerable.data() + lane);

  for (const VertexSet& group : arrays.groups[type]) {
    // Those that do exceed are listed first, without a branch that would be hard to foresee, and
    // then shortened several at once: the springs of a group share no vertex.
    std::int32_t* const found = arrays.found.data();
    size_t count = 0;
    for (size_t w = 0; w + 1 < group.size(); ++w) {
      const std::uint64_t moved =
          group[w] & (arrays.moved[w] | word_before(arrays.moved, w, offset));
      const std::uint64_t too_long = group[w] & arrays.too_long[type][w];
      // One that was too long and has not been touched since still is.
      std::uint64_t exceeding = pass == Pass::sweep ? too_long & ~moved : 0;
      for (std::uint64_t left = pass == Pass::sweep ? moved : moved | too_long; left != 0;
           left &= left - 1) {
        const int bit = std::countr_zero(left);
        const std::ptrdiff_t self = static_cast<std::ptrdiff_t>(w * 64 + bit) * L::kCount + lane;
        const Vector3<V> along =
            load(d, position, self + offset * L::kCount) - load(d, position, self);
        const Mask exceeds = hn::And(active, hn::Gt(squared_length(along), allowed2));
        if constexpr (pass == Pass::check)
          intolerable = hn::IfThenElse(exceeds, hn::Set(d, Number{1}), intolerable);
        else
          exceeding |= static_cast<std::uint64_t>(!hn::AllFalse(d, exceeds)) << bit;
      }
      insert(arrays.moved, static_cast<std::ptrdiff_t>(w * 64), exceeding);
      insert(arrays.moved, static_cast<std::ptrdiff_t>(w * 64) + offset, exceeding);
      for (; exceeding != 0; exceeding &= exceeding - 1)
        found[count++] = static_cast<int>(w) * 64 + std::countr_zero(exceeding);
    }
    if constexpr (pass == Pass::sweep) {
      constexpr size_t kAtOnce = 4;
      size_t n = 0;
      for (; n + kAtOnce <= count; n += kAtOnce)
        shorten<L, kAtOnce>(arrays, limit, lane, active, found + n, shortened);
      for (; n < count; ++n) shorten<L, 1>(arrays, limit, lane, active, found + n, shortened);
    }
  }
  hn::StoreU(shortened, d, arrays.shortened.data() + lane);
  hn::StoreU(intolerable, d, arrays.intolerable.data() + lane);
}

// One simulation: the numbers of a vector are neighbouring vertices.

using Neighbours = Tag<ExactLanes>;

HWY_INLINE std::uint64_t bits_of(const hn::Mask<Neighbours>& mask) {
  std::uint8_t bits[8] = {};
  hn::StoreMaskBits(Neighbours(), mask, bits);
  return bits[0];
}

HWY_INLINE void look_along(LimitArrays<SingleLane>& arrays) {
  const Neighbours d;
  const auto size = static_cast<std::ptrdiff_t>(hn::Lanes(d));
  const std::array<const double*, 3> position = {arrays.position_m[0], arrays.position_m[1],
                                                 arrays.position_m[2]};
  for (size_t type = 0; type < kSpringTypes; ++type) {
    const std::ptrdiff_t offset = offset_of(arrays.mesh, type);
    const double longest = arrays.limits.longest_m[type][0];
    const auto allowed2 = hn::Set(d, longest * longest);
    for (std::ptrdiff_t at = 0; at + offset < arrays.mesh.vertex_count(); at += size) {
      const auto along = load(d, position, at + offset) - load(d, position, at);
      arrays.too_long[type][static_cast<size_t>(at / 64)] |=
          bits_of(hn::Gt(dot(along, along), allowed2)) << (at % 64);
    }
  }
}

template <class V>
HWY_INLINE void store_where(const hn::Mask<Neighbours>& mask, const Vector3<V>& v, Neighbours d,
                            const std::array<double*, 3>& to, std::ptrdiff_t at) {
  hn::BlendedStore(v.x, mask, d, to[0] + at);
  hn::BlendedStore(v.y, mask, d, to[1] + at);
  hn::BlendedStore(v.z, mask, d, to[2] + at);
}

template <class V>
void note_moves(LimitArrays<SingleLane>& arrays, size_t type, std::ptrdiff_t at,
                std::uint64_t found, const Vector3<V>& along, const V& excess, const V& inverse) {
  const Neighbours d;
  double x[8], y[8], z[8], excesses[8], inverses[8];
  hn::StoreU(along.x, d, x);
  hn::StoreU(along.y, d, y);
  hn::StoreU(along.z, d, z);
  hn::StoreU(excess, d, excesses);
  hn::StoreU(inverse, d, inverses);
  for (; found != 0; found &= found - 1) {
    const int k = std::countr_zero(found);
    const auto vertex = static_cast<size_t>(at + k);
    arrays.moves->push_back({.type = static_cast<int>(type),
                             .first = static_cast<int>(vertex),
                             .second = static_cast<int>(at + k + offset_of(arrays.mesh, type)),
                             .first_share = arrays.shares[type].first[vertex],
                             .second_share = arrays.shares[type].second[vertex],
                             .along_m = {x[k], y[k], z[k]},
                             .excess = excesses[k],
                             .inverse_length_per_m = inverses[k]});
  }
}

template <Pass pass>
HWY_INLINE void visit_along(LimitArrays<SingleLane>& arrays, size_t type) {
  const Neighbours d;
  using V = hn::Vec<Neighbours>;
  constexpr size_t kWordBits = 64;
  const auto size = static_cast<int>(hn::Lanes(d));
  const std::ptrdiff_t offset = offset_of(arrays.mesh, type);
  const std::array<double*, 3> position = arrays.position_m, velocity = arrays.velocity_m_per_s;
  const double allowed_m =
      (pass == Pass::sweep ? arrays.limits.longest_m : arrays.limits.tolerated_m)[type][0];
  const V allowed2 = hn::Set(d, allowed_m * allowed_m);
  const V longest = hn::Set(d, arrays.limits.longest_m[type][0]);
  const V one = hn::Set(d, 1.0), steps_per_s = hn::Set(d, arrays.steps_per_s);
  if (!(arrays.active[0] > 0)) return;

  for (const VertexSet& group : arrays.groups[type]) {
    for (size_t w = 0; w + 1 < group.size(); ++w) {
      std::uint64_t left = group[w] & (arrays.too_long[type][w] | arrays.moved[w] |
                                       word_before(arrays.moved, w, offset));
      while (left != 0) {
        const int shift = std::countr_zero(left) / size * size;
        const std::uint8_t wanted = static_cast<std::uint8_t>((left >> shift) & ((1u << size) - 1));
        const std::uint8_t wanted_bits[8] = {wanted};  // as many as a mask may load
        left &= ~(std::uint64_t{wanted} << shift);
        const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(w * kWordBits) + shift;
        const Vector3<V> a = load(d, position, at), b = load(d, position, at + offset);
        const Vector3<V> along = b - a;
        const V length2 = dot(along, along);
        const auto exceeds = hn::And(hn::LoadMaskBits(d, wanted_bits), hn::Gt(length2, allowed2));
        const std::uint64_t found = bits_of(exceeds);
        if (found == 0) continue;
        if constexpr (pass == Pass::check) {
          arrays.intolerable[0] = 1;
          return;
        }
        arrays.shortened[0] += std::popcount(found);
        insert(arrays.moved, at, found);
        insert(arrays.moved, at + offset, found);
        const V inverse = inverse_square_root(length2);
        const V excess = minus_product(one, longest, inverse);
        const V first_share = hn::LoadU(d, arrays.shares[type].first.data() + at);
        const V second_share = hn::LoadU(d, arrays.shares[type].second.data() + at);
        if (arrays.moves != nullptr) note_moves(arrays, type, at, found, along, excess, inverse);
        const auto move = [&](const std::array<double*, 3>& of, const Vector3<V>& from,
                              const Vector3<V>& to, const V& share) HWY_ATTR {
          // Neither end of a spring is among the other ends, so what is stored second stands.
          store_where(exceeds, mul_add(hn::Mul(share, first_share), along, from), d, of, at);
          store_where(exceeds, minus_product(to, hn::Mul(share, second_share), along), d, of,
                      at + offset);
        };
        move(position, a, b, excess);
        if (velocity[0] != nullptr)
          move(velocity, load(d, velocity, at), load(d, velocity, at + offset),
               hn::Mul(steps_per_s, excess));
      }
    }
  }
}

template <class L, class Act>
HWY_INLINE void for_all_lanes(const Act& act) {
  const Tag<L> d;
  for (std::ptrdiff_t lane = 0; lane < L::kCount; lane += static_cast<std::ptrdiff_t>(hn::Lanes(d)))
    act(lane);
}

template <class L>
HWY_INLINE void look(LimitArrays<L>& arrays) {
  if constexpr (L::kCount == 1)
    look_along(arrays);
  else
    for_all_lanes<L>([&](std::ptrdiff_t lane) HWY_ATTR { look(arrays, lane); });
}

template <class L, Pass pass>
HWY_INLINE void visit(LimitArrays<L>& arrays) {
  if constexpr (L::kCount == 1) {
    for (size_t type = 0; type < kSpringTypes; ++type) visit_along<pass>(arrays, type);
  } else {
    for_all_lanes<L>([&](std::ptrdiff_t lane) HWY_ATTR {
      for (size_t type = 0; type < kSpringTypes; ++type) visit<L, pass>(arrays, type, lane);
    });
  }
}

void look_exact(LimitArrays<ExactLanes>& arrays) {
  look(arrays);
}
void look_fast(LimitArrays<FastLanes>& arrays) {
  look(arrays);
}
void look_single(LimitArrays<SingleLane>& arrays) {
  look(arrays);
}
void sweep_exact(LimitArrays<ExactLanes>& arrays) {
  visit<ExactLanes, Pass::sweep>(arrays);
}
void sweep_fast(LimitArrays<FastLanes>& arrays) {
  visit<FastLanes, Pass::sweep>(arrays);
}
void sweep_single(LimitArrays<SingleLane>& arrays) {
  visit<SingleLane, Pass::sweep>(arrays);
}
void check_exact(LimitArrays<ExactLanes>& arrays) {
  visit<ExactLanes, Pass::check>(arrays);
}
void check_fast(LimitArrays<FastLanes>& arrays) {
  visit<FastLanes, Pass::check>(arrays);
}
void check_single(LimitArrays<SingleLane>& arrays) {
  visit<SingleLane, Pass::check>(arrays);
}

}  // namespace HWY_NAMESPACE
}  // namespace
}  // namespace clothfit
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace clothfit {
namespace {

HWY_EXPORT(look_exact);
HWY_EXPORT(look_fast);
HWY_EXPORT(look_single);
HWY_EXPORT(sweep_exact);
HWY_EXPORT(sweep_fast);
HWY_EXPORT(sweep_single);
HWY_EXPORT(check_exact);
HWY_EXPORT(check_fast);
HWY_EXPORT(check_single);

/// Forgets what has moved and finds the springs that are too long.
void look(LimitArrays<ExactLanes>& arrays) {
  HWY_DYNAMIC_DISPATCH(look_exact)(arrays);
}
void look(LimitArrays<FastLanes>& arrays) {
  HWY_DYNAMIC_DISPATCH(look_fast)(arrays);
}
void look(LimitArrays<SingleLane>& arrays) {
  HWY_DYNAMIC_DISPATCH(look_single)(arrays);
}
void sweep(LimitArrays<ExactLanes>& arrays) {
  HWY_DYNAMIC_DISPATCH(sweep_exact)(arrays);
}
void sweep(LimitArrays<FastLanes>& arrays) {
  HWY_DYNAMIC_DISPATCH(sweep_fast)(arrays);
}
void sweep(LimitArrays<SingleLane>& arrays) {
  HWY_DYNAMIC_DISPATCH(sweep_single)(arrays);
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
  std::ranges::fill(arrays.moved, 0);
  for (VertexSet& set : arrays.too_long) std::ranges::fill(set, 0);
  look(arrays);
}

}  // namespace

template <class L>
StrainLimiter<L>::StrainLimiter(const Mesh& mesh, const Eigen::VectorXd& inverse_mass_per_kg)
    : mesh_(mesh) {
  using Number = typename L::Number;
  const auto vertices = static_cast<size_t>(mesh.vertex_count());
  moved_.resize(vertices / 64 + 2);
  found_.resize(vertices + 1);
  for (size_t type = 0; type < kSpringTypes; ++type) {
    const auto [down, right] = kSpringReach[type];
    constexpr size_t kPadding = 8;  // a vector of neighbours may reach past the last one
    shares_[type].first.resize(vertices + kPadding);
    shares_[type].second.resize(vertices + kPadding);
    too_long_[type].resize(moved_.size());
    for (VertexSet& group : groups_[type]) group.resize(moved_.size());
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
        insert(groups_[type][static_cast<size_t>(place % 2)], vertex);
      }
    }
  }
}

template <class L>
LimitOutcome<L> StrainLimiter<L>::limit_positions(const LaneLimits<L>& limits,
                                                  LaneVectors<L>& position_m,
                                                  std::vector<LimitMove>* moves) {
  LimitArrays<L> arrays{.mesh = mesh_,
                        .limits = limits,
                        .shares = shares_,
                        .groups = groups_,
                        .too_long = too_long_,
                        .moved = moved_,
                        .found = found_,
                        .position_m = position_m.data(),
                        .velocity_m_per_s = {},
                        .moves = moves};
  begin(arrays);
  sweep(arrays);
  return {.too_long = arrays.shortened};
}

template <class L>
LimitOutcome<L> StrainLimiter<L>::limit_consistently(const LaneLimits<L>& limits, int most_sweeps,
                                                     double time_step_s, LaneVectors<L>& position_m,
                                                     LaneVectors<L>& velocity_m_per_s,
                                                     std::vector<LimitMove>* moves) {
  LimitArrays<L> arrays{.mesh = mesh_,
                        .limits = limits,
                        .shares = shares_,
                        .groups = groups_,
                        .too_long = too_long_,
                        .moved = moved_,
                        .found = found_,
                        .position_m = position_m.data(),
                        .velocity_m_per_s = velocity_m_per_s.data(),
                        .moves = moves,
                        .steps_per_s = static_cast<typename L::Number>(1 / time_step_s)};
  begin(arrays);
  LimitOutcome<L> outcome;
  for (int n = 0; n < most_sweeps; ++n) {
    arrays.shortened.setZero();
    sweep(arrays);
    if (n == 0) outcome.too_long = arrays.shortened;
    // A correction may lengthen springs that were visited before: look at all of them again.
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
