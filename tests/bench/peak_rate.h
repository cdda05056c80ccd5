#pragma once

namespace clothfit {

/// What a core can do at most on the chosen instruction set (numbers per second), one addition,
/// multiplication or fused pair of them counted once: measured with independent chains that stay in
/// registers. Takes some milliseconds.
struct PeakRate {
  double double_per_s = 0;
  double float_per_s = 0;
};
PeakRate measure_peak_rate();

}  // namespace clothfit
