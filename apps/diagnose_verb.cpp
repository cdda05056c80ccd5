#include <fmt/format.h>

#include <memory>

#include "apps/csv_table.h"
#include "apps/exit_code.h"
#include "apps/grid_size.h"
#include "apps/interrupt.h"
#include "apps/progress_line.h"
#include "apps/report/diagnosis_json.h"
#include "apps/report/diagnosis_law.h"
#include "apps/report/diagnosis_page.h"
#include "apps/report/diagnosis_tables.h"
#include "apps/steps.h"
#include "apps/text_table.h"
#include "apps/verb.h"
#include "apps/version.h"
#include "data/output_folder.h"
#include "data/text_file.h"
#include "fit/diagnose.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

struct DiagnoseFlags {
  fs::path recording;
  fs::path out;
  std::string observations = "automatic";
  std::string mesh;
  std::string loss = "huber";
  DiagnoseOptions options;
};

/// What diagnosis.json keeps of the command line: the options that shape the result.
std::string command_text(const DiagnoseFlags& flags) {
  const DiagnoseOptions defaults;
  std::string text = "clothfit diagnose " + flags.recording.string();
  for (const std::string& effect : flags.options.fit.effects) text += " --effect " + effect;
  for (const std::string& effect : flags.options.without) text += " --without " + effect;
  if (flags.observations != "automatic") text += " --observations " + flags.observations;
  if (!flags.mesh.empty()) text += " --mesh " + flags.mesh;
  if (flags.loss != "huber") text += " --loss " + flags.loss;
  const auto add = [&](const char* flag, const auto& value, const auto& default_value) {
    if (value != default_value) text += fmt::format(" {} {}", flag, value);
  };
  add("--seed", flags.options.fit.seed, defaults.fit.seed);
  add("--start-nodes", flags.options.fit.start_nodes, defaults.fit.start_nodes);
  add("--work", flags.options.fit.work, defaults.fit.work);
  add("--lines", flags.options.lines, defaults.lines);
  add("--refits", flags.options.refits, defaults.refits);
  add("--most-effects", flags.options.most_effects, defaults.most_effects);
  return text;
}

void write_results(const Diagnosis& diagnosis, const Recording& recording,
                   const std::string& command, const fs::path& folder) {
  write_diagnosis(diagnosis, command, folder / "diagnosis.json");
  write_fit_result(diagnosis.found.result, folder / "fit.json");
  write_model(diagnosis.found.model, folder);
  const auto csv = [&](const Table& table, const char* name) {
    write_csv_table(table.header, table.rows, folder / name);
  };
  csv(candidate_table(diagnosis), "candidates.csv");
  csv(trial_table(diagnosis), "trials.csv");
  csv(limit_table(diagnosis), "limits.csv");
  if (!diagnosis.residual_force.markers.empty())
    csv(residual_force_table(diagnosis.residual_force, recording), "residual_force.csv");
  if (diagnosis.law.found() && diagnosis.with_law.usable()) {
    fs::create_directories(folder / "law");
    write_fit_result(diagnosis.with_law.result, folder / "law" / "fit.json");
    write_model(diagnosis.with_law.model, folder / "law");
  }
  write_text(diagnosis_page_html(diagnosis, recording, command), folder / "report.html");
}

void print_result(const Diagnosis& diagnosis, const fs::path& folder) {
  const auto print = [](const Table& table) {
    fmt::print("{}\n", text_table(table.header, table.rows));
  };
  fmt::print("\n{}\n\n", diagnosis_sentence(diagnosis));
  for (const AcceptedEffect& accepted : diagnosis.accepted)
    fmt::print("{}: {}\n", accepted.trial.term.title(),
               found_text(accepted.trial.term, diagnosis.found.result));
  if (!diagnosis.accepted.empty()) fmt::print("\n");
  print(before_after_table(diagnosis));
  if (diagnosis.law.found()) {
    fmt::print("A law for what remains:\n{}\n\n", diagnosis.law.formula);
    print(law_error_table(diagnosis));
  }
  print(short_candidate_table(diagnosis));
  fmt::print("Report: {}\n", shown_path(folder / "report.html"));
}

int run_diagnose(DiagnoseFlags flags) {
  FitOptions& fit = flags.options.fit;
  fit.observations = parse_observations(flags.observations);
  if (const auto mesh = parse_mesh(flags.mesh)) {
    fit.mesh_columns = mesh->columns;
    fit.mesh_rows = mesh->rows;
  }
  fit.loss = flags.loss == "squared" ? Loss::squared : Loss::huber;
  flags.options.validate();
  const std::string command = command_text(flags);
  const Recording given = read_recording(recording_folder(flags.recording));

  OutputFolder out(out_folder(flags.out, given.name + ".diagnosis"));
  Recording recording;
  Diagnosis diagnosis;
  {
    ProgressLine line;
    const ProgressCallback progress = watch(line);
    recording = complete_recording(given, fit.observations, {}, out.path() / "steps", progress);
    diagnosis = diagnose(read_fit_input(recording, fit.observations), flags.options, progress);
  }
  if (diagnosis.stop == FitStop::cancelled || interrupted()) throw Cancelled();
  if (!diagnosis.usable()) throw NoResult("no diagnosis: " + diagnosis.message);
  diagnosis.base.result.version = diagnosis.found.result.version =
      diagnosis.with_law.result.version = program_version();
  diagnosis.base.result.command = diagnosis.found.result.command =
      diagnosis.with_law.result.command = command;
  write_results(diagnosis, recording, command, out.path());
  if (interrupted()) throw Cancelled();
  out.publish();
  print_result(diagnosis, out.final_path());
  return kExitGood;
}

}  // namespace

void add_diagnose_verb(CLI::App& program, VerbAction& action) {
  const auto flags = std::make_shared<DiagnoseFlags>();
  DiagnoseOptions& options = flags->options;
  CLI::App* verb = program.add_subcommand(
      "diagnose", "Find out what the model of a recording lacks, with the error before and after");
  verb->add_option("recording", flags->recording, "Folder of the recording")
      ->required()
      ->type_name("RECORDING");
  verb->add_option("--effect", options.fit.effects,
                   "Effect that is known to act, fitted from the beginning; may be repeated")
      ->type_name("NAME");
  verb->add_option("--without", options.without, "Effect not to test; may be repeated")
      ->type_name("NAME");
  verb->add_option("--observations", flags->observations,
                   "What to look at: 3D tracks where there are any, unless told otherwise")
      ->check(CLI::IsMember({"automatic", "tracks3d", "tracks2d"}))
      ->capture_default_str();
  verb->add_option("--mesh", flags->mesh, "Columns and rows of the mesh (default: the recording's)")
      ->type_name("CxR")
      ->check(check_mesh);
  verb->add_option("--seed", options.fit.seed, "Seed of the search")
      ->check(check_seed)
      ->capture_default_str();
  verb->add_option("--start-nodes", options.fit.start_nodes,
                   "Nodes per side of the corrections of a start in motion (start: unknown)")
      ->capture_default_str();
  verb->add_option("--loss", flags->loss,
                   "What large residuals weigh: less than others, or as much")
      ->check(CLI::IsMember({"huber", "squared"}))
      ->capture_default_str();
  verb->add_option("--work", options.fit.work,
                   "Times as much work as refinement is allowed before it ends unconverged")
      ->capture_default_str();
  verb->add_option("--lines", options.lines, "Lines of search that are followed side by side")
      ->capture_default_str();
  verb->add_option("--refits", options.refits, "Laws of each line that are fitted in one round")
      ->capture_default_str();
  verb->add_option("--most-effects", options.most_effects, "Effects to add, at most")
      ->capture_default_str();
  verb->add_option("--threads", options.fit.threads, "Threads; 0 for as many as the machine has")
      ->capture_default_str();
  add_out_option(*verb, flags->out, "NAME.diagnosis");
  verb->footer(
      "Examples:\n"
      "  clothfit diagnose data/recordings/swing_breeze\n"
      "  clothfit diagnose data/recordings/tags_onecam --without self_contact");
  verb->callback([flags, &action] { action = [flags] { return run_diagnose(*flags); }; });
}

}  // namespace clothfit
