#include "fit/measurement_effects/measurement_effect.h"
#include "model/cloth/effect.h"
#include "model/cloth/wording.h"

/// Measures everything larger than it is, by a factor about the middle of the placed sheet. The
/// cause may be a calibration target whose squares are not as long as stated. Parameter: factor
/// (1), neutral at 1. Ours.
namespace clothfit::scale {
namespace {

class Scale final : public MeasurementEffect {
 public:
  void move(const Sighting& sighting, Parameters p, MeasuredPoint& position_m) const override {
    for (int c = 0; c < 3; ++c) {
      const double middle = sighting.sheet_middle_m[c];
      position_m[c] += (p[0] - 1.0) * (position_m[c] - middle);
    }
  }
};

std::string in_words(const FittedEffect& found) {
  const double excess = found.value("factor") - 1;
  if (excess == 0) return {};
  return "everything is measured " + percent(excess, "larger", "smaller") + " than it is";
}

}  // namespace

EffectDescription describe() {
  return {.name = "scale",
          .summary = "what is measured is larger by a factor about the sheet's middle",
          .parameters = {{.name = "factor",
                          .unit = "1",
                          .neutral = 1,
                          .lower = 0.8,
                          .upper = 1.25,
                          .typical = 1e-3}},
          .remedy = "check the units and the size of the cloth",
          .in_words = in_words};
}

std::unique_ptr<MeasurementEffect> make() {
  return std::make_unique<Scale>();
}

}  // namespace clothfit::scale
