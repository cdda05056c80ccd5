#pragma once

#include <filesystem>
#include <string>

#include "apps/study/louchet1995/study.h"

namespace clothfit {

struct ExperimentVerbOptions {
  Louchet1995Options study;
  std::filesystem::path out;      ///< empty: louchet1995.experiment
  std::filesystem::path journal;  ///< empty: beside the output folder, gone with success
  bool resume = false;
  std::string command;  ///< verb and options as the report keeps them
};

/// Runs the founding paper's experiment, writes the result folder, prints the targets. Returns an
/// exit code; throws InputError, Cancelled.
int run_louchet1995(const ExperimentVerbOptions& options);

}  // namespace clothfit
