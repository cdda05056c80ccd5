#include "vision/detect/tag_kernels.h"

#include <algorithm>
#include <cassert>

// This source is compiled once for each instruction set, in a namespace of its own.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "vision/detect/tag_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifndef CLOTHFIT_VISION_DETECT_TAG_KERNELS_ONCE
#define CLOTHFIT_VISION_DETECT_TAG_KERNELS_ONCE
namespace clothfit {
namespace {

constexpr Eigen::Index kSampleLanes = 16;

/// Samples whose products are added up while they are in the first cache.
constexpr int kBlock = static_cast<int>(TagSamples::kTogether);
constexpr int kBlockVectors = kBlock / static_cast<int>(kSampleLanes);

/// Polynomials x^i y^j of degree d = i + j come in the order d (d + 1) / 2 + j.
constexpr int kDegree3 = 10, kDegree4 = 15, kDegree6 = 28;

/// What the derivatives by unknowns are made of, times a polynomial each: the pattern's change with
/// place, the one with blur, 1 (offset of the light) and the white (contrast).
constexpr int kPlaceFactors = 2, kOtherFactors = 5;
constexpr int kFactors = kPlaceFactors + kOtherFactors;

constexpr int pairs_of(int count) {
  return count * (count + 1) / 2;
}

/// Returns the place of an unordered pair among the pairs of `count`.
constexpr size_t pair_at(int a, int b, int count) {
  const int first = std::min(a, b), second = std::max(a, b);
  return static_cast<size_t>(first * count - first * (first - 1) / 2 + second - first);
}

/// One sum per lane for each product of factors and polynomial.
struct LaneSums {
  using Lanes = std::array<float, kSampleLanes>;
  std::array<Lanes, pairs_of(kPlaceFactors) * kDegree6> place_place{};
  std::array<Lanes, kPlaceFactors * kOtherFactors * kDegree4> place_other{};
  std::array<Lanes, pairs_of(kOtherFactors) * (kDegree3 - 4)> other_other{};
  std::array<Lanes, kPlaceFactors * kDegree3> place_residual{};
  std::array<Lanes, kOtherFactors * 3> other_residual{};
};

/// What CellRows holds of corners, one sum per lane.
struct CornerSums {
  std::array<std::array<LaneSums::Lanes, 2>, 4> slope{}, seen{};
};

/// Arrays over a block of samples.
template <int count>
using BlockArrays = std::array<std::array<float, kBlock>, static_cast<size_t>(count)>;

/// What the normal equations need of a sample: x, y, its factors but 1, weight and residual.
constexpr int kInputs = 2 + (kFactors - 1) + 2;

/// Samples that are waiting to be added up. A vector more than a block fits.
using Waiting = std::array<std::array<float, kBlock + kSampleLanes>, kInputs>;

struct Block {
  BlockArrays<kDegree6> polynomials;
  BlockArrays<pairs_of(kPlaceFactors)> place_place;
  BlockArrays<kPlaceFactors * kOtherFactors> place_other;
  BlockArrays<pairs_of(kOtherFactors)> other_other;
  BlockArrays<kPlaceFactors> place_residual;
  BlockArrays<kOtherFactors> other_residual;
};

}  // namespace
}  // namespace clothfit
#endif

HWY_BEFORE_NAMESPACE();
namespace clothfit {
namespace {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, kSampleLanes>;
using V = hn::Vec<Floats>;

HWY_INLINE V set(float number) {
  return hn::Set(Floats(), number);
}

/// Returns a b + c, the product rounded first.
HWY_INLINE V mul_add(const V& a, const V& b, const V& c) {
  return hn::Add(hn::Mul(a, b), c);
}

HWY_INLINE V load(const Eigen::ArrayXf& from, Eigen::Index at) {
  return hn::LoadU(Floats(), from.data() + at);
}

HWY_INLINE void store(const V& values, Eigen::ArrayXf& to, Eigen::Index at) {
  hn::StoreU(values, Floats(), to.data() + at);
}

/// Calls `visit(i)` for the first sample of each vector.
template <class Visit>
HWY_INLINE void for_vectors(Eigen::Index count, const Visit& visit) {
  const auto step = static_cast<Eigen::Index>(hn::Lanes(Floats()));
  for (Eigen::Index i = 0; i < count; i += step) visit(i);
}

/// Fills `terms` with the polynomials up to degree 3.
HWY_INLINE void polynomials(const V& x, const V& y, V* terms) {
  terms[0] = set(1);
  terms[1] = x;
  terms[2] = y;
  terms[3] = hn::Mul(x, x);
  terms[4] = hn::Mul(x, y);
  terms[5] = hn::Mul(y, y);
  terms[6] = hn::Mul(terms[3], x);
  terms[7] = hn::Mul(terms[3], y);
  terms[8] = hn::Mul(x, terms[5]);
  terms[9] = hn::Mul(terms[5], y);
}

template <size_t count>
HWY_INLINE V combined(const V* terms, const std::array<float, count>& coefficients, V sum) {
  for (size_t k = 0; k < count; ++k) sum = mul_add(set(coefficients[k]), terms[k], sum);
  return sum;
}

/// Cubic B-spline weights of four coefficients at a share (0 to 1) between the inner two, with
/// first and second derivatives by the share.
struct SplineWeights {
  V value[4], slope[4], curvature[4];

  HWY_INLINE explicit SplineWeights(const V& t) {
    const V one = set(1), s = hn::Sub(one, t), sixth = set(1.0F / 6), half = set(0.5F);
    const V three_t = hn::Mul(set(3), t), three_s = hn::Mul(set(3), s);
    const V tt = hn::Mul(t, t), ss = hn::Mul(s, s);
    value[0] = hn::Mul(sixth, hn::Mul(ss, s));
    value[1] = hn::Mul(sixth, hn::Sub(set(4), hn::Mul(tt, hn::Sub(set(6), three_t))));
    value[2] = hn::Mul(sixth, hn::Sub(set(4), hn::Mul(ss, hn::Sub(set(6), three_s))));
    value[3] = hn::Mul(sixth, hn::Mul(tt, t));
    slope[0] = hn::Neg(hn::Mul(half, ss));
    slope[1] = hn::Mul(half, hn::Mul(t, hn::Sub(three_t, set(4))));
    slope[2] = hn::Mul(half, hn::Mul(s, hn::Sub(set(4), three_s)));
    slope[3] = hn::Mul(half, tt);
    curvature[0] = s;
    curvature[1] = hn::Sub(three_t, set(2));
    curvature[2] = hn::Sub(three_s, set(2));
    curvature[3] = t;
  }
};

HWY_INLINE V weighed(const V* weights, const V* values) {
  return mul_add(weights[3], values[3],
                 mul_add(weights[2], values[2],
                         mul_add(weights[1], values[1], hn::Mul(weights[0], values[0]))));
}

/// The pattern's value and its derivatives in tag coordinates.
struct Pattern {
  V value, by_x, by_y, by_xx, by_xy, by_yy;
};

HWY_INLINE Pattern look_up(const SplineGrid& grid, const V& x, const V& y) {
  const hn::RebindToSigned<Floats> integers;
  const V first = set(grid.first), per_step = set(grid.per_step);
  // Beyond the margin the pattern is as white as at its end; a poor step may ask for any place.
  const V last = set(static_cast<float>(grid.side - 3));
  const auto grid_place = [&](const V& tag) HWY_ATTR {
    return hn::Min(hn::Max(hn::Mul(hn::Sub(tag, first), per_step), set(1)), last);
  };
  const V u = grid_place(x), v = grid_place(y);
  const auto column = hn::ConvertTo(integers, u), row = hn::ConvertTo(integers, v);
  const SplineWeights across(hn::Sub(u, hn::ConvertTo(Floats(), column)));
  const SplineWeights down(hn::Sub(v, hn::ConvertTo(Floats(), row)));
  const auto side = hn::Set(integers, grid.side);
  auto at = hn::Sub(hn::Add(hn::Mul(row, side), column), hn::Set(integers, grid.side + 1));
  V value[4], slope[4], curvature[4];
  for (int j = 0; j < 4; ++j) {
    V four[4];
    for (int i = 0; i < 4; ++i) four[i] = hn::GatherIndex(Floats(), grid.coefficients + i, at);
    value[j] = weighed(across.value, four);
    slope[j] = weighed(across.slope, four);
    curvature[j] = weighed(across.curvature, four);
    at = hn::Add(at, side);
  }
  const V square = hn::Mul(per_step, per_step);
  return {.value = weighed(down.value, value),
          .by_x = hn::Mul(per_step, weighed(down.value, slope)),
          .by_y = hn::Mul(per_step, weighed(down.slope, value)),
          .by_xx = hn::Mul(square, weighed(down.value, curvature)),
          .by_xy = hn::Mul(square, weighed(down.slope, slope)),
          .by_yy = hn::Mul(square, weighed(down.curvature, value))};
}

void evaluate(const TagModel& model, const TagSamples& samples, TagRows& rows) {
  for_vectors(samples.x.size(), [&](Eigen::Index i) HWY_ATTR {
    const V x = load(samples.x, i), y = load(samples.y, i);
    V terms[kDegree3];
    polynomials(x, y, terms);
    const Pattern pattern =
        look_up(model.grid, combined(terms, model.bend_x, x), combined(terms, model.bend_y, y));
    const V offset = combined(terms, model.offset, hn::Zero(Floats()));
    const V contrast = combined(terms, model.contrast, hn::Zero(Floats()));
    V white = pattern.value;
    for (size_t k = 0; k < 3; ++k) {
      const std::array<float, 3>& by = model.by_blur[k];
      const V change =
          mul_add(set(by[2]), pattern.by_yy,
                  mul_add(set(by[1]), pattern.by_xy, hn::Mul(set(by[0]), pattern.by_xx)));
      store(hn::Mul(contrast, change), rows.by_blur[k], i);
      const V more = mul_add(set(model.blur_slope[2 * k + 1]), y,
                             mul_add(set(model.blur_slope[2 * k]), x, set(model.blur_change[k])));
      white = mul_add(change, more, white);
    }
    store(white, rows.white, i);
    store(hn::Sub(load(samples.grey, i), mul_add(contrast, white, offset)), rows.residual, i);
    const V by_x = hn::Mul(contrast, pattern.by_x), by_y = hn::Mul(contrast, pattern.by_y);
    store(by_x, rows.by_x, i);
    store(by_y, rows.by_y, i);
    const std::array<float, 4>& turn = model.tag_by_pixel;
    const V along_u = mul_add(set(turn[0]), by_x, hn::Mul(set(turn[2]), by_y));
    const V along_v = mul_add(set(turn[1]), by_x, hn::Mul(set(turn[3]), by_y));
    store(along_u, rows.gradient_u, i);
    store(along_v, rows.gradient_v, i);
    store(hn::Sqrt(mul_add(along_u, along_u, hn::Mul(along_v, along_v))), rows.slope, i);
  });
}

void weigh(const TagWeights& weights, TagRows& rows) {
  const V noise = set(weights.noise_levels * weights.noise_levels);
  const V rough = set(weights.roughness_px * weights.roughness_px);
  const V square_loss = set(weights.loss * weights.loss), one = set(1);
  for_vectors(rows.residual.size(), [&](Eigen::Index i) HWY_ATTR {
    const V slope = load(rows.slope, i), residual = load(rows.residual, i);
    const V variance = mul_add(rough, hn::Mul(slope, slope), noise);
    const V scaled = hn::Div(hn::Mul(residual, residual), hn::Mul(square_loss, variance));
    const V robust = hn::Div(one, hn::Add(one, scaled));
    store(robust, rows.robust, i);
    store(hn::Div(robust, variance), rows.weight, i);
  });
}

/// Fills the block's arrays from the first samples that wait.
HWY_INLINE void fill(const Waiting& waiting, Block& block) {
  const Floats d;
  for_vectors(kBlock, [&](Eigen::Index at) HWY_ATTR {
    const auto put = [&](auto& arrays, int which, const V& values) HWY_ATTR {
      hn::StoreU(values, d, arrays[static_cast<size_t>(which)].data() + at);
    };
    const auto get = [&](size_t which)
                         HWY_ATTR { return hn::LoadU(d, waiting[which].data() + at); };
    const V x = get(0), y = get(1);
    V terms[kDegree6];
    polynomials(x, y, terms);
    for (int degree = 4, next = kDegree3; degree <= 6; ++degree) {
      const int before = next - degree;  // the first of the degree before
      for (int j = 0; j < degree; ++j) terms[next + j] = hn::Mul(terms[before + j], x);
      terms[next + degree] = hn::Mul(terms[next - 1], y);
      next += degree + 1;
    }
    for (int k = 0; k < kDegree6; ++k) put(block.polynomials, k, terms[k]);

    const V place[kPlaceFactors] = {get(2), get(3)};
    const V other[kOtherFactors] = {get(4), get(5), get(6), set(1), get(7)};
    const V weight = get(8);
    const V pull = hn::Mul(weight, get(9));
    int both = 0, mixed = 0;
    for (int a = 0; a < kPlaceFactors; ++a) {
      const V weighed_place = hn::Mul(weight, place[a]);
      for (int b = a; b < kPlaceFactors; ++b)
        put(block.place_place, both++, hn::Mul(weighed_place, place[b]));
      for (int b = 0; b < kOtherFactors; ++b)
        put(block.place_other, mixed++, hn::Mul(weighed_place, other[b]));
      put(block.place_residual, a, hn::Mul(pull, place[a]));
    }
    both = 0;
    for (int a = 0; a < kOtherFactors; ++a) {
      const V weighed_other = hn::Mul(weight, other[a]);
      for (int b = a; b < kOtherFactors; ++b)
        put(block.other_other, both++, hn::Mul(weighed_other, other[b]));
      put(block.other_residual, a, hn::Mul(pull, other[a]));
    }
  });
}

/// Adds the products of `down` arrays and `across` polynomials, `count` of which there are, to
/// their sums.
template <int down, int across>
HWY_INLINE void add_tile(const std::array<float, kBlock>* factors,
                         const std::array<float, kBlock>* terms, int count, LaneSums::Lanes* sums) {
  const Floats d;
  for_vectors(kSampleLanes, [&](Eigen::Index lane) HWY_ATTR {
    V tile[down][across];
    for (int r = 0; r < down; ++r)
      for (int c = 0; c < across; ++c) tile[r][c] = hn::LoadU(d, sums[r * count + c].data() + lane);
    for (int k = 0; k < kBlockVectors; ++k) {
      const Eigen::Index at = k * kSampleLanes + lane;
      V term[across];
      for (int c = 0; c < across; ++c) term[c] = hn::LoadU(d, terms[c].data() + at);
      for (int r = 0; r < down; ++r) {
        const V factor = hn::LoadU(d, factors[r].data() + at);
        for (int c = 0; c < across; ++c) tile[r][c] = mul_add(factor, term[c], tile[r][c]);
      }
    }
    for (int r = 0; r < down; ++r)
      for (int c = 0; c < across; ++c) hn::StoreU(tile[r][c], d, sums[r * count + c].data() + lane);
  });
}

template <int down, int across, size_t factors, size_t terms, size_t total>
HWY_INLINE void add_products(const std::array<std::array<float, kBlock>, factors>& arrays,
                             const std::array<std::array<float, kBlock>, terms>& polynomials,
                             int count, std::array<LaneSums::Lanes, total>& sums) {
  static_assert(factors % down == 0);
  for (int r = 0; r < static_cast<int>(factors); r += down)
    for (int c = 0; c < count; c += across)
      add_tile<down, across>(&arrays[static_cast<size_t>(r)], &polynomials[static_cast<size_t>(c)],
                             count, &sums[static_cast<size_t>(r * count + c)]);
}

HWY_INLINE void add_block(const Waiting& waiting, LaneSums& sums) {
  Block block;
  fill(waiting, block);
  add_products<3, 4>(block.place_place, block.polynomials, kDegree6, sums.place_place);
  add_products<2, 5>(block.place_other, block.polynomials, kDegree4, sums.place_other);
  add_products<3, 3>(block.other_other, block.polynomials, 6, sums.other_other);
  add_products<2, 5>(block.place_residual, block.polynomials, kDegree3, sums.place_residual);
  add_products<5, 1>(block.other_residual, block.polynomials, 3, sums.other_residual);
}

HWY_INLINE void add_to(const V& value, LaneSums::Lanes& sums, Eigen::Index lane) {
  const Floats d;
  hn::StoreU(hn::Add(hn::LoadU(d, sums.data() + lane), value), d, sums.data() + lane);
}

/// Adds samples that tell nothing but the light.
HWY_INLINE void add_flat(const TagSamples& samples, const TagRows& rows, Eigen::Index i,
                         const hn::Mask<Floats>& flat, LaneSums& sums) {
  constexpr int kOffset = kOtherFactors - 2, kContrast = kOtherFactors - 1;
  const V x = load(samples.x, i), y = load(samples.y, i), white = load(rows.white, i);
  const V weight = hn::IfThenElseZero(flat, load(rows.weight, i));
  const V weighed_white = hn::Mul(weight, white), residual = load(rows.residual, i);
  const V both[] = {weight, weighed_white, hn::Mul(weighed_white, white)};
  const size_t pairs[] = {pair_at(kOffset, kOffset, kOtherFactors),
                          pair_at(kOffset, kContrast, kOtherFactors),
                          pair_at(kContrast, kContrast, kOtherFactors)};
  V terms[kDegree3];
  polynomials(x, y, terms);
  const Eigen::Index lane = i % kSampleLanes;
  for (size_t k = 0; k < 6; ++k)
    for (size_t p = 0; p < 3; ++p)
      add_to(hn::Mul(both[p], terms[k]), sums.other_other[6 * pairs[p] + k], lane);
  for (size_t k = 0; k < 3; ++k) {
    const V of_term = hn::Mul(residual, terms[k]);
    add_to(hn::Mul(weight, of_term), sums.other_residual[3 * kOffset + k], lane);
    add_to(hn::Mul(weighed_white, of_term), sums.other_residual[3 * kContrast + k], lane);
  }
}

/// Appends the samples of a vector that are not flat to those that wait; returns how many wait now.
HWY_INLINE size_t append(const TagSamples& samples, const TagRows& rows, Eigen::Index i,
                         const hn::Mask<Floats>& steep, size_t count, Waiting& waiting) {
  const Eigen::ArrayXf* const inputs[] = {
      &samples.x,       &samples.y,       &rows.by_x,  &rows.by_y,   &rows.by_blur[0],
      &rows.by_blur[1], &rows.by_blur[2], &rows.white, &rows.weight, &rows.residual};
  for (size_t k = 0; k < kInputs; ++k)
    hn::CompressBlendedStore(load(*inputs[k], i), steep, Floats(), waiting[k].data() + count);
  return count + hn::CountTrue(Floats(), steep);
}

void add_normal_sums(const TagSamples& samples, const TagRows& rows, const FlatLimits& limits,
                     LaneSums& sums) {
  const V slope = set(limits.slope);
  Waiting waiting{};
  size_t count = 0;
  for (Eigen::Index first = 0; first < samples.x.size(); first += kSampleLanes) {
    // All lanes come before a block, so that sums do not depend on the size of vectors.
    for_vectors(kSampleLanes, [&](Eigen::Index lane) HWY_ATTR {
      const Eigen::Index i = first + lane;
      auto steep = hn::Gt(load(rows.slope, i), slope);
      for (size_t k = 0; k < 3; ++k)
        steep = hn::Or(steep, hn::Gt(hn::Abs(load(rows.by_blur[k], i)), set(limits.by_blur[k])));
      add_flat(samples, rows, i, hn::Not(steep), sums);
      count = append(samples, rows, i, steep, count, waiting);
    });
    if (count < kBlock) continue;
    add_block(waiting, sums);
    count -= kBlock;
    for (auto& input : waiting) std::copy_n(input.data() + kBlock, count, input.data());
  }
  for (auto& input : waiting) std::fill(input.data() + count, input.data() + kBlock, 0.0F);
  add_block(waiting, sums);
}

/// Adds `factor` times the combination's rows `from` on, times the polynomials, to `to`.
HWY_INLINE void add_rows(const float* combination, int from, const float* terms, int count,
                         float factor, Eigen::Index column, V& to) {
  const Floats d;
  V sum = hn::LoadU(d, combination + 16 * from + column);  // of the polynomial 1
  for (int k = 1; k < count; ++k)
    sum = mul_add(set(terms[k]), hn::LoadU(d, combination + 16 * (from + k) + column), sum);
  to = mul_add(set(factor), sum, to);
}

void sum_residuals(const TagSamples& samples, const TagRows& rows, const float* share,
                   const float* combination, float* sums) {
  const Floats d;
  for (Eigen::Index i = 0; i < samples.count; ++i) {
    const float x = samples.x[i], y = samples.y[i];
    const float xx = x * x, xy = x * y, yy = y * y;
    const float terms[kDegree3] = {1, x, y, xx, xy, yy, xx * x, xx * y, x * yy, yy * y};
    for_vectors(16, [&](Eigen::Index column) HWY_ATTR {
      V sum = hn::Zero(d);
      add_rows(combination, 0, terms, kDegree3, rows.by_x[i], column, sum);
      add_rows(combination, 10, terms, kDegree3, rows.by_y[i], column, sum);
      for (int k = 0; k < 3; ++k) {
        const float* slopes = combination + 16 * (23 + 2 * k) + column;
        V by_blur = hn::LoadU(d, combination + 16 * (20 + k) + column);
        by_blur = mul_add(set(x), hn::LoadU(d, slopes), by_blur);
        by_blur = mul_add(set(y), hn::LoadU(d, slopes + 16), by_blur);
        sum = mul_add(set(rows.by_blur[static_cast<size_t>(k)][i]), by_blur, sum);
      }
      add_rows(combination, 29, terms, 3, 1, column, sum);
      add_rows(combination, 32, terms, 3, rows.white[i], column, sum);
      hn::StoreU(hn::Mul(set(share[i]), sum), d, sums + 16 * i + column);
    });
  }
}

/// Adds up over pairs, five sums of all lanes.
void add_pairs(const SampleMaps& maps, int across, int down, std::array<LaneSums::Lanes, 5>& sums) {
  const Floats d;
  const Eigen::Index shift = static_cast<Eigen::Index>(down) * maps.stride + across;
  const Eigen::Index count = static_cast<Eigen::Index>(maps.rows) * maps.stride;
  for_vectors(kSampleLanes, [&](Eigen::Index lane) HWY_ATTR {
    V pairs = hn::Zero(d), slopes = pairs, squares = pairs, residuals = pairs, mixed = pairs;
    for (Eigen::Index k = SampleMaps::kReach + lane; k < SampleMaps::kReach + count;
         k += kSampleLanes) {
      const auto product = [&](const Eigen::ArrayXf& map)
                               HWY_ATTR { return hn::Mul(load(map, k), load(map, k + shift)); };
      const V slope = hn::Add(product(maps.gradient_u), product(maps.gradient_v));
      const V residual = product(maps.residual);
      pairs = hn::Add(pairs, product(maps.there));
      slopes = hn::Add(slopes, slope);
      squares = mul_add(slope, slope, squares);
      residuals = hn::Add(residuals, residual);
      mixed = mul_add(residual, slope, mixed);
    }
    const V all[] = {pairs, slopes, squares, residuals, mixed};
    for (size_t s = 0; s < 5; ++s) hn::StoreU(all[s], d, sums[s].data() + lane);
  });
}

void add_paired(const float* weights, Eigen::Index count, const int* place, const int* sample_at,
                std::array<double, 16>& sums) {
  const Floats d;
  for_vectors(16, [&](Eigen::Index column) HWY_ATTR {
    // Blocks of samples are added up in double precision.
    constexpr Eigen::Index kTogether = 256;
    for (Eigen::Index first = 0; first < count; first += kTogether) {
      V sum = hn::Zero(d);
      const Eigen::Index end = std::min(first + kTogether, count);
      for (Eigen::Index i = first; i < end; ++i) {
        const Eigen::Index partner = sample_at[place[i]];
        if (partner >= count) continue;
        sum = mul_add(hn::LoadU(d, weights + 16 * i + column),
                      hn::LoadU(d, weights + 16 * partner + column), sum);
      }
      LaneSums::Lanes lanes;
      hn::StoreU(sum, d, lanes.data());
      for (size_t l = 0; l < hn::Lanes(d); ++l)
        sums[static_cast<size_t>(column) + l] += static_cast<double>(lanes[l]);
    }
  });
}

void add_shifts(const float* from, int from_side, std::span<const GridShift> shifts, int side,
                float* to) {
  const Floats d;
  const auto step = static_cast<int>(hn::Lanes(d));
  for (int row = 0; row < side; ++row)
    // The last vector of a row starts earlier and repeats some numbers.
    for (int next = 0; next < side; next += step) {
      const int column = std::max(0, std::min(next, side - step));
      V sum = hn::Zero(d);
      for (const GridShift& shift : shifts)
        sum = mul_add(set(shift.weight),
                      hn::LoadU(d, from + (row + shift.rows) * from_side + column + shift.columns),
                      sum);
      hn::StoreU(sum, d, to + row * side + column);
    }
}

/// Returns the share of the own level at a place, counted in cells from the middle of one.
HWY_INLINE V own_share(const std::array<float, CellGrid::kSteps + 2>& shares,
                       const V& from_middle) {
  const hn::RebindToSigned<Floats> integers;
  const V most = set(CellGrid::kSteps);
  const V step = hn::Min(hn::Mul(hn::Abs(from_middle), set(2 * CellGrid::kSteps)), most);
  const auto at = hn::ConvertTo(integers, step);
  const V here = hn::GatherIndex(Floats(), shares.data(), at);
  const V next = hn::GatherIndex(Floats(), shares.data() + 1, at);
  return mul_add(hn::Sub(step, hn::ConvertTo(Floats(), at)), hn::Sub(next, here), here);
}

HWY_INLINE void add_where(const hn::Mask<Floats>& mask, const V& value, float* sum) {
  const Floats d;
  hn::StoreU(hn::Add(hn::LoadU(d, sum), hn::IfThenElseZero(mask, value)), d, sum);
}

/// Adds what the samples around corners see, lane by lane.
HWY_INLINE void add_corners(const V& x, const V& y, float cell, const std::array<V, 2>& slope,
                            const V& robust, Eigen::Index lane, CornerSums& sums) {
  const V across = hn::Abs(x), down = hn::Abs(y), zero = hn::Zero(Floats());
  const auto near = hn::And(hn::Gt(hn::Min(across, down), set(1 - 1.5F * cell)),
                            hn::Lt(hn::Max(across, down), set(1 + 0.2F * cell)));
  const auto right = hn::Gt(x, zero), bottom = hn::Gt(y, zero);
  const hn::Mask<Floats> corners[] = {hn::AndNot(right, bottom), hn::And(right, bottom),
                                      hn::AndNot(bottom, right), hn::Not(hn::Or(right, bottom))};
  for (size_t c = 0; c < 4; ++c)
    for (size_t edge = 0; edge < 2; ++edge) {
      const auto here = hn::And(near, corners[c]);
      add_where(here, slope[edge], sums.slope[c][edge].data() + lane);
      add_where(here, hn::Mul(slope[edge], robust), sums.seen[c][edge].data() + lane);
    }
}

void fill_cells(const TagModel& model, const CellGrid& grid, const TagSamples& samples,
                const TagRows& rows, CellRows& cells, CornerSums& sums) {
  const Floats d;
  const hn::RebindToSigned<Floats> integers;
  const V half = set(0.5F), first = set(grid.first), per_unit = set(grid.per_unit);
  const auto last = hn::Set(integers, grid.across - 1), none = hn::Set(integers, -1);
  for_vectors(samples.x.size(), [&](Eigen::Index i) HWY_ATTR {
    const V x = load(samples.x, i), y = load(samples.y, i);
    V terms[kDegree3];
    polynomials(x, y, terms);
    const V place_x = combined(terms, model.bend_x, x), place_y = combined(terms, model.bend_y, y);
    const V robust = load(rows.robust, i);
    add_corners(place_x, place_y, 1 / grid.per_unit,
                {hn::Abs(load(rows.by_x, i)), hn::Abs(load(rows.by_y, i))}, robust,
                i % kSampleLanes, sums);

    const V u = hn::Mul(hn::Sub(place_x, first), per_unit);
    const V v = hn::Mul(hn::Sub(place_y, first), per_unit);
    const auto column = hn::ConvertTo(integers, hn::Floor(u)),
               row = hn::ConvertTo(integers, hn::Floor(v));
    const auto zero = hn::Zero(integers);
    const auto at_column = hn::Min(hn::Max(column, zero), last),
               at_row = hn::Min(hn::Max(row, zero), last);
    const auto inside = hn::And(hn::Eq(column, at_column), hn::Eq(row, at_row));
    const auto cell = hn::Add(hn::Mul(at_row, hn::Set(integers, grid.across)), at_column);
    hn::StoreU(hn::IfThenElse(inside, cell, none), integers, cells.cell.data() + i);

    const auto middle = [&](const auto& which)
                            HWY_ATTR { return hn::Add(hn::ConvertTo(d, which), half); };
    const V share = hn::Mul(own_share(grid.share_x, hn::Sub(u, middle(at_column))),
                            own_share(grid.share_y, hn::Sub(v, middle(at_row))));
    // Something plain in front may pass for less light, so the contrast is that of this place.
    const V contrast = combined(terms, model.contrast, hn::Zero(d));
    const V change = hn::Mul(hn::Mul(hn::GatherIndex(d, grid.turned, cell), contrast), share);
    // Of the pixel unharmed; where there is none both weights are 0.
    const V weight = hn::Div(load(rows.weight, i), hn::Max(robust, set(1e-30F)));
    const V weighed_change = hn::Mul(weight, change);
    store(hn::Mul(weighed_change, change), cells.information, i);
    store(hn::Mul(weighed_change, load(rows.residual, i)), cells.moment, i);
  });
}

}  // namespace HWY_NAMESPACE
}  // namespace
}  // namespace clothfit
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace clothfit {
namespace {

HWY_EXPORT(evaluate);
HWY_EXPORT(weigh);
HWY_EXPORT(add_normal_sums);
HWY_EXPORT(sum_residuals);
HWY_EXPORT(add_pairs);
HWY_EXPORT(add_paired);
HWY_EXPORT(add_shifts);
HWY_EXPORT(fill_cells);

double total(const LaneSums::Lanes& lanes) {
  double sum = 0;
  for (const float lane : lanes) sum += static_cast<double>(lane);
  return sum;
}

/// An unknown's derivative: a factor times the polynomial x^i y^j.
struct Derivative {
  int factor, i, j;
};

constexpr std::array<Derivative, 35> derivatives() {
  std::array<Derivative, 35> all{};
  size_t next = 0;
  for (int factor = 0; factor < kPlaceFactors; ++factor)
    for (int degree = 0; degree <= 3; ++degree)
      for (int j = 0; j <= degree; ++j) all[next++] = {factor, degree - j, j};
  for (int k = 0; k < 3; ++k) all[next++] = {kPlaceFactors + k, 0, 0};
  for (int k = 0; k < 3; ++k) {
    all[next++] = {kPlaceFactors + k, 1, 0};
    all[next++] = {kPlaceFactors + k, 0, 1};
  }
  for (const int factor : {kFactors - 2, kFactors - 1})
    for (int degree = 0; degree <= 1; ++degree)
      for (int j = 0; j <= degree; ++j) all[next++] = {factor, degree - j, j};
  return all;
}

constexpr size_t polynomial_at(int i, int j) {
  return static_cast<size_t>((i + j) * (i + j + 1) / 2 + j);
}

/// Returns J' W J at one place; `a` does not come after `b`.
double information_at(const LaneSums& sums, const Derivative& a, const Derivative& b) {
  const size_t term = polynomial_at(a.i + b.i, a.j + b.j);
  if (b.factor < kPlaceFactors)
    return total(sums.place_place[pair_at(a.factor, b.factor, kPlaceFactors) * kDegree6 + term]);
  const int other = b.factor - kPlaceFactors;
  if (a.factor < kPlaceFactors)
    return total(
        sums.place_other[static_cast<size_t>(a.factor * kOtherFactors + other) * kDegree4 + term]);
  return total(
      sums.other_other[pair_at(a.factor - kPlaceFactors, other, kOtherFactors) * 6 + term]);
}

double gradient_at(const LaneSums& sums, const Derivative& a) {
  const size_t term = polynomial_at(a.i, a.j);
  if (a.factor < kPlaceFactors)
    return total(sums.place_residual[static_cast<size_t>(a.factor) * kDegree3 + term]);
  return total(sums.other_residual[static_cast<size_t>(a.factor - kPlaceFactors) * 3 + term]);
}

}  // namespace

void TagRows::resize(Eigen::Index count) {
  for (Eigen::ArrayXf* one : {&by_x, &by_y, &by_blur[0], &by_blur[1], &by_blur[2], &white,
                              &residual, &gradient_u, &gradient_v, &slope, &robust, &weight})
    one->resize(count);
}

TagRows TagRows::at(std::span<const Eigen::Index> which) const {
  return {.by_x = by_x(which),
          .by_y = by_y(which),
          .by_blur = {by_blur[0](which), by_blur[1](which), by_blur[2](which)},
          .white = white(which),
          .residual = residual(which),
          .gradient_u = gradient_u(which),
          .gradient_v = gradient_v(which),
          .slope = slope(which),
          .robust = robust(which),
          .weight = weight(which)};
}

void evaluate_rows(const TagModel& model, const TagSamples& samples, TagRows& rows) {
  rows.resize(samples.x.size());
  HWY_DYNAMIC_DISPATCH(evaluate)(model, samples, rows);
}

void weigh_rows(const TagWeights& weights, const TagSamples& samples, TagRows& rows) {
  HWY_DYNAMIC_DISPATCH(weigh)(weights, rows);
  const Eigen::Index none = rows.weight.size() - samples.count;
  rows.robust.tail(none).setZero();
  rows.weight.tail(none).setZero();
}

FlatLimits flat_limits(const TagRows& rows) {
  constexpr float kFlat = 0.03F;
  FlatLimits limits{.slope = kFlat * rows.slope.maxCoeff(), .by_blur = {}};
  for (size_t k = 0; k < 3; ++k) limits.by_blur[k] = kFlat * rows.by_blur[k].abs().maxCoeff();
  return limits;
}

NormalEquations normal_equations(const TagSamples& samples, const TagRows& rows) {
  LaneSums sums;
  HWY_DYNAMIC_DISPATCH(add_normal_sums)(samples, rows, flat_limits(rows), sums);
  static constexpr std::array<Derivative, 35> kAll = derivatives();
  NormalEquations equations;
  for (size_t b = 0; b < kAll.size(); ++b) {
    const auto row = static_cast<Eigen::Index>(b);
    for (size_t a = 0; a <= b; ++a) {
      const auto column = static_cast<Eigen::Index>(a);
      equations.information(row, column) = information_at(sums, kAll[a], kAll[b]);
      equations.information(column, row) = equations.information(row, column);
    }
    equations.gradient[row] = gradient_at(sums, kAll[b]);
  }
  return equations;
}

CellRows cell_rows(const TagModel& model, const CellGrid& grid, const TagSamples& samples,
                   const TagRows& rows) {
  CellRows cells;
  cells.cell.resize(static_cast<size_t>(samples.x.size()));
  cells.information.resize(samples.x.size());
  cells.moment.resize(samples.x.size());
  CornerSums sums;
  HWY_DYNAMIC_DISPATCH(fill_cells)(model, grid, samples, rows, cells, sums);
  for (size_t c = 0; c < 4; ++c)
    for (size_t edge = 0; edge < 2; ++edge) {
      cells.slope[c][edge] = total(sums.slope[c][edge]);
      cells.seen[c][edge] = total(sums.seen[c][edge]);
    }
  return cells;
}

ResidualSums residual_sums(const TagSamples& samples, const TagRows& rows,
                           const Eigen::ArrayXf& share,
                           const Eigen::Matrix<float, 35, 16, Eigen::RowMajor>& combination) {
  ResidualSums sums(samples.count, 16);
  HWY_DYNAMIC_DISPATCH(sum_residuals)
  (samples, rows, share.data(), combination.data(), sums.data());
  return sums;
}

PairSums pair_sums(const SampleMaps& maps, int across, int down) {
  std::array<LaneSums::Lanes, 5> sums{};
  HWY_DYNAMIC_DISPATCH(add_pairs)(maps, across, down, sums);
  return {.pairs = total(sums[0]),
          .slopes = total(sums[1]),
          .square_slopes = total(sums[2]),
          .residuals = total(sums[3]),
          .mixed = total(sums[4])};
}

Eigen::Matrix<double, 16, 1> paired_products(const ResidualSums& weights,
                                             std::span<const int> place,
                                             std::span<const int> sample_at, int shift) {
  std::array<double, 16> sums{};
  HWY_DYNAMIC_DISPATCH(add_paired)
  (weights.data(), weights.rows(), place.data(), sample_at.data() + shift, sums);
  return Eigen::Map<const Eigen::Matrix<double, 16, 1>>(sums.data());
}

void sum_of_shifts(const float* from, int from_side, std::span<const GridShift> shifts, int side,
                   float* to) {
  assert(side >= kSampleLanes);
  HWY_DYNAMIC_DISPATCH(add_shifts)(from, from_side, shifts, side, to);
}

}  // namespace clothfit
#endif
