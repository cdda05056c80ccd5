#pragma once

namespace clothfit {

/// The peak rate of a core on the chosen instruction set (numbers per second). One addition,
/// multiplication or fused pair of them is counted once. It is measured with independent chains
/// that stay in registers and takes some milliseconds.
struct PeakRate {
  double double_per_s = 0;
  double float_per_s = 0;
};
PeakRate measure_peak_rate();

}  // namespace clothfit
