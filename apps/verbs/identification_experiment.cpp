#include "apps/verbs/identification_experiment.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>

#include "apps/report/page/html.h"
#include "apps/report/study/recover_tables.h"
#include "apps/study/trials/identification_targets.h"
#include "apps/terminal/csv_table.h"
#include "apps/terminal/exit_code.h"
#include "apps/terminal/number_text.h"
#include "apps/terminal/progress_line.h"
#include "apps/terminal/say.h"
#include "apps/terminal/text_table.h"
#include "apps/verbs/resumable_run.h"
#include "data/text_file.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

struct IdentificationOptions {
  TargetsOptions targets;
  fs::path out;       ///< empty: identification.experiment
  fs::path journals;  ///< empty: beside the output folder, gone with success
  bool resume = false;
};

constexpr const char* kIdentificationFolder = "identification.experiment";

std::string state_text(TargetState state) {
  switch (state) {
    case TargetState::met:
      return "met";
    case TargetState::missed:
      return "MISSED";
    case TargetState::not_measured:
      break;
  }
  return "not measured";
}

Table targets_table(const std::vector<TargetRow>& rows) {
  Table table{.header = {"target", "measured", "", "command"}, .rows = {}};
  for (const TargetRow& row : rows)
    table.rows.push_back({row.target, row.measured, state_text(row.state), row.command});
  return table;
}

/// Has a line for each parameter and size of the planted drag.
Table planted_drag_table(const std::vector<PlantedDrag>& drags) {
  Table table{
      .header = {"drag (sigmas)", "parameter", "trials", "undetermined", "truth", "pseudo-truth",
                 "robust 90 %", "stated 90 %", "plain 90 %", "truth: robust", "stated", "plain"},
      .rows = {}};
  const auto percent = [](double share) {
    return std::isfinite(share) ? fmt::format("{:.1f} %", 100 * share) : "-";
  };
  for (const PlantedDrag& drag : drags)
    for (const PlantedDragRow& p : drag.rows)
      table.rows.push_back({fmt::format("{:g}", drag.sigmas), p.parameter, std::to_string(p.trials),
                            std::to_string(p.undetermined), significant(p.truth, 4),
                            significant(p.pseudo_truth, 4), percent(p.holds_pseudo_truth.robust),
                            percent(p.holds_pseudo_truth.stated),
                            percent(p.holds_pseudo_truth.plain), percent(p.holds_truth.robust),
                            percent(p.holds_truth.stated), percent(p.holds_truth.plain)});
  return table;
}

std::string page_html(const Table& targets, const TargetsResult& result) {
  std::string body = "<h1>What identification reaches</h1>\n";
  body += html_table(targets, "Targets, what was measured, and how to measure it again.");
  for (const auto& [study, found] : result.studies)
    body += section(study.name, paragraph(study.what + ".") +
                                    html_table(recovery_counts(found), "Counts.") +
                                    html_table(recovery_table(found), "Errors and intervals."));
  if (!result.planted_drag.empty())
    body += section("planted drag",
                    html_table(planted_drag_table(result.planted_drag),
                               "How often intervals hold the pseudo-true value, where fits without "
                               "the drag of many releases would agree, and the true one."));
  return html_page("What identification reaches", body);
}

int run_identification(const IdentificationOptions& options) {
  options.targets.validate();
  ResumableRun run(options.out, kIdentificationFolder, options.journals, {}, ".journals");
  fs::create_directories(run.journal());
  TargetsResult result;
  {
    ProgressLine line;
    result =
        measure_targets(options.targets, run.journal(),
                        options.resume ? JournalStart::resume : JournalStart::fresh, watch(line));
  }
  if (result.cancelled) run.cancel("finished trials");
  const Table targets = targets_table(result.rows);
  write_csv_table(targets, run.folder() / "targets.csv");
  for (const auto& [study, found] : result.studies) {
    const Table parameters = recovery_table(found);
    const Table trials = recovery_trials_table(found);
    write_csv_table(parameters, run.folder() / (study.name + ".csv"));
    write_csv_table(trials, run.folder() / (study.name + "_trials.csv"));
  }
  const Table planted = planted_drag_table(result.planted_drag);
  if (!planted.rows.empty()) write_csv_table(planted, run.folder() / "planted_drag.csv");
  write_text(page_html(targets, result), run.folder() / "report.html");
  run.publish();
  for (const TargetRow& row : result.rows)
    say("{}\n    {}: {}\n    {}\n", row.target, state_text(row.state), row.measured, row.command);
  if (!planted.rows.empty())
    say("\nIntervals that hold the pseudo-true value, and the true one:\n\n{}\n",
        text_table(planted));
  run.print_report_path();
  return kExitGood;
}

}  // namespace

void add_identification_experiment(Verb experiment) {
  const auto options = std::make_shared<IdentificationOptions>();
  Verb verb = experiment.add_verb("identification",
                                  "What identification is meant to reach: every target, measured");
  verb.add_option("--share", &options->targets.share,
                  "Share of the trials that the targets ask for (all take hours)")
      .shows_default();
  verb.add_option(
          "--only", &options->targets.only,
          "Studies to do: tracks3d, one_camera, spoiled, clean, drag (or drag_1, drag_5, drag_20), "
          "drag_fitted, seconds")
      .type_name("NAME");
  verb.add_option("--seed", &options->targets.seed, "Seed of all studies").shows_default();
  verb.add_option("--threads", &options->targets.threads,
                  "Threads; 0 for as many as the machine has")
      .shows_default()
      .shapes_no_result();
  verb.add_option("--journals", &options->journals,
                  "Folder that keeps finished trials, and stays (default: beside the results, gone "
                  "with success)")
      .shapes_no_result()
      .type_name("FOLDER");
  verb.add_flag("--resume", options->resume, "Go on where the journals end").shapes_no_result();
  add_out_option(verb, options->out, kIdentificationFolder);
  verb.footer(
      "Examples:\n"
      "  clothfit experiment identification\n"
      "  clothfit experiment identification --share 0.05 --only tracks3d seconds");
  verb.runs([options] { return run_identification(*options); });
}

}  // namespace clothfit
