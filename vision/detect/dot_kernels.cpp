#include "vision/detect/dot_kernels.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

// This source is compiled once for each instruction set, in a namespace of its own.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "vision/detect/dot_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifndef CLOTHFIT_VISION_DETECT_DOT_KERNELS_ONCE
#define CLOTHFIT_VISION_DETECT_DOT_KERNELS_ONCE
namespace clothfit {
namespace {

constexpr int kDotLanes = 16;
using DotLanes = std::array<float, kDotLanes>;  ///< one sum per lane

/// Sums of products of columns that stand at and below the diagonal, three by three of them.
constexpr int kTile = 3;
struct DotLaneSums {
  std::array<std::array<DotLanes, kDotUnknowns>, kDotUnknowns> information;
  std::array<DotLanes, kDotUnknowns> gradient;
  DotLanes robust;
};

constexpr size_t kWaves = 3, kWaveSums = 8 * kWaves + 1;

}  // namespace
}  // namespace clothfit
#endif

HWY_BEFORE_NAMESPACE();
namespace clothfit {
namespace {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, kDotLanes>;
using Integers = hn::RebindToSigned<Floats>;
using V = hn::Vec<Floats>;
using I = hn::Vec<Integers>;

HWY_INLINE V set(float number) {
  return hn::Set(Floats(), number);
}

HWY_INLINE V load(const DotRow& from, int at) {
  return hn::LoadU(Floats(), from.data() + at);
}

HWY_INLINE void store(const V& values, DotRow& to, int at) {
  hn::StoreU(values, Floats(), to.data() + at);
}

/// Returns a b + c, the product rounded first.
HWY_INLINE V mul_add(const V& a, const V& b, const V& c) {
  return hn::Add(hn::Mul(a, b), c);
}

HWY_INLINE V square_of(const V& a) {
  return hn::Mul(a, a);
}

/// Calls `visit(i)` for the first pixel of each vector.
template <class Visit>
HWY_INLINE void for_vectors(int count, const Visit& visit) {
  const auto step = static_cast<int>(hn::Lanes(Floats()));
  for (int i = 0; i < count; i += step) visit(i);
}

/// Says which lanes of a vector come before the `count`-th.
HWY_INLINE hn::Mask<Floats> first_of(int count) {
  return hn::FirstN(Floats(), static_cast<size_t>(std::clamp(count, 0, kDotLanes)));
}

/// Returns 1 / sqrt(a) of positive normal numbers by Newton's method, right to 1e-7. Square root
/// and division take as long as all the rest.
HWY_INLINE V inverse_root(const V& a) {
  const Integers integers;
  const I bits =
      hn::Sub(hn::Set(integers, 0x5f375a86), hn::ShiftRight<1>(hn::BitCast(integers, a)));
  V y = hn::BitCast(Floats(), bits);
  const V half = hn::Mul(set(0.5F), a), three_halves = set(1.5F);
  for (int i = 0; i < 3; ++i) y = hn::Mul(y, hn::Sub(three_halves, hn::Mul(half, hn::Mul(y, y))));
  return y;
}

/// Returns 1 / a of positive normal numbers, right to 1e-7.
HWY_INLINE V inverse_of(const V& a) {
  const Integers integers;
  const I bits = hn::Sub(hn::Set(integers, 0x7ef311c3), hn::BitCast(integers, a));
  V y = hn::BitCast(Floats(), bits);
  const V two = set(2);
  for (int i = 0; i < 3; ++i) y = hn::Mul(y, hn::Sub(two, hn::Mul(a, y)));
  return y;
}

/// Returns e^a of numbers <= 0, right to 1e-6, and no less than 1e-11: products of what is next to
/// nothing are too small to be normal, and processors take a hundred times as long over them.
HWY_INLINE V exponential(const V& a) {
  const Integers integers;
  constexpr float kLeast = -25, kPerLog2 = 1.44269504F;
  const V power = hn::Mul(hn::Max(a, set(kLeast)), set(kPerLog2));
  const V rounder = set(12582912);  // 1.5 * 2^23: adding it rounds to whole numbers
  const V whole = hn::Sub(hn::Add(power, rounder), rounder);
  const V part = hn::Sub(power, whole);
  V sum = set(1.5403530e-4F);
  for (const float coefficient :
       {1.3333558e-3F, 9.6181291e-3F, 5.5504109e-2F, 0.24022651F, 0.69314718F, 1.0F})
    sum = mul_add(sum, part, set(coefficient));
  const I exponent = hn::ShiftLeft<23>(hn::ConvertTo(integers, whole));
  return hn::BitCast(Floats(), hn::Add(hn::BitCast(integers, sum), exponent));
}

/// Turns a row of a picture into numbers.
HWY_INLINE void read_row(const PixelBox& box, int row, DotRow& line) {
  const hn::Rebind<std::uint8_t, Floats> bytes;
  const hn::RebindToSigned<Floats> integers;
  // A copy: no vector may read past the picture's end.
  std::array<std::uint8_t, kRowPixels> copy;
  const std::uint8_t* from = box.first + row * box.row_bytes;
  const auto columns = static_cast<size_t>(box.columns);
  if (box.stride == 1)
    std::memcpy(copy.data(), from, columns);
  else
    for (size_t k = 0; k < columns; ++k) copy[k] = from[k * static_cast<size_t>(box.stride)];
  for_vectors(box.columns, [&](int k) HWY_ATTR {
    const I levels = hn::PromoteTo(integers, hn::LoadU(bytes, copy.data() + k));
    store(hn::ConvertTo(Floats(), levels), line, k);
  });
}

/// The columns of a row that are taken: from `first` to `last`.
struct TakenColumns {
  int first = 0, last = -1;
};

/// An outline gives one run of pixels in each row.
HWY_INLINE TakenColumns columns_within(const PixelBox& box, const DotReach& reach, int row) {
  const Floats d;
  const V bxx = set(reach.inverse[0]), bxy = set(reach.inverse[1]), byy = set(reach.inverse[2]);
  const V one = set(1), beyond = set(reach.beyond_px), farthest = set(reach.ratio * reach.ratio);
  const V steps = hn::Iota(d, 0), stride = set(static_cast<float>(box.stride));
  const V left = set(box.left - reach.x);
  const V dy = set(box.top + static_cast<float>(row * box.stride) - reach.y);
  const V none = set(kMostDotPixels);
  V first = none, last = set(-1);
  for_vectors(box.columns, [&](int k) HWY_ATTR {
    const V column = hn::Add(steps, set(static_cast<float>(k)));
    const V dx = mul_add(column, stride, left);
    const V qx = mul_add(bxx, dx, hn::Mul(bxy, dy)), qy = mul_add(bxy, dx, hn::Mul(byy, dy));
    const V square = hn::Max(mul_add(qx, qx, hn::Mul(qy, qy)), set(1e-8F));
    const V gx = mul_add(bxx, qx, hn::Mul(bxy, qy)), gy = mul_add(bxy, qx, hn::Mul(byy, qy));
    // The distance is (|q| - 1) / slope, with slope = |B q| / |q|.
    const V square_gradient = hn::Max(mul_add(gx, gx, hn::Mul(gy, gy)), set(1e-16F));
    const V slope = hn::Mul(square_gradient, inverse_root(hn::Mul(square_gradient, square)));
    const V most = square_of(mul_add(beyond, slope, one));
    const auto taken =
        hn::And(first_of(box.columns - k),
                hn::Or(hn::Le(square, one), hn::Le(square, hn::Min(most, farthest))));
    first = hn::Min(first, hn::IfThenElse(taken, column, none));
    last = hn::Max(last, hn::IfThenElse(taken, column, set(-1)));
  });
  return {.first = static_cast<int>(hn::GetLane(hn::MinOfLanes(d, first))),
          .last = static_cast<int>(hn::GetLane(hn::MaxOfLanes(d, last)))};
}

void gather(const PixelBox& box, const DotReach& reach, DotPixels& pixels) {
  const Floats d;
  const V steps = hn::Iota(d, 0), stride = set(static_cast<float>(box.stride));
  DotRow line;
  int count = 0;
  for (int row = 0; row < box.rows && count < kMostDotPixels; ++row) {
    const TakenColumns taken = columns_within(box, reach, row);
    if (taken.last < taken.first) continue;
    read_row(box, row, line);
    const V y = set(box.top + static_cast<float>(row * box.stride));
    const V left = set(box.left);
    const int more = std::min(taken.last - taken.first + 1, kMostDotPixels - count);
    for_vectors(more, [&](int k) HWY_ATTR {
      const V column = hn::Add(steps, set(static_cast<float>(taken.first + k)));
      hn::StoreU(mul_add(column, stride, left), d, pixels.x.data() + count + k);
      hn::StoreU(y, d, pixels.y.data() + count + k);
      hn::StoreU(hn::LoadU(d, line.data() + taken.first + k), d, pixels.grey.data() + count + k);
    });
    count += more;
  }
  pixels.count = count;
  pixels.darkest = pixels.brightest = 0;
  if (count == 0) return;
  for (DotRow* values : {&pixels.x, &pixels.y, &pixels.grey})
    std::fill(values->begin() + count, values->begin() + pixels.padded(), values->front());
  V darkest = set(pixels.grey[0]), brightest = darkest;
  for_vectors(pixels.padded(), [&](int i) HWY_ATTR {
    darkest = hn::Min(darkest, load(pixels.grey, i));
    brightest = hn::Max(brightest, load(pixels.grey, i));
  });
  pixels.darkest = hn::GetLane(hn::MinOfLanes(d, darkest));
  pixels.brightest = hn::GetLane(hn::MaxOfLanes(d, brightest));
}

void add_dark(const PixelBox& box, const DotReach& reach, float level, bool bright,
              std::array<DotLanes, 3>& sums) {
  const Floats d;
  const V bxx = set(reach.inverse[0]), bxy = set(reach.inverse[1]), byy = set(reach.inverse[2]);
  const V farthest = set(reach.ratio * reach.ratio), half = set(level), none = hn::Zero(d);
  const V sign = set(bright ? -1.0F : 1.0F), steps = hn::Iota(d, 0);
  const V stride = set(static_cast<float>(box.stride)), left = set(box.left - reach.x);
  std::array<DotLanes, 3> local;
  for (DotLanes& lanes : local) lanes.fill(0);
  DotRow line;
  for (int row = 0; row < box.rows; ++row) {
    read_row(box, row, line);
    const V dy = set(box.top + static_cast<float>(row * box.stride) - reach.y);
    for_vectors(box.columns, [&](int k) HWY_ATTR {
      const V dx = mul_add(hn::Add(steps, set(static_cast<float>(k))), stride, left);
      const V qx = mul_add(bxx, dx, hn::Mul(bxy, dy)), qy = mul_add(bxy, dx, hn::Mul(byy, dy));
      const auto within =
          hn::And(first_of(box.columns - k), hn::Le(mul_add(qx, qx, hn::Mul(qy, qy)), farthest));
      const V dark =
          hn::IfThenElseZero(within, hn::Max(hn::Mul(sign, hn::Sub(half, load(line, k))), none));
      const auto add = [&](DotLanes& lanes, const V& more) HWY_ATTR {
        float* sum = lanes.data() + k % kDotLanes;
        hn::StoreU(hn::Add(hn::LoadU(d, sum), more), d, sum);
      };
      add(local[0], dark);
      add(local[1], hn::Mul(dark, dx));
      add(local[2], hn::Mul(dark, dy));
    });
  }
  sums = local;
}

/// Where a pixel lies about the dot.
struct Around {
  V dx, dy;
  V square, inverse_length;  ///< of q
  V ex, ey;                  ///< q / |q|
};

HWY_INLINE Around around(const DotShape& shape, const DotPixels& pixels, int i) {
  const V bxx = set(shape.inverse[0]), bxy = set(shape.inverse[1]), byy = set(shape.inverse[2]);
  Around at;
  at.dx = hn::Sub(load(pixels.x, i), set(shape.x));
  at.dy = hn::Sub(load(pixels.y, i), set(shape.y));
  const V qx = mul_add(bxx, at.dx, hn::Mul(bxy, at.dy));
  const V qy = mul_add(bxy, at.dx, hn::Mul(byy, at.dy));
  at.square = hn::Max(mul_add(qx, qx, hn::Mul(qy, qy)), set(1e-8F));
  at.inverse_length = inverse_root(at.square);
  at.ex = hn::Mul(qx, at.inverse_length);
  at.ey = hn::Mul(qy, at.inverse_length);
  return at;
}

/// The distribution function of the normal distribution at -d, and its density times sqrt(2 pi).
struct Normal {
  V share, density;
};

/// Needs one exponential [abramowitz1964, 7.1.26]; errors are below 1e-6.
HWY_INLINE Normal normal_at(const V& d) {
  const V density = exponential(hn::Mul(set(-0.5F), square_of(d)));
  const V z = hn::Mul(hn::Abs(d), set(static_cast<float>(M_SQRT1_2)));
  const V t = inverse_of(mul_add(set(0.3275911F), z, set(1)));
  V sum = set(1.061405429F);
  for (const float coefficient : {-1.453152027F, 1.421413741F, -0.284496736F, 0.254829592F})
    sum = mul_add(sum, t, set(coefficient));
  const V tail = hn::Mul(hn::Mul(set(0.5F), density), hn::Mul(t, sum));
  return {.share = hn::IfThenElse(hn::Gt(d, hn::Zero(Floats())), tail, hn::Sub(set(1), tail)),
          .density = density};
}

HWY_INLINE V evaluate_at(const DotShape& shape, const DotPixels& pixels, DotRows& rows, int i) {
  const Around at = around(shape, pixels, i);
  const V bxx = set(shape.inverse[0]), bxy = set(shape.inverse[1]), byy = set(shape.inverse[2]);
  V nx = mul_add(bxx, at.ex, hn::Mul(bxy, at.ey)), ny = mul_add(bxy, at.ex, hn::Mul(byy, at.ey));
  // A pixel right on the centre has no direction; whatever it gets is inside.
  const V inverse_gradient = inverse_root(hn::Max(mul_add(nx, nx, hn::Mul(ny, ny)), set(1e-10F)));
  nx = hn::Mul(nx, inverse_gradient);
  ny = hn::Mul(ny, inverse_gradient);
  const V nxx = square_of(nx), nxy = hn::Mul(nx, ny), nyy = square_of(ny);
  // The blur across the normal in units of q; for a circle that of q itself.
  const V variance =
      mul_add(set(shape.blur[0]), nxx,
              mul_add(set(2 * shape.blur[1]), nxy, hn::Mul(set(shape.blur[2]), nyy)));
  const V inverse_blur = inverse_root(hn::Max(variance, set(1e-4F)));
  const V square_radius = hn::Add(at.square, set(shape.across));
  const V inverse_radius = inverse_root(square_radius);
  const V radius = hn::Mul(square_radius, inverse_radius);
  const V distance =  // in blurs
      hn::Mul(hn::Mul(hn::Sub(radius, set(1)), inverse_gradient), inverse_blur);
  const Normal inside = normal_at(distance);

  const V lx = hn::Mul(load(pixels.x, i), set(shape.per_light_scale));
  const V ly = hn::Mul(load(pixels.y, i), set(shape.per_light_scale));
  const V light =
      mul_add(set(shape.light[1]), lx, mul_add(set(shape.light[2]), ly, set(shape.light[0])));
  const V left = hn::Sub(set(1), hn::Mul(set(shape.contrast), inside.share));
  store(hn::Sub(load(pixels.grey, i), hn::Mul(light, left)), rows.residual, i);
  // d grey / d distance_px
  const V steepness = hn::Mul(
      hn::Mul(set(shape.contrast * static_cast<float>(0.5 * M_2_SQRTPI * M_SQRT1_2)), light),
      hn::Mul(inside.density, inverse_blur));
  const V slope = hn::Abs(steepness);
  store(slope, rows.slope, i);

  const V length = hn::Mul(at.square, at.inverse_length);
  const V by_radius = hn::Mul(steepness, hn::Mul(length, inverse_radius));
  const V by_square = hn::Mul(by_radius, inverse_gradient);
  const V by_variance = hn::Mul(hn::Mul(set(-0.5F), steepness), hn::Mul(distance, inverse_blur));
  const V by_mixed = mul_add(at.ex, at.dy, hn::Mul(at.ey, at.dx));
  const std::array<V, kDotUnknowns> columns = {hn::Neg(hn::Mul(by_radius, nx)),
                                               hn::Neg(hn::Mul(by_radius, ny)),
                                               hn::Mul(by_square, hn::Mul(at.ex, at.dx)),
                                               hn::Mul(by_square, by_mixed),
                                               hn::Mul(by_square, hn::Mul(at.ey, at.dy)),
                                               by_variance,
                                               hn::Mul(by_variance, hn::Sub(nxx, nyy)),
                                               hn::Mul(by_variance, hn::Add(nxy, nxy)),
                                               hn::Neg(hn::Mul(light, inside.share)),
                                               left,
                                               hn::Mul(left, lx),
                                               hn::Mul(left, ly)};
  for (size_t k = 0; k < columns.size(); ++k) store(columns[k], rows.jacobian[k], i);
  return slope;
}

void evaluate(const DotShape& given, const DotPixels& pixels, DotRows& rows) {
  const DotShape shape = given;  // a copy of its own, which no store to `rows` can change
  V steepest = hn::Zero(Floats());
  for_vectors(pixels.padded(), [&](int i) HWY_ATTR {
    steepest = hn::Max(steepest, evaluate_at(shape, pixels, rows, i));
  });
  rows.steepest = hn::GetLane(hn::MaxOfLanes(Floats(), steepest));
}

/// Numbers per pixel that say whether it is taken: 0, or -1 where it is.
struct alignas(64) Taken : std::array<std::int32_t, kRowPixels> {};

HWY_INLINE void store(const hn::Mask<Floats>& taken, Taken& to, int at) {
  const Integers integers;
  hn::StoreU(hn::BitCast(integers, hn::VecFromMask(Floats(), taken)), integers, to.data() + at);
}

/// Numbers >= 0 of which the middle one is sought bit by bit.
struct Median {
  static constexpr int kFirstBit = 30, kLastBit = 14;  // the last is 0.2 % of a float
  DotRow values;                                       ///< with room for a vector behind the last
  int count = 0;
  int bits = 0;

  HWY_INLINE void take(const DotRow& all, const Taken& taken, int size) {
    int next = 0;
    // Without a branch: what is not taken is written over.
    for (int i = 0; i < size; ++i) {
      values[static_cast<size_t>(next)] = all[static_cast<size_t>(i)];
      next -= taken[static_cast<size_t>(i)];
    }
    store(set(std::numeric_limits<float>::infinity()), values, next);
    count = next;
  }

  HWY_INLINE void settle(int bit) {
    const Integers integers;
    const I limit = hn::Set(integers, bits | bit);
    I less = hn::Zero(integers);
    for_vectors(count, [&](int i) HWY_ATTR {
      const I value = hn::BitCast(integers, load(values, i));
      less = hn::Sub(less, hn::VecFromMask(integers, hn::Lt(value, limit)));
    });
    const int below = hn::GetLane(hn::SumOfLanes(integers, less));
    bits |= below <= count / 2 ? bit : 0;
  }

  HWY_INLINE float value() const {
    const I middle = hn::Set(Integers(), bits | 1 << (kLastBit - 1));
    return count == 0 ? 0 : hn::GetLane(hn::BitCast(Floats(), middle));
  }
};

void add_residuals(const DotPixels& pixels, const DotRows& rows, DotResiduals& sums,
                   DotLanes& square_slopes) {
  const Floats d;
  constexpr float kFlat = 0.1F, kSteep = 0.4F;  // of the steepest slope
  const V flat_most = set(kFlat * rows.steepest), steep_least = set(kSteep * rows.steepest);
  Taken is_flat, is_steep;
  DotRow size, size_px;
  for_vectors(pixels.padded(), [&](int i) HWY_ATTR {
    const V slope = load(rows.slope, i), residual = hn::Abs(load(rows.residual, i));
    const auto steep_here = hn::And(first_of(pixels.count - i), hn::Gt(slope, steep_least));
    const V inverse = hn::IfThenElseZero(steep_here, inverse_of(slope));
    store(residual, size, i);
    store(hn::Mul(residual, inverse), size_px, i);
    store(hn::Lt(slope, flat_most), is_flat, i);
    store(steep_here, is_steep, i);
    float* sum = square_slopes.data() + i % kDotLanes;
    hn::StoreU(mul_add(inverse, inverse, hn::LoadU(d, sum)), d, sum);
  });
  Median flat, steep;
  flat.take(size, is_flat, pixels.count);
  steep.take(size_px, is_steep, pixels.count);
  // Both in turn, so that one goes on while the other waits.
  for (int bit = 1 << Median::kFirstBit; bit >= 1 << Median::kLastBit; bit >>= 1) {
    flat.settle(bit);
    steep.settle(bit);
  }
  sums = {.flat = flat.count,
          .steep = steep.count,
          .flat_levels = flat.value(),
          .steep_px = steep.value()};
}

void weigh(const DotPixels& pixels, const DotWeights& weights, DotRows& rows, DotLaneSums& sums) {
  const Floats d;
  const V noise = set(weights.square_noise), rough = set(weights.square_roughness);
  const V per_loss = set(1 / weights.square_loss);
  sums.robust.fill(0);
  for_vectors(pixels.padded(), [&](int i) HWY_ATTR {
    const V slope = load(rows.slope, i), residual = load(rows.residual, i);
    const V variance = mul_add(rough, hn::Mul(slope, slope), noise);
    // robust = 1 / (1 + residual^2 / (loss^2 variance))
    const auto there = first_of(pixels.count - i);
    const V weight = hn::IfThenElseZero(
        there, inverse_of(mul_add(per_loss, hn::Mul(residual, residual), variance)));
    store(weight, rows.weight, i);
    float* robust = sums.robust.data() + i % kDotLanes;
    hn::StoreU(mul_add(variance, weight, hn::LoadU(d, robust)), d, robust);
  });
}

/// Adds up the products of columns `a` on and `b` on.
HWY_INLINE void add_tile(const DotRows& rows, int count, size_t a, size_t b, DotLaneSums& sums) {
  const Floats d;
  for_vectors(kDotLanes, [&](int lane) HWY_ATTR {
    V tile[kTile][kTile];
    for (auto& row : tile)
      for (V& one : row) one = hn::Zero(d);
    for (int i = lane; i < count; i += kDotLanes) {
      const V weight = load(rows.weight, i);
      V weighed[kTile];
      for (size_t r = 0; r < kTile; ++r)
        weighed[r] = hn::Mul(weight, load(rows.jacobian[a + r], i));
      for (size_t c = 0; c < kTile; ++c) {
        const V other = load(rows.jacobian[b + c], i);
        for (size_t r = 0; r < kTile; ++r) tile[r][c] = mul_add(weighed[r], other, tile[r][c]);
      }
    }
    for (size_t r = 0; r < kTile; ++r)
      for (size_t c = 0; c < kTile; ++c)
        hn::StoreU(tile[r][c], d, sums.information[a + r][b + c].data() + lane);
  });
}

/// Adds up the products of columns `a` on and the residual.
HWY_INLINE void add_gradient(const DotRows& rows, int count, size_t a, DotLaneSums& sums) {
  const Floats d;
  constexpr size_t kTogether = 6;
  for_vectors(kDotLanes, [&](int lane) HWY_ATTR {
    V sum[kTogether];
    for (V& one : sum) one = hn::Zero(d);
    for (int i = lane; i < count; i += kDotLanes) {
      const V pull = hn::Mul(load(rows.weight, i), load(rows.residual, i));
      for (size_t k = 0; k < kTogether; ++k)
        sum[k] = mul_add(pull, load(rows.jacobian[a + k], i), sum[k]);
    }
    for (size_t k = 0; k < kTogether; ++k)
      hn::StoreU(sum[k], d, sums.gradient[a + k].data() + lane);
  });
}

void add_equations(const DotPixels& pixels, const DotWeights& weights, DotRows& rows,
                   DotLaneSums& sums) {
  weigh(pixels, weights, rows, sums);
  const int count = pixels.padded();
  for (size_t a = 0; a < kDotUnknowns; a += kTile)
    for (size_t b = 0; b <= a; b += kTile) add_tile(rows, count, a, b, sums);
  for (size_t a = 0; a < kDotUnknowns; a += kDotUnknowns / 2) add_gradient(rows, count, a, sums);
}

void add_waves(const DotShape& shape, const DotPixels& pixels, const DotRows& rows,
               std::array<DotLanes, kWaveSums>& sums) {
  const Floats d;
  for_vectors(kDotLanes, [&](int lane) HWY_ATTR {
    V sum[kWaveSums];
    for (V& one : sum) one = hn::Zero(d);
    for (int i = lane; i < pixels.padded(); i += kDotLanes) {
      const auto there = first_of(pixels.count - i);
      const V slope = hn::IfThenElseZero(there, load(rows.slope, i));
      const V residual = hn::IfThenElseZero(there, load(rows.residual, i));
      const V weight = load(rows.weight, i);
      const V plain_score = hn::Mul(residual, slope), plain_information = square_of(slope);
      const V score = hn::Mul(weight, plain_score);
      const V information = hn::Mul(weight, plain_information);
      const Around at = around(shape, pixels, i);
      V wave[2] = {at.ex, at.ey};  // of k times the angle
      for (size_t k = 0; k <= kWaves; ++k) {
        const V next = hn::Sub(hn::Mul(wave[0], at.ex), hn::Mul(wave[1], at.ey));
        wave[1] = mul_add(wave[1], at.ex, hn::Mul(wave[0], at.ey));
        wave[0] = next;
        if (k == 0) continue;
        for (size_t phase = 0; phase < 2; ++phase) {
          V* to = sum + 8 * (k - 1) + 4 * phase;
          const V square = square_of(wave[phase]);
          to[0] = mul_add(score, wave[phase], to[0]);
          to[1] = mul_add(information, square, to[1]);
          to[2] = mul_add(plain_score, wave[phase], to[2]);
          to[3] = mul_add(plain_information, square, to[3]);
        }
      }
      sum[kWaveSums - 1] = mul_add(residual, residual, sum[kWaveSums - 1]);
    }
    for (size_t k = 0; k < kWaveSums; ++k) hn::StoreU(sum[k], d, sums[k].data() + lane);
  });
}

}  // namespace HWY_NAMESPACE
}  // namespace
}  // namespace clothfit
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace clothfit {
namespace {

HWY_EXPORT(gather);
HWY_EXPORT(add_dark);
HWY_EXPORT(evaluate);
HWY_EXPORT(add_residuals);
HWY_EXPORT(add_equations);
HWY_EXPORT(add_waves);

/// Returns the sum of the lanes by halves, which compilers turn into vectors.
float total(const DotLanes& lanes) {
  DotLanes sums = lanes;
  for (size_t half = kDotLanes / 2; half > 0; half /= 2)
    for (size_t i = 0; i < half; ++i) sums[i] += sums[i + half];
  return sums[0];
}

}  // namespace

void gather_dot(const PixelBox& box, const DotReach& reach, DotPixels& pixels) {
  HWY_DYNAMIC_DISPATCH(gather)(box, reach, pixels);
}

DarkSums dark_sums(const PixelBox& box, const DotReach& reach, float level, bool bright) {
  std::array<DotLanes, 3> sums;
  HWY_DYNAMIC_DISPATCH(add_dark)(box, reach, level, bright, sums);
  return {.weight = total(sums[0]), .x = total(sums[1]), .y = total(sums[2])};
}

void evaluate_dot(const DotShape& shape, const DotPixels& pixels, DotRows& rows) {
  HWY_DYNAMIC_DISPATCH(evaluate)(shape, pixels, rows);
}

DotResiduals dot_residuals(const DotPixels& pixels, const DotRows& rows) {
  DotResiduals sums;
  DotLanes square_slopes{};
  HWY_DYNAMIC_DISPATCH(add_residuals)(pixels, rows, sums, square_slopes);
  sums.square_slopes = total(square_slopes);
  return sums;
}

DotEquations dot_equations(const DotPixels& pixels, const DotWeights& weights, DotRows& rows) {
  DotLaneSums sums;
  HWY_DYNAMIC_DISPATCH(add_equations)(pixels, weights, rows, sums);
  DotEquations equations;
  for (size_t a = 0; a < kDotUnknowns; ++a) {
    for (size_t b = 0; b <= a; ++b)
      equations.information[a][b] = static_cast<double>(total(sums.information[a][b]));
    equations.gradient[a] = static_cast<double>(total(sums.gradient[a]));
  }
  equations.explained = static_cast<double>(total(sums.robust)) / pixels.count;
  return equations;
}

DotWaves dot_waves(const DotShape& shape, const DotPixels& pixels, const DotRows& rows) {
  std::array<DotLanes, kWaveSums> sums;
  HWY_DYNAMIC_DISPATCH(add_waves)(shape, pixels, rows, sums);
  DotWaves waves;
  const DotLanes* next = sums.data();
  for (std::array<DotWaves::Wave, 2>& phases : waves.waves)
    for (DotWaves::Wave& wave : phases)
      for (float* sum :
           {&wave.score, &wave.information, &wave.plain_score, &wave.plain_information})
        *sum = total(*next++);
  waves.square_residuals = total(*next);
  return waves;
}

}  // namespace clothfit
#endif
