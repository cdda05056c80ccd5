#include <cmath>

#include "fit/measurement_effects/measurement_effect.h"
#include "model/cloth/effect.h"
#include "model/cloth/wording.h"

/// Smooths the tracks over time: a marker appears at
///
///   x(t) + w (x(t + d) - 2 x(t) + x(t - d)),
///
/// d is the median frame interval. To the leading order any even kernel of variance v (s2) does
/// this, with w = v / (2 d^2): its mean of x is x + v/2 d2x/dt2. A running mean of three frames has
/// w = 1/3, one of 2 n + 1 frames n (n + 1) / 6. Places are mixed, not pixels. Parameter: w (1),
/// neutral at 0, which is its lower bound. Ours.
namespace clothfit::temporal_smoothing {
namespace {

class TemporalSmoothing final : public MeasurementEffect {
 public:
  bool mixes_neighbours() const override { return true; }

  void mix_neighbours(const Sighting&, Parameters p, MeasuredNumber& weight) const override {
    weight += p[0];
  }
};

/// A kernel of variance v has w = v / (2 d^2).
std::string in_words(const FittedEffect& found) {
  const double w = found.value("w");
  if (!(w > 0)) return {};
  const double deviation_frames = std::sqrt(2 * w);
  return "averaged over time with a standard deviation of " +
         rounded(1e3 * deviation_frames * found.frame_interval_s) + " ms (" +
         rounded(deviation_frames) + " frames)";
}

}  // namespace

EffectDescription describe() {
  return {.name = "temporal_smoothing",
          .summary = "tracks smoothed over time: x + w (x(t + d) - 2 x + x(t - d))",
          .parameters =
              {{.name = "w", .unit = "1", .neutral = 0, .lower = 0, .upper = 1, .typical = 0.01}},
          .in_words = in_words};
}

std::unique_ptr<MeasurementEffect> make() {
  return std::make_unique<TemporalSmoothing>();
}

}  // namespace clothfit::temporal_smoothing
