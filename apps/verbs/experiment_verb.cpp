#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>

#include "apps/report/study/louchet1995_page.h"
#include "apps/report/study/louchet1995_tables.h"
#include "apps/study/louchet1995/study.h"
#include "apps/terminal/csv_table.h"
#include "apps/terminal/exit_code.h"
#include "apps/terminal/progress_line.h"
#include "apps/terminal/say.h"
#include "apps/terminal/text_table.h"
#include "apps/verbs/identification_experiment.h"
#include "apps/verbs/lethanh2007_experiment.h"
#include "apps/verbs/resumable_run.h"
#include "apps/verbs/verb.h"
#include "data/program_version.h"
#include "data/text_file.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

struct ExperimentVerbOptions {
  Louchet1995Options study;
  fs::path out;      ///< empty: louchet1995.experiment
  fs::path journal;  ///< empty: beside the output folder, gone with success
  bool resume = false;
  std::string command;  ///< verb and options as the report keeps them
};

constexpr const char* kDefaultFolder = "louchet1995.experiment";

void write_results(const Louchet1995Study& study, const ExperimentVerbOptions& options,
                   const fs::path& folder) {
  for (const StudyTable& one : louchet1995_files(study))
    write_csv_table(one.table, folder / one.file);
  const StudyTable timing = louchet1995_timing(study);
  write_csv_table(timing.table, folder / timing.file);
  write_text(louchet1995_page_html(study, options.study, options.command, program_version()),
             folder / "report.html");
}

void print_targets(const Louchet1995Study& study) {
  Table table = target_table(study);
  const std::string mark = "measured: ";
  for (std::vector<std::string>& row : table.rows)
    for (std::string& cell : row)
      if (cell.starts_with(mark)) cell.erase(0, mark.size());
  say("\n{}\n", text_table(table));
}

int run_louchet1995(const ExperimentVerbOptions& options) {
  options.study.validate();
  ResumableRun run(options.out, kDefaultFolder, options.journal);
  Louchet1995Study study;
  {
    Journal journal(run.journal(), options.study.key(),
                    options.resume ? JournalStart::resume : JournalStart::fresh);
    ProgressLine line;
    study = study_louchet1995(options.study, &journal, watch(line));
  }
  if (study.cancelled) run.cancel("finished pieces");
  write_results(study, options, run.folder());
  run.publish();
  print_targets(study);
  run.print_report_path();
  return kExitGood;
}

}  // namespace

void add_experiment_verb(Verb program) {
  Verb verb = program.add_verb("experiment",
                               "Run an experiment of the literature or of our own, with a report");
  verb.requires_verb();
  verb.footer(
      "Example:\n"
      "  clothfit experiment louchet1995 --help");

  add_identification_experiment(verb);
  add_lethanh2007_experiment(verb);
  const auto options = std::make_shared<ExperimentVerbOptions>();
  Verb louchet1995 = verb.add_verb(
      "louchet1995", "The founding paper's identification of a simulated cloth, section 3");
  louchet1995
      .add_option("--seeds", &options->study.seeds,
                  "Seeds of the recoveries; comparisons take a fifth")
      .shows_default();
  louchet1995.add_option("--seed", &options->study.seed, "The first of the seeds").shows_default();
  louchet1995
      .add_option("--threads", &options->study.threads, "Threads; 0 for as many as the machine has")
      .shows_default()
      .shapes_no_result();
  louchet1995.add_flag("--quick", options->study.quick,
                       "Coarse grids and short searches: to see what the report looks like");
  add_journal_options(louchet1995, options->journal, options->resume, "pieces");
  add_out_option(louchet1995, options->out, kDefaultFolder);
  louchet1995.footer(
      "Examples:\n"
      "  clothfit experiment louchet1995\n"
      "  clothfit experiment louchet1995 --quick --seeds 2 --out look");
  louchet1995.runs([options, louchet1995] {
    options->command = louchet1995.command_text();
    return run_louchet1995(*options);
  });
}

}  // namespace clothfit
