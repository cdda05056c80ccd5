#pragma once

#include <nlohmann/json_fwd.hpp>

#include "data/finding.h"

namespace clothfit {

/// Returns a finding as result files have it: `check`, `found`, `where`, `expected`, `remedy`. Its
/// state is told by the list that it stands in.
nlohmann::ordered_json to_json(const Finding& finding);

}  // namespace clothfit
