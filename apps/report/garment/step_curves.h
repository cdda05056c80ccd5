#pragma once

#include <string>
#include <vector>

#include "model/garment/drape_garment.h"

namespace clothfit {

/// The steps by which a garment came to rest in one way.
struct StepCurve {
  std::string label;
  const std::vector<GarmentStep>* steps = nullptr;  ///< outliving the curve
};

/// What of the steps a figure shows against time.
enum class StepQuantity {
  spring_error,  ///< the average spring error [lethanh2007], cm
  energy,        ///< above that of each curve's last step, J; logarithmic
  force          ///< residual force over the weight; logarithmic
};

/// Draws a quantity of all curves against their seconds; nothing without curves. `since` says from
/// when the seconds count.
std::string step_curves(const std::vector<StepCurve>& curves, StepQuantity quantity,
                        const std::string& since);

}  // namespace clothfit
