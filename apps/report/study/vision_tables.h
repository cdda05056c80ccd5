#pragma once

#include <string>
#include <vector>

#include "apps/study/vision/chain_result.h"
#include "apps/study/vision/vision_study.h"
#include "apps/terminal/table.h"

namespace clothfit {

/// Lists what was measured, row by row and set by set, for people.
Table short_vision_table(const std::vector<VisionResult>& results);

/// Lists the same with all digits (CSV).
Table vision_table(const std::vector<VisionResult>& results);

/// Lists every number that chains gave, for people and with all digits (CSV). A chain that gave
/// none has a line with its reason.
Table short_chain_table(const std::vector<ChainResult>& results);
Table chain_table(const std::vector<ChainResult>& results);

/// Lists the targets, with misses marked.
Table vision_target_table(const std::vector<VisionTarget>& targets);

/// Writes the page: targets, tables, the command to do it again.
std::string vision_page_html(const std::vector<VisionResult>& results,
                             const std::vector<ChainResult>& chains,
                             const std::vector<VisionTarget>& targets, const std::string& command);

}  // namespace clothfit
