#include "fit/measurement_effects/scale.h"

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

}  // namespace

EffectDescription describe() {
  return {.name = "scale",
          .summary = "what is measured is larger by a factor about the sheet's middle",
          .parameters = {{.name = "factor",
                          .unit = "1",
                          .neutral = 1,
                          .lower = 0.8,
                          .upper = 1.25,
                          .typical = 1e-3}}};
}

std::unique_ptr<MeasurementEffect> make() {
  return std::make_unique<Scale>();
}

}  // namespace clothfit::scale
