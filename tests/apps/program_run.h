#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace clothfit::test {

struct ProgramRun {
  int exit_code = -1;  ///< 128 + signal where a signal killed it, as a shell has it
  std::string out;
  std::string error;
};

/// Runs the built `clothfit` in `folder` and waits for its end. `while_running`, where given, is
/// called with the process id once it has started.
ProgramRun run_program(const std::vector<std::string>& arguments,
                       const std::filesystem::path& folder,
                       const std::function<void(int process)>& while_running = {});

/// Returns names in `folder`, hidden ones too, sorted; without the two files that hold the output.
std::vector<std::string> names_in(const std::filesystem::path& folder);

}  // namespace clothfit::test
