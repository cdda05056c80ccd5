#include <fmt/format.h>

#include <memory>

#include "apps/steps/bundled_recording.h"
#include "apps/verbs/fit_verb.h"
#include "apps/verbs/verb.h"

namespace clothfit {

void add_demo_verb(Verb program) {
  const auto options = std::make_shared<FitVerbOptions>();
  Verb verb = program.add_verb(
      "demo", "Calibrate, track and fit the bundled recording: from pictures to parameters");
  add_out_option(verb, options->out, "demo.fit");
  verb.footer("Example:\n  clothfit demo");
  verb.runs([options] {
    options->recording = bundled_recording("tags_onecam");
    if (options->out.empty()) options->out = "demo.fit";
    options->command = "clothfit demo";
    options->diagnose_command = "clothfit diagnose " + shown_path(options->recording);
    say("Fitting the bundled recording in {}\n", shown_path(options->recording));
    return run_fit(*options);
  });
}

}  // namespace clothfit
