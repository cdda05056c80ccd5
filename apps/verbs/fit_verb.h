#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "data/recording.h"
#include "fit/interface/fit_options.h"

namespace clothfit {

struct FitVerbOptions {
  std::filesystem::path recording;
  FitOptions fit;
  bool keep = false;                  ///< write the result also where it is not to be used
  std::filesystem::path out;          ///< empty: NAME.fit
  std::filesystem::path earlier_fit;  ///< the file that --start or --forecast names; may be empty
  bool allow_outside = false;         ///< as in typed_recording
  /// Verb and options as fit.json keeps them, without those that change no result (--out,
  /// --threads).
  std::string command;
  std::string diagnose_command;  ///< that asks what the model lacks, with the same options
};

/// Completes the recording, fits it, writes the result folder, prints the tables. Returns an exit
/// code; throws InputError, NoResult, Cancelled.
int run_fit(const FitVerbOptions& options);

}  // namespace clothfit
