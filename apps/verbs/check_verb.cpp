#include <fmt/format.h>
#include <stdlib.h>

#include <memory>
#include <string>

#include "apps/terminal/exit_code.h"
#include "apps/terminal/option_flags.h"
#include "apps/terminal/progress_line.h"
#include "apps/terminal/say.h"
#include "apps/verbs/checked_input.h"
#include "apps/verbs/verb.h"
#include "data/input_error.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

struct CheckVerbOptions {
  fs::path recording;
  std::string observations = "automatic";
  bool allow_outside = false;
};

/// A folder that pictures are tracked into, which goes when this is over. Where the user works, a
/// check writes nothing.
class ScratchFolder {
 public:
  ScratchFolder() {
    const fs::path all = fs::temp_directory_path();
    std::string name = (all / "clothfit-check-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr)
      throw InputError(all.string(), "no folder can be made there", "room for temporary files",
                       "set TMPDIR to a folder that can be written");
    path_ = name;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

const char* verdict(FindingState state) {
  switch (state) {
    case FindingState::passed:
      return "ok";
    case FindingState::warning:
      return "WARNING";
    case FindingState::refused:
      return "WRONG";
  }
  return "";
}

void print_findings(const Findings& findings) {
  for (const Finding& finding : findings) {
    say("{:<8} {:<12} {}\n", verdict(finding.state), finding.check, with_flags(finding.found));
    constexpr const char* kFurther = "                      ";
    if (!finding.expected.empty()) say("{}expected: {}\n", kFurther, with_flags(finding.expected));
    if (!finding.remedy.empty()) say("{}remedy: {}\n", kFurther, with_flags(finding.remedy));
    if (!finding.where.empty()) say("{}in {}\n", kFurther, finding.where);
  }
}

int run_check(const CheckVerbOptions& options) {
  const ObservationKind kind = parse_observations(options.observations);
  const Recording given = typed_recording(options.recording, options.allow_outside);
  Findings findings;
  {
    const ScratchFolder scratch;
    ProgressLine line;
    findings = check_input(given, kind, scratch.path() / "steps", watch(line)).findings;
  }
  print_findings(findings);
  const auto wrong = with_state(findings, FindingState::refused).size(),
             warned = with_state(findings, FindingState::warning).size();
  if (wrong > 0)
    say("\nNot to be fitted as it stands: {} wrong, {} to look at.\n", wrong, warned);
  else if (warned > 0)
    say("\nCan be fitted, with {} to look at.\n", warned);
  else
    say("\nNothing contradicts what the recording declares.\n");
  return wrong > 0 ? kExitBadInput : kExitGood;
}

}  // namespace

void add_check_verb(Verb program) {
  const auto options = std::make_shared<CheckVerbOptions>();
  Verb verb = program.add_verb(
      "check", "Hold what a recording declares against its own data, before any fit");
  verb.add_option("recording", &options->recording, "Folder of the recording")
      .required()
      .type_name("RECORDING");
  verb.add_option("--observations", &options->observations,
                  "What to look at: 3D tracks where there are any, unless told otherwise")
      .one_of({"automatic", "tracks3d", "tracks2d"})
      .shows_default();
  add_outside_option(verb, options->allow_outside);
  verb.footer("Example:\n  clothfit check data/recordings/swing_plain");
  verb.runs([options] { return run_check(*options); });
}

}  // namespace clothfit
