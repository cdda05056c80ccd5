#include <fmt/format.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>
#include <string>
#include <vector>

#include "apps/exit_code.h"
#include "apps/interrupt.h"
#include "apps/verb.h"
#include "apps/version.h"
#include "data/input_error.h"
#include "data/nearest_name.h"

namespace {

/// Parses the command line, runs the verb, turns what it throws into messages and exit codes.
int run(int argc, char** argv) {
  CLI::App program{"Measures a moving cloth and identifies the simulator that moves the same way.",
                   "clothfit"};
  program.set_version_flag("--version", std::string("clothfit ") + clothfit::program_version());
  program.require_subcommand(1);
  program.footer("Each verb explains itself: clothfit fit --help");

  clothfit::VerbAction action;
  clothfit::add_demo_verb(program, action);
  clothfit::add_calibrate_verb(program, action);
  clothfit::add_track_verb(program, action);
  clothfit::add_fit_verb(program, action);
  clothfit::add_diagnose_verb(program, action);
  clothfit::add_simulate_verb(program, action);
  clothfit::add_recover_verb(program, action);
  clothfit::add_experiment_verb(program, action);
  clothfit::add_study_verb(program, action);
  std::vector<std::string> verbs;
  for (const CLI::App* verb : program.get_subcommands({})) verbs.push_back(verb->get_name());
  const std::string first = argc > 1 ? argv[1] : "-";
  if (!first.starts_with('-') && std::find(verbs.begin(), verbs.end(), first) == verbs.end()) {
    fmt::print(stderr, "There is no verb `{}`; {}\n", first, clothfit::known_names(first, verbs));
    return clothfit::kExitWrongUsage;
  }
  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return program.exit(error) == 0 ? clothfit::kExitGood : clothfit::kExitWrongUsage;
  }

  try {
    clothfit::catch_interrupts();
    return action();
  } catch (const clothfit::InputError& error) {
    spdlog::error("{}", error.what());
    return clothfit::kExitBadInput;
  } catch (const clothfit::NoResult& error) {
    spdlog::error("{}", error.what());
    return clothfit::kExitNoResult;
  } catch (const clothfit::Cancelled& error) {
    spdlog::warn("{}", error.what());
    return clothfit::kExitCancelled;
  }
}

}  // namespace

int main(int argc, char** argv) {
  spdlog::set_default_logger(spdlog::stderr_color_mt("clothfit"));
  spdlog::set_pattern("%n: %^%l%$: %v");
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    // Not the user's mistake: a full disk, no memory, or ours.
    spdlog::critical("{}", error.what());
    return 1;
  }
}
