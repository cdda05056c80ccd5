#include <cmath>
#include <numbers>

#include "fit/measurement_effects/measurement_effect.h"
#include "model/cloth/effect.h"
#include "model/cloth/wording.h"

/// Places the pattern of markers elsewhere on the cloth than stated. A marker that is said to be at
/// (s, t) is at (s + ds, t + dt),
///
///   ds = shift_s + stretch_s (s - s_m) - turn (t - t_m)
///   dt = shift_t + stretch_t (t - t_m) + turn (s - s_m),
///
/// (s_m, t_m) the mean of all markers. It appears where the surface is there, to second order:
///
///   x + x_s ds + x_t dt + x_ss ds^2 / 2 + x_st ds dt + x_tt dt^2 / 2
///
/// First order would miss 0.1 mm at a curvature of 10 /m and 5 mm. Parameters: shift_s, shift_t
/// (m), stretch_s, stretch_t (1), turn (rad), neutral at 0. Ours.
namespace clothfit::marker_placement {
namespace {

class MarkerPlacement final : public MeasurementEffect {
 public:
  bool shifts_place() const override { return true; }

  void shift_place(const Sighting& sighting, Parameters p, MeasuredPair& shift_m) const override {
    const double s = sighting.from_pattern_middle_m[0], t = sighting.from_pattern_middle_m[1];
    shift_m[0] += p[0] + p[2] * s - p[4] * t;
    shift_m[1] += p[1] + p[3] * t + p[4] * s;
  }
};

/// Turned by (-turn t, turn s), t down, a pattern is turned clockwise by atan turn.
std::string in_words(const FittedEffect& found) {
  if (found.mode == "turn") {
    const double turn = found.value("turn");
    if (turn == 0) return {};
    return "the pattern is turned by " +
           rounded(std::atan(std::abs(turn)) * 180 / std::numbers::pi) + " degrees " +
           (turn > 0 ? "clockwise" : "counterclockwise");
  }
  if (found.mode == "stretch") {
    const auto side = [&](const char* name, const char* more, const char* less) {
      const double stretch = found.value(name);
      return stretch == 0 ? std::string() : percent(stretch, more, less);
    };
    const std::string sides =
        listed({side("stretch_s", "wider", "narrower"), side("stretch_t", "longer", "shorter")});
    return sides.empty() ? sides : "the pattern is " + sides + " than stated";
  }
  const std::string way = way_over_cloth({found.value("shift_s"), found.value("shift_t")});
  return way.empty() ? way : "the pattern lies " + way;
}

}  // namespace

EffectDescription describe() {
  return {.name = "marker_placement",
          .summary = "the pattern of markers is shifted, stretched and turned on the cloth",
          .parameters = {{.name = "shift_s",
                          .unit = "m",
                          .neutral = 0,
                          .lower = -0.05,
                          .upper = 0.05,
                          .typical = 1e-3},
                         {.name = "shift_t",
                          .unit = "m",
                          .neutral = 0,
                          .lower = -0.05,
                          .upper = 0.05,
                          .typical = 1e-3},
                         {.name = "stretch_s",
                          .unit = "1",
                          .neutral = 0,
                          .lower = -0.2,
                          .upper = 0.2,
                          .typical = 2e-3},
                         {.name = "stretch_t",
                          .unit = "1",
                          .neutral = 0,
                          .lower = -0.2,
                          .upper = 0.2,
                          .typical = 2e-3},
                         {.name = "turn",
                          .unit = "rad",
                          .neutral = 0,
                          .lower = -0.2,
                          .upper = 0.2,
                          .typical = 2e-3}},
          .modes = {{.name = "shift", .amplitudes = {"shift_s", "shift_t"}, .shapes = {}},
                    {.name = "stretch", .amplitudes = {"stretch_s", "stretch_t"}, .shapes = {}},
                    {.name = "turn", .amplitudes = {"turn"}, .shapes = {}}},
          .in_words = in_words};
}

std::unique_ptr<MeasurementEffect> make() {
  return std::make_unique<MarkerPlacement>();
}

}  // namespace clothfit::marker_placement
