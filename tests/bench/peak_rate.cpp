#include "tests/bench/peak_rate.h"

#include <chrono>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/bench/peak_rate.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace clothfit {
namespace {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Returns operations per second of twelve chains, as many as cover the latency of two units.
template <class Number, class D>
double rate(D d) {
  using V = hn::Vec<D>;
  constexpr int kChains = 12, kRounds = 100000;
  const V factor = hn::Set(d, Number{0.5}), one = hn::Set(d, Number{1});
  V chain[kChains];
  for (V& value : chain) value = one;
  const auto start = std::chrono::steady_clock::now();
  for (int n = 0; n < kRounds; ++n)
#pragma GCC unroll 12
    for (V& value : chain) value = hn::MulAdd(value, factor, one);
  V sum = hn::Zero(d);
  for (const V& value : chain) sum = hn::Add(sum, value);
  [[maybe_unused]] volatile Number keep = hn::GetLane(sum);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  // Without fused instructions Highway multiplies, then adds.
  constexpr int kInstructions = HWY_TARGET <= HWY_AVX2 ? 1 : 2;
  return 1.0 * kChains * kRounds * kInstructions * static_cast<double>(hn::Lanes(d)) / took.count();
}

PeakRate measure() {
  return {rate<double>(hn::ScalableTag<double>()), rate<float>(hn::ScalableTag<float>())};
}

}  // namespace HWY_NAMESPACE
}  // namespace
}  // namespace clothfit
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace clothfit {
namespace {
HWY_EXPORT(measure);
}  // namespace

PeakRate measure_peak_rate() {
  return HWY_DYNAMIC_DISPATCH(measure)();
}

}  // namespace clothfit
#endif
