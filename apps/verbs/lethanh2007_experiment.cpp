#include "apps/verbs/lethanh2007_experiment.h"

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "apps/report/study/lethanh2007_page.h"
#include "apps/steps/bundled_recording.h"
#include "apps/terminal/csv_table.h"
#include "apps/terminal/exit_code.h"
#include "apps/terminal/interrupt.h"
#include "apps/terminal/progress_line.h"
#include "apps/terminal/say.h"
#include "apps/terminal/text_table.h"
#include "apps/verbs/resumable_run.h"
#include "data/program_version.h"
#include "data/text_file.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

constexpr const char* kDefaultFolder = "lethanh2007.experiment";

struct Lethanh2007VerbOptions {
  Lethanh2007Options study;
  bool quick = false;
  bool resume = false;
  fs::path out, journal;
  std::string command;
};

int run_lethanh2007(Lethanh2007VerbOptions options) {
  for (const char* garment : {"skirt", "tshirt"})
    options.study.patterns.push_back(bundled_pattern(garment));
  if (options.quick) options.study.spacings_m = {0.04, 0.028, 0.02};
  options.study.validate();
  ResumableRun run(options.out, kDefaultFolder, options.journal);
  Lethanh2007Study study;
  {
    Journal journal(run.journal(), options.study.key(),
                    options.resume ? JournalStart::resume : JournalStart::fresh);
    ProgressLine line;
    study = study_lethanh2007(options.study, &journal, watch(line));
  }
  if (study.cancelled) run.cancel("finished runs");
  write_csv_table(lethanh2007_runs(study), run.folder() / "runs.csv");
  write_csv_table(lethanh2007_correspondences(study), run.folder() / "correspondences.csv");
  write_csv_table(lethanh2007_claims(study), run.folder() / "claims.csv");
  write_text(lethanh2007_page_html(study, options.study, options.command, program_version()),
             run.folder() / "report.html");
  run.publish();
  for (const PaperClaim& claim : paper_claims(study))
    say("\n{}\n  measured: {}\n  {}\n", claim.claim, claim.measured, claim.verdict);
  run.print_report_path();
  return kExitGood;
}

}  // namespace

void add_lethanh2007_experiment(Verb experiment) {
  const auto options = std::make_shared<Lethanh2007VerbOptions>();
  Verb verb = experiment.add_verb("lethanh2007",
                                  "The second founding paper's garments over several resolutions");
  verb.add_flag("--quick", options->quick,
                "Meshes down to 20 mm only: to see what the report looks like");
  add_journal_options(verb, options->journal, options->resume, "runs");
  add_out_option(verb, options->out, kDefaultFolder);
  verb.footer(
      "Examples:\n"
      "  clothfit experiment lethanh2007\n"
      "  clothfit experiment lethanh2007 --quick --out look");
  verb.runs([options, verb] {
    options->command = verb.command_text();
    return run_lethanh2007(*options);
  });
}

}  // namespace clothfit
