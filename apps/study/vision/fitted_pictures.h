#pragma once

#include <filesystem>

#include "apps/study/vision/chain_result.h"
#include "data/progress.h"
#include "data/recording.h"

namespace clothfit {

/// Runs what a recording of pictures lacks, below `steps`, and fits it as `clothfit fit` does with
/// its defaults. The numbers are the share of markers found (%), the fitted parameters, and the rms
/// error per coordinate on held-out frames (px). Throws InputError, NoResult, Cancelled.
ChainResult fit_pictures(const Recording& recording, const std::filesystem::path& steps,
                         const ProgressCallback& progress);

/// Does the same and diagnoses it as `clothfit diagnose --plant 0` does. The numbers are the share
/// of markers found (%), the parameters of the declared model, and `adequate`: 1 where that verdict
/// was reached, else 0.
ChainResult diagnose_pictures(const Recording& recording, const std::filesystem::path& steps,
                              const ProgressCallback& progress);

}  // namespace clothfit
