#include "model/rest/hanging_energy.h"

#include <algorithm>
#include <cassert>

// This source is compiled once for each instruction set, in a namespace of its own.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "model/rest/hanging_energy.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "data/parallel.h"
#include "model/kernels/lane_vector-inl.h"

#ifndef CLOTHFIT_MODEL_EQUILIBRIUM_HANGING_ENERGY_ONCE
#define CLOTHFIT_MODEL_EQUILIBRIUM_HANGING_ENERGY_ONCE
namespace clothfit {
namespace {

using Planes = std::array<const double*, 3>;
using WritablePlanes = std::array<double*, 3>;

/// Rows of vertices that one task works on. A task computes again the pulls from the two rows above
/// its own.
constexpr int kBlockRows = 24;

/// Rows of pulls, three coordinates each, that are kept while rows are swept. They are types 0, 2
/// and 3 of this row and the one above, type 4 of this and two above, types 1 and 5 of this.
constexpr int kKeptRows = 11;

/// The rows of `layout` from `first` on up to `last`.
struct RowBlock {
  FieldLayout layout;
  int first = 0;
  int last = 0;
  double* scratch = nullptr;  ///< scratch_size(layout) doubles

  static std::ptrdiff_t scratch_row(const FieldLayout& layout) { return layout.stride + kLanes; }
  static std::ptrdiff_t scratch_size(const FieldLayout& layout) {
    return 3 * kKeptRows * scratch_row(layout);
  }
};

/// The distance of a spring's ends from the vertex that indexes it, and the springs in a row of
/// vertices.
struct SpringReach {
  std::ptrdiff_t a, b;
  int rows, columns;
};

std::array<SpringReach, kSpringTypes> reaches(const FieldLayout& layout) {
  const std::ptrdiff_t s = layout.stride;
  const int m = layout.rows, n = layout.columns;
  return {{{0, s, m - 1, n},
           {0, 1, m, n - 1},
           {0, s + 1, m - 1, n - 1},
           {s, 1, m - 1, n - 1},
           {0, 2 * s, m - 2, n},
           {0, 2, m, n - 2}}};
}

struct EnergyArrays {
  std::array<double, kSpringTypes> natural_length_m, stiffness_n_per_m;
  Planes position_m;
  const double* mass_kg;
  std::array<double, 3> gravity_m_per_s2;
  WritablePlanes gradient_n;
};

struct TangentArrays {
  Planes position_m;
  std::array<const double*, kSpringTypes> transverse, longitudinal;
  Planes direction;
  WritablePlanes product;
};

struct MatrixArrays {
  std::array<std::array<const double*, 6>, kSpringTypes> stiffness;
  Planes direction;
  WritablePlanes product;
};

struct LineariseArrays {
  std::array<double, kSpringTypes> natural_length_m, stiffness_n_per_m;
  Planes position_m;
  bool clamped;
  std::array<double*, kSpringTypes> transverse, longitudinal;
};

}  // namespace
}  // namespace clothfit
#endif

HWY_BEFORE_NAMESPACE();
namespace clothfit {
namespace {
namespace HWY_NAMESPACE {

/// Eight neighbouring columns, or as many of them as a vector holds.
using EightTag = hn::CappedTag<double, 8>;
using Eight = hn::Vec<EightTag>;
using Eight3 = Vector3<Eight>;

/// Calls `pull(type, index, reach, j, own)` for every spring that pulls at the block's vertices;
/// `own` tells whether it starts in the block. Calls `sink(index, j, force)` for every vertex with
/// the sum of the pulls on it.
template <class Pull, class Sink>
HWY_INLINE void sweep_rows(const RowBlock& block, const Pull& pull, const Sink& sink) {
  const EightTag d;
  const auto lanes = static_cast<std::ptrdiff_t>(hn::Lanes(d));
  const FieldLayout layout = block.layout;
  const std::ptrdiff_t stride = layout.stride, width = RowBlock::scratch_row(layout);
  const std::array<SpringReach, kSpringTypes> reach = reaches(layout);
  std::fill_n(block.scratch, RowBlock::scratch_size(layout), 0.0);
  // Each kept row begins with kLanes zeros: the pulls from left of the first column.
  const auto kept = [&](std::ptrdiff_t n) HWY_ATTR {
    double* const row = block.scratch + 3 * n * width + kLanes;
    return WritablePlanes{row, row + width, row + 2 * width};
  };
  const auto read = [&](const WritablePlanes& row, std::ptrdiff_t j)
                        HWY_ATTR { return load(EightTag(), row, j); };
  const auto pull_row = [&](SpringType type, std::ptrdiff_t i, const WritablePlanes& to) HWY_ATTR {
    const SpringReach& r = reach[static_cast<size_t>(type)];
    if (i >= r.rows) {
      for (double* const row : to) std::fill_n(row, stride, 0.0);
      return;
    }
    const bool own = i >= block.first;
    for (std::ptrdiff_t j = 0; j < stride; j += lanes)
      store(pull(type, i * stride + j, r, j, own), EightTag(), to, j);
  };

  for (std::ptrdiff_t i = std::max(block.first - 2, 0); i < block.last; ++i) {
    const WritablePlanes down_two = kept(6 + i % 3);
    pull_row(flexion_t, i, down_two);
    if (i < block.first - 1) continue;
    const std::ptrdiff_t now = i % 2, above = 1 - now;
    const WritablePlanes down = kept(now), down_right = kept(2 + now), down_left = kept(4 + now);
    pull_row(structural_t, i, down);
    pull_row(shear_down, i, down_right);
    pull_row(shear_up, i, down_left);
    if (i < block.first) continue;
    const WritablePlanes right = kept(9), right_two = kept(10);
    pull_row(structural_s, i, right);
    pull_row(flexion_s, i, right_two);
    const WritablePlanes from_above = kept(above), from_above_left = kept(2 + above),
                         from_above_right = kept(4 + above), from_two_above = kept(6 + (i + 1) % 3);
    for (std::ptrdiff_t j = 0; j < stride; j += lanes) {
      Eight3 force = read(down, j) - read(from_above, j);
      force = force + (read(right, j) - read(right, j - 1));
      force = force + (read(down_right, j) - read(from_above_left, j - 1));
      force = force + (read(from_above_right, j) - read(down_left, j - 1));
      force = force + (read(down_two, j) - read(from_two_above, j));
      force = force + (read(right_two, j) - read(right_two, j - 2));
      sink(i * stride + j, j, force);
    }
  }
}

/// Returns `v` for the springs that exist, zero in the padding.
HWY_INLINE Eight3 existing(const Eight3& v, std::ptrdiff_t j, std::ptrdiff_t count) {
  const EightTag d;
  if (j + static_cast<std::ptrdiff_t>(hn::Lanes(d)) <= count) return v;
  const auto mask = hn::FirstN(d, static_cast<size_t>(std::max<std::ptrdiff_t>(count - j, 0)));
  return {hn::IfThenElseZero(mask, v.x), hn::IfThenElseZero(mask, v.y),
          hn::IfThenElseZero(mask, v.z)};
}

HWY_INLINE Eight existing(const Eight& v, std::ptrdiff_t j, std::ptrdiff_t count) {
  const EightTag d;
  if (j + static_cast<std::ptrdiff_t>(hn::Lanes(d)) <= count) return v;
  return hn::IfThenElseZero(
      hn::FirstN(d, static_cast<size_t>(std::max<std::ptrdiff_t>(count - j, 0))), v);
}

double energy_and_gradient(const RowBlock& block, const EnergyArrays& arrays) {
  const EightTag d;
  const EnergyArrays in = arrays;
  HWY_ALIGN double energy[kLanes] = {};
  const Eight half = hn::Set(d, 0.5), one = hn::Set(d, 1.0);
  sweep_rows(
      block,
      [&](SpringType type, std::ptrdiff_t at, const SpringReach& reach, std::ptrdiff_t j, bool own)
          HWY_ATTR {
            const auto t = static_cast<size_t>(type);
            const Eight3 along = load(EightTag(), in.position_m, at + reach.b) -
                                 load(EightTag(), in.position_m, at + reach.a);
            const Eight stiffness = hn::Set(d, in.stiffness_n_per_m[t]);
            const Eight natural = hn::Set(d, in.natural_length_m[t]);
            const Eight length2 = dot(along, along);
            const Eight inverse = inverse_square_root(length2);
            if (own) {
              const Eight extension = hn::Sub(hn::Mul(length2, inverse), natural);
              const Eight stored = hn::Mul(hn::Mul(half, stiffness), hn::Mul(extension, extension));
              double* const sum = energy + j % kLanes;
              hn::StoreU(hn::Add(hn::LoadU(d, sum), existing(stored, j, reach.columns)), d, sum);
            }
            const Eight share = hn::Mul(stiffness, hn::Sub(one, hn::Mul(natural, inverse)));
            return existing(share * along, j, reach.columns);
          },
      [&](std::ptrdiff_t at, std::ptrdiff_t j, const Eight3& springs) HWY_ATTR {
        const Eight mass = hn::LoadU(d, in.mass_kg + at);
        const Eight3 gravity = {hn::Set(d, in.gravity_m_per_s2[0]),
                                hn::Set(d, in.gravity_m_per_s2[1]),
                                hn::Set(d, in.gravity_m_per_s2[2])};
        const Eight3 weight = mass * gravity;
        double* const sum = energy + j % kLanes;
        hn::StoreU(hn::Sub(hn::LoadU(d, sum), dot(weight, load(EightTag(), in.position_m, at))), d,
                   sum);
        store(zero(d) - (springs + weight), d, in.gradient_n, at);
      });
  double sum = 0;
  for (const double part : energy) sum += part;
  return sum;
}

void multiply_tangent(const RowBlock& block, const TangentArrays& arrays) {
  const EightTag d;
  const TangentArrays in = arrays;
  sweep_rows(
      block,
      [&](SpringType type, std::ptrdiff_t at, const SpringReach& reach, std::ptrdiff_t j, bool)
          HWY_ATTR {
            const auto t = static_cast<size_t>(type);
            const Eight3 along = load(EightTag(), in.position_m, at + reach.b) -
                                 load(EightTag(), in.position_m, at + reach.a);
            const Eight3 change = load(EightTag(), in.direction, at + reach.b) -
                                  load(EightTag(), in.direction, at + reach.a);
            const Eight transverse = hn::LoadU(d, in.transverse[t] + at);
            const Eight longitudinal = hn::LoadU(d, in.longitudinal[t] + at);
            return existing(transverse * change + hn::Mul(longitudinal, dot(along, change)) * along,
                            j, reach.columns);
          },
      [&](std::ptrdiff_t at, std::ptrdiff_t, const Eight3& force)
          HWY_ATTR { store(zero(d) - force, d, in.product, at); });
}

void multiply_matrices(const RowBlock& block, const MatrixArrays& arrays) {
  const EightTag d;
  const MatrixArrays in = arrays;
  sweep_rows(
      block,
      [&](SpringType type, std::ptrdiff_t at, const SpringReach& reach, std::ptrdiff_t j,
          bool) HWY_ATTR {
        const auto& k = in.stiffness[static_cast<size_t>(type)];
        const auto entry = [&](size_t c) HWY_ATTR { return hn::LoadU(d, k[c] + at); };
        const Eight3 v = load(EightTag(), in.direction, at + reach.b) -
                         load(EightTag(), in.direction, at + reach.a);
        const Eight xy = entry(3), xz = entry(4), yz = entry(5);
        const auto row = [&](Eight x, Eight y, Eight z) HWY_ATTR {
          return hn::Add(hn::Add(hn::Mul(x, v.x), hn::Mul(y, v.y)), hn::Mul(z, v.z));
        };
        return existing(Eight3{row(entry(0), xy, xz), row(xy, entry(1), yz), row(xz, yz, entry(2))},
                        j, reach.columns);
      },
      [&](std::ptrdiff_t at, std::ptrdiff_t, const Eight3& force)
          HWY_ATTR { store(zero(d) - force, d, in.product, at); });
}

void linearise(const RowBlock& block, const LineariseArrays& in) {
  const EightTag d;
  const std::ptrdiff_t stride = block.layout.stride;
  const std::array<SpringReach, kSpringTypes> reach = reaches(block.layout);
  for (size_t t = 0; t < kSpringTypes; ++t) {
    const Eight stiffness = hn::Set(d, in.stiffness_n_per_m[t]);
    const Eight natural = hn::Set(d, in.natural_length_m[t]);
    for (std::ptrdiff_t i = block.first; i < std::min(block.last, reach[t].rows); ++i) {
      for (std::ptrdiff_t j = 0; j < stride; j += static_cast<std::ptrdiff_t>(hn::Lanes(d))) {
        const std::ptrdiff_t at = i * stride + j;
        const Eight3 along = load(EightTag(), in.position_m, at + reach[t].b) -
                             load(EightTag(), in.position_m, at + reach[t].a);
        // A spring of no length has no direction. It keeps the stiffness of one that is 1e-100 m
        // long, whose derivative is finite and useless.
        const Eight inverse = inverse_square_root(hn::Max(dot(along, along), hn::Set(d, 1e-200)));
        const Eight part = hn::Mul(hn::Mul(stiffness, natural), inverse);
        Eight transverse = hn::Sub(stiffness, part);
        Eight longitudinal = hn::Mul(part, hn::Mul(inverse, inverse));
        if (in.clamped) {
          // transverse + longitudinal l^2 = k stays what it is.
          transverse = hn::Max(transverse, hn::Zero(d));
          longitudinal = hn::Min(longitudinal, hn::Mul(stiffness, hn::Mul(inverse, inverse)));
        }
        hn::StoreU(existing(transverse, j, reach[t].columns), d, in.transverse[t] + at);
        hn::StoreU(existing(longitudinal, j, reach[t].columns), d, in.longitudinal[t] + at);
      }
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace
}  // namespace clothfit
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace clothfit {
namespace {
HWY_EXPORT(energy_and_gradient);
HWY_EXPORT(multiply_tangent);
HWY_EXPORT(multiply_matrices);
HWY_EXPORT(linearise);

/// Calls `work(block, number)` for every block of rows.
template <class Work>
void for_row_blocks(const FieldLayout& layout, std::vector<std::vector<double>>& scratch,
                    const Work& work) {
  const int blocks = (layout.rows + kBlockRows - 1) / kBlockRows;
  scratch.resize(static_cast<size_t>(blocks));
  const auto one = [&](size_t block) {
    const int b = static_cast<int>(block);
    std::vector<double>& mine = scratch[static_cast<size_t>(b)];
    mine.resize(static_cast<size_t>(RowBlock::scratch_size(layout)));
    work(RowBlock{layout, b * kBlockRows, std::min((b + 1) * kBlockRows, layout.rows), mine.data()},
         static_cast<size_t>(b));
  };
  if (blocks == 1)
    one(0);
  else
    for_each_index(static_cast<size_t>(blocks), one);
}

template <class Pointer, class Arrays>
std::array<Pointer, kSpringTypes> pointers(Arrays& arrays) {
  std::array<Pointer, kSpringTypes> result{};
  for (size_t t = 0; t < kSpringTypes; ++t) result[t] = arrays[t].data();
  return result;
}

}  // namespace

HangingCloth HangingCloth::of(const Cloth& cloth, const ParameterSet& parameters) {
  return {.mesh = cloth.mesh,
          .natural_length_m = parameters.springs.natural_length_m,
          .stiffness_n_per_m = parameters.springs.stiffness_n_per_m,
          .mass_kg = cloth.mass_kg,
          .gravity_m_per_s2 = parameters.gravity_m_per_s2};
}

HangingCloth HangingCloth::of_equation8(const Mesh& mesh,
                                        const std::array<double, kSpringTypes>& constant_j,
                                        double density_constant, Eigen::VectorXd mass_kg,
                                        double gravity_m_per_s2) {
  HangingCloth cloth{.mesh = mesh,
                     .natural_length_m = flat_lengths(mesh),
                     .mass_kg = std::move(mass_kg),
                     .gravity_m_per_s2 = {0, 0, -density_constant * gravity_m_per_s2}};
  for (size_t t = 0; t < kSpringTypes; ++t)
    cloth.stiffness_n_per_m[t] =
        constant_j[t] / (cloth.natural_length_m[t] * cloth.natural_length_m[t]);
  return cloth;
}

HangingEnergy::HangingEnergy(HangingCloth cloth)
    : cloth_(std::move(cloth)),
      layout_(FieldLayout::of(cloth_.mesh)),
      mass_kg_(Eigen::ArrayXd::Zero(layout_.plane() + kLanes)) {
  assert(cloth_.mass_kg.size() == cloth_.mesh.vertex_count());
  for (int v = 0; v < cloth_.mesh.vertex_count(); ++v) mass_kg_[layout_.at(v)] = cloth_.mass_kg[v];
}

double HangingEnergy::energy_and_gradient(const MeshField& position_m, MeshField& gradient_n) {
  const Eigen::Vector3d& g = cloth_.gravity_m_per_s2;
  const EnergyArrays arrays{cloth_.natural_length_m, cloth_.stiffness_n_per_m, position_m.planes(),
                            mass_kg_.data(),         {g.x(), g.y(), g.z()},    gradient_n.planes()};
  block_energy_j_.resize(static_cast<size_t>(layout_.rows / kBlockRows + 1));
  std::ranges::fill(block_energy_j_, 0.0);
  for_row_blocks(layout_, scratch_, [&](const RowBlock& block, size_t b) {
    block_energy_j_[b] = HWY_DYNAMIC_DISPATCH(energy_and_gradient)(block, arrays);
  });
  double energy_j = 0;
  for (const double part : block_energy_j_) energy_j += part;
  return energy_j;
}

void HangingEnergy::linearise(const MeshField& position_m, Curvature curvature,
                              EnergyTangent& tangent) {
  tangent.position_m = position_m;
  for (size_t t = 0; t < kSpringTypes; ++t) {
    tangent.transverse_n_per_m[t].setZero(layout_.plane() + kLanes);
    tangent.longitudinal_n_per_m3[t].setZero(layout_.plane() + kLanes);
  }
  const LineariseArrays arrays{cloth_.natural_length_m,
                               cloth_.stiffness_n_per_m,
                               position_m.planes(),
                               curvature == Curvature::clamped,
                               pointers<double*>(tangent.transverse_n_per_m),
                               pointers<double*>(tangent.longitudinal_n_per_m3)};
  for_row_blocks(layout_, scratch_, [&](const RowBlock& block, size_t) {
    HWY_DYNAMIC_DISPATCH(linearise)(block, arrays);
  });
}

void multiply(const EnergyTangent& tangent, const MeshField& direction, MeshField& product,
              std::vector<std::vector<double>>& scratch) {
  const TangentArrays arrays{
      tangent.position_m.planes(), pointers<const double*>(tangent.transverse_n_per_m),
      pointers<const double*>(tangent.longitudinal_n_per_m3), direction.planes(), product.planes()};
  for_row_blocks(direction.layout, scratch, [&](const RowBlock& block, size_t) {
    HWY_DYNAMIC_DISPATCH(multiply_tangent)(block, arrays);
  });
}

void multiply(const MatrixSprings& springs, const MeshField& direction, MeshField& product,
              std::vector<std::vector<double>>& scratch) {
  MatrixArrays arrays{
      .stiffness = {}, .direction = direction.planes(), .product = product.planes()};
  for (size_t t = 0; t < kSpringTypes; ++t)
    for (size_t c = 0; c < 6; ++c) arrays.stiffness[t][c] = springs.stiffness_n_per_m[t][c].data();
  for_row_blocks(springs.layout, scratch, [&](const RowBlock& block, size_t) {
    HWY_DYNAMIC_DISPATCH(multiply_matrices)(block, arrays);
  });
}

}  // namespace clothfit
#endif
