#include "fit/diagnosis/diagnose_options.h"

#include "data/input_error.h"
#include "fit/measurement_effects/registry.h"

namespace clothfit {

void DiagnoseOptions::validate() const {
  fit.validate();
  const auto require = [](bool good, const std::string& name, const std::string& expected) {
    if (!good) throw InputError("DiagnoseOptions::" + name, "is out of range", expected);
  };
  require(beam_width >= 1 && beam_width <= 20, "beam_width", "1 to 20");
  require(refits >= 1 && refits <= 50, "refits", "1 to 50");
  require(most_effects >= 0 && most_effects <= 10, "most_effects", "0 to 10");
  require(law_terms >= 0 && law_terms <= 10, "law_terms", "0 to 10");
  require(budget_s >= 0 && budget_s <= 1e9, "budget_s", "0 to 1e9 seconds");
  require(plants >= 0, "plants", "a number of modes, or all");
  if (fit.forecast || fit.start)
    throw InputError("FitOptions::start", "is given", "a diagnosis, which finds its own");
  for (const std::string& effect : without) require_effect(effect, "DiagnoseOptions::without");
}

}  // namespace clothfit
