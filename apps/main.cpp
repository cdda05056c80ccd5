#include <glog/logging.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <Eigen/Core>
#include <cstddef>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <memory>
#include <new>
#include <opencv2/core/utility.hpp>
#include <string>
#include <string_view>
#include <utility>

#include "apps/terminal/command_line.h"
#include "apps/terminal/exit_code.h"
#include "apps/terminal/interrupt.h"
#include "apps/terminal/option_flags.h"
#include "apps/verbs/verb.h"
#include "data/input_error.h"
#include "data/program_version.h"
#include "data/shown_text.h"

namespace {

/// A message without what a terminal takes for commands, which the user's names may hold.
class ShownMessage : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&,
              spdlog::memory_buf_t& to) override {
    const std::string text(message.payload.data(), message.payload.size());
    const std::string shown = clothfit::without_controls(text, true);
    to.append(shown.data(), shown.data() + shown.size());
  }
  std::unique_ptr<spdlog::custom_flag_formatter> clone() const override {
    return std::make_unique<ShownMessage>();
  }
};

/// OpenCV's code for newer processors rounds otherwise than that which every processor has. Eigen
/// cuts long sums by the size of the caches.
void round_alike_on_every_processor() {
  cv::setUseOptimized(false);
  constexpr std::ptrdiff_t kKiB = 1024;
  Eigen::setCpuCacheSizes(32 * kKiB, 1024 * kKiB, 8192 * kKiB);
}

/// Ends the program as for any other lack of memory. Some libraries allocate where nothing may be
/// thrown: nlohmann's JSON in its destructor, libstdc++ when it opens a folder.
[[noreturn]] void end_without_memory() {
  try {
    if (std::current_exception()) std::rethrow_exception(std::current_exception());
  } catch (const std::bad_alloc&) {
    constexpr std::string_view kMessage =
        "clothfit: error: memory: there is not enough for this; a smaller mesh or recording\n";
    static_cast<void>(!write(STDERR_FILENO, kMessage.data(), kMessage.size()));
    _exit(clothfit::kExitBadInput);
  } catch (...) {
  }
  std::abort();
}

/// Parses the command line, runs the verb, and turns exceptions into messages and exit codes.
int run(int argc, char** argv) {
  clothfit::CommandLine line(
      "Measures a moving cloth and identifies the simulator that moves the same way.", "clothfit",
      std::string("clothfit ") + clothfit::program_version());
  clothfit::Verb program = line.program();
  program.requires_verb();
  program.footer("Each verb explains itself: clothfit fit --help");
  clothfit::add_demo_verb(program);
  clothfit::add_sheet_verb(program);
  clothfit::add_detect_verb(program);
  clothfit::add_init_verb(program);
  clothfit::add_calibrate_verb(program);
  clothfit::add_track_verb(program);
  clothfit::add_check_verb(program);
  clothfit::add_fit_verb(program);
  clothfit::add_diagnose_verb(program);
  clothfit::add_simulate_verb(program);
  clothfit::add_drape_verb(program);
  clothfit::add_recover_verb(program);
  clothfit::add_experiment_verb(program);
  clothfit::add_study_verb(program);
  const clothfit::CommandLine::Parsed parsed = line.parse(argc, argv);
  if (parsed.exit_code) return *parsed.exit_code;

  try {
    clothfit::catch_interrupts();
    return parsed.action();
  } catch (const clothfit::InputError& error) {
    spdlog::error("{}", clothfit::with_flags(error.what()));
    return clothfit::kExitBadInput;
  } catch (const clothfit::NoResult& error) {
    spdlog::error("{}", clothfit::with_flags(error.what()));
    return clothfit::kExitNoResult;
  } catch (const clothfit::Cancelled& error) {
    spdlog::warn("{}", error.what());
    return clothfit::kExitCancelled;
  } catch (const std::bad_alloc&) {
    spdlog::error(
        "memory: there is not enough for this; a smaller mesh, recording or number of trials; "
        "docs/formats.md lists the limits");
    return clothfit::kExitBadInput;
  } catch (const std::filesystem::filesystem_error& error) {
    spdlog::error("{}: {}; a file or folder that can be read or written", error.path1().string(),
                  error.code().message());
    return clothfit::kExitBadInput;
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::set_terminate(end_without_memory);
  spdlog::set_default_logger(spdlog::stderr_color_mt("clothfit"));
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  formatter->add_flag<ShownMessage>('*').set_pattern("%n: %^%l%$: %*");
  spdlog::set_formatter(std::move(formatter));
  // Ceres logs what its results say too.
  FLAGS_minloglevel = google::GLOG_FATAL;
  round_alike_on_every_processor();
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    // This is not the user's mistake: a full disk, no memory, or ours.
    spdlog::critical("{}", error.what());
    return 1;
  }
}
