#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "data/finding.h"

namespace clothfit {

/// Lists rising numbers as a person would: "0 to 63" or "0, 4, 7". Of many ranges the first few are
/// named, and the rest counted.
std::string list_numbers(const std::vector<int>& numbers);

/// Warns that frames have no picture, which leaves their time empty and moves no other frame.
Finding missing_frames(const std::vector<int>& frames, std::int64_t of, const std::string& where);

}  // namespace clothfit
