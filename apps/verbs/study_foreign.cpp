#include "apps/verbs/study_foreign.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "apps/report/study/foreign_tables.h"
#include "apps/study/foreign/foreign_study.h"
#include "apps/terminal/csv_table.h"
#include "apps/terminal/exit_code.h"
#include "apps/terminal/progress_line.h"
#include "apps/terminal/say.h"
#include "apps/terminal/text_table.h"
#include "apps/verbs/resumable_run.h"
#include "apps/verbs/verb.h"
#include "data/text_file.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

struct ForeignFlags {
  fs::path folder;
  std::vector<std::string> only;
  fs::path out, journal;
  bool resume = false;
  ForeignStudyOptions options;
};

int run_foreign_study(const ForeignFlags& flags, const std::string& command) {
  ForeignStudyOptions options = flags.options;
  options.recordings = find_foreign_recordings(flags.folder, flags.only);
  options.validate();

  ResumableRun run(flags.out, "foreign.study", flags.journal, {flags.folder});
  const fs::path steps = run.folder() / "steps";
  std::vector<ForeignRow> rows;
  {
    Journal journal(run.journal(), options.key(),
                    flags.resume ? JournalStart::resume : JournalStart::fresh);
    ProgressLine line;
    try {
      rows = study_foreign(options, steps, &journal, watch(line));
    } catch (const Cancelled&) {
      run.cancel(
          fmt::format("{} of {} diagnoses", journal.finished().size(), options.recordings.size()));
    }
  }
  fs::remove_all(steps);
  write_csv_table(foreign_table(rows), run.folder() / "foreign.csv");
  write_text(foreign_page_html(rows, command), run.folder() / "report.html");
  run.publish();

  const Table table = short_foreign_table(rows), summary = foreign_summary(rows);
  say("\n{}\n{}\n{}\n", text_table(table), text_table(summary), longest_text(rows));
  run.print_report_path();
  if (std::ranges::none_of(rows, &ForeignRow::judged))
    throw NoResult("no recording could be diagnosed: " + rows.front().diagnosis.reason);
  return kExitGood;
}

}  // namespace

void add_foreign_study(Verb study) {
  const auto flags = std::make_shared<ForeignFlags>();
  Verb verb = study.add_verb(
      "foreign", "Diagnose recordings that another program simulated, and judge by their truth");
  verb.add_option("folder", &flags->folder,
                  "Folder with recordings in it, each with a truth.json beside recording.yaml")
      .required()
      .type_name("FOLDER");
  verb.add_option("--only", &flags->only, "Recording to diagnose; may be repeated (default: all)")
      .one_at_a_time()
      .type_name("NAME");
  verb.add_option("--seed", &flags->options.seed, "Seed of the searches")
      .check(check_seed)
      .shows_default();
  verb.add_option("--budget", &flags->options.budget_s,
                  "Seconds after which a search ends with what it has; 0: it takes what it needs")
      .shows_default();
  add_journal_options(verb, flags->journal, flags->resume, "diagnoses");
  verb.add_option("--threads", &flags->options.threads,
                  "Threads of one diagnosis; 0 for as many as the machine has")
      .shows_default()
      .shapes_no_result();
  add_out_option(verb, flags->out, "foreign.study");
  verb.footer(
      "Example:\n"
      "  clothfit study foreign recordings --only swing_plain --only swing_hem");
  verb.runs([flags, verb] { return run_foreign_study(*flags, verb.command_text()); });
}

}  // namespace clothfit
