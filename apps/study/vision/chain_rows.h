#pragma once

#include <vector>

#include "apps/study/vision/vision_row.h"

namespace clothfit {

inline constexpr const char* kChainOfTags = "chain_tags";
inline constexpr const char* kChainOfDots = "chain_dots";
inline constexpr const char* kChainOfCloth = "chain_cloth";

/// Rows that follow pictures to the end, through tracking to a fit (chain_study.h).
const std::vector<VisionRow>& chain_rows();

}  // namespace clothfit
