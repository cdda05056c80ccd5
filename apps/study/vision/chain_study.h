#pragma once

#include <filesystem>
#include <vector>

#include "apps/study/vision/chain_result.h"
#include "apps/study/vision/vision_study.h"
#include "data/progress.h"

namespace clothfit {

/// Follows pictures through tracking to a fit for the rows of chain_rows() that are asked for, one
/// after the other. Sets that are not below `options.data` are left out; what cannot be read or
/// fitted has its reason. Videos and recordings are written below `steps`. Throws InputError for
/// options that make no sense, Cancelled when `progress` asks to stop.
std::vector<ChainResult> study_chain(const VisionStudyOptions& options,
                                     const std::filesystem::path& steps,
                                     const ProgressCallback& progress);

/// Compares the results with what is aimed at, set by set.
std::vector<VisionTarget> chain_targets(const std::vector<ChainResult>& results);

}  // namespace clothfit
