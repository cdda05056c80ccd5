#pragma once

#include <filesystem>
#include <string>

#include "data/finding.h"
#include "data/input_error.h"
#include "data/progress.h"
#include "data/recording.h"
#include "fit/interface/fit_input.h"
#include "fit/interface/fit_options.h"

namespace clothfit {

/// A recording made ready for a fit, and held against itself.
struct CheckedInput {
  FitInput input;
  Findings findings;  ///< of its declarations alone where these are refused; files as given
};

/// Runs the steps that a recording lacks, below `steps`, reads it, and checks it before anything is
/// fitted. What needs no tracks is checked before the steps. Throws InputError, NoResult,
/// Cancelled.
CheckedInput check_input(const Recording& given, ObservationKind kind,
                         const std::filesystem::path& steps, const ProgressCallback& progress);

/// Does the same, and throws InputError for what is certainly wrong. Findings are warnings then.
CheckedInput checked_input(const Recording& given, ObservationKind kind,
                           const std::filesystem::path& steps, const ProgressCallback& progress);

/// Checks a recording that a step has completed. Its files are named as `given`.
Findings findings_of(const FitInput& input, const Recording& given, ObservationKind kind);

/// Returns what could not be read in the folder of a step as a finding that refuses the recording.
Finding finding_of(const InputError& error, const std::filesystem::path& step,
                   const std::filesystem::path& given);

/// Returns a line for each warning, with an empty line behind them; nothing where there are none.
std::string warnings_text(const Findings& warnings);

}  // namespace clothfit
