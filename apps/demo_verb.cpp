#include <fmt/format.h>

#include <memory>

#include "apps/bundled_recording.h"
#include "apps/fit_verb.h"
#include "apps/verb.h"

namespace clothfit {

void add_demo_verb(CLI::App& program, VerbAction& action) {
  const auto options = std::make_shared<FitVerbOptions>();
  CLI::App* verb = program.add_subcommand(
      "demo", "Calibrate, track and fit the bundled recording: from pictures to parameters");
  add_out_option(*verb, options->out, "demo.fit");
  verb->footer("Example:\n  clothfit demo");
  verb->callback([options, &action] {
    action = [options] {
      options->recording = bundled_recording("tags_onecam");
      if (options->out.empty()) options->out = "demo.fit";
      options->command = "clothfit demo";
      fmt::print("Fitting the bundled recording in {}\n", shown_path(options->recording));
      return run_fit(*options);
    };
  });
}

}  // namespace clothfit
