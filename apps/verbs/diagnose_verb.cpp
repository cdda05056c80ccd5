#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "apps/report/diagnosis/diagnosis_json.h"
#include "apps/report/diagnosis/diagnosis_law.h"
#include "apps/report/diagnosis/diagnosis_page.h"
#include "apps/report/diagnosis/diagnosis_tables.h"
#include "apps/report/fit/fit_tables.h"
#include "apps/steps/steps.h"
#include "apps/terminal/csv_table.h"
#include "apps/terminal/exit_code.h"
#include "apps/terminal/grid_size.h"
#include "apps/terminal/interrupt.h"
#include "apps/terminal/progress_line.h"
#include "apps/terminal/result_folder.h"
#include "apps/terminal/say.h"
#include "apps/terminal/text_table.h"
#include "apps/verbs/checked_input.h"
#include "apps/verbs/verb.h"
#include "data/input_error.h"
#include "data/number_text.h"
#include "data/program_version.h"
#include "data/text_file.h"
#include "fit/diagnosis/diagnose.h"
#include "fit/verdict/verdict.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

struct DiagnoseFlags {
  std::vector<fs::path> recordings, held_out;
  bool whole = false;
  fs::path out;
  std::string observations = "automatic";
  std::string mesh;
  std::string loss = "huber";
  std::vector<std::string> priors;
  std::string plant = "10";
  DiagnoseOptions options;
  bool allow_outside = false;
};

/// Reads how many modes are planted.
int parse_plant(const std::string& text) {
  if (text == "all") return std::numeric_limits<int>::max();
  const std::optional<double> count = parse_number(text);
  if (!count || *count < 0 || *count > 1000 || *count != std::floor(*count))
    throw InputError("--plant", "'" + text + "' is no number of modes", "0 to 1000, or all");
  return static_cast<int>(*count);
}

/// Reads the recordings to fit, then those held out. Throws InputError also where one is named
/// twice: a recording that was fitted judges nothing.
std::vector<Recording> read_recordings(const DiagnoseFlags& flags) {
  std::vector<Recording> recordings;
  std::set<fs::path> seen;
  for (const auto* folders : {&flags.recordings, &flags.held_out})
    for (const fs::path& typed : *folders) {
      const fs::path folder = recording_folder(typed);
      if (!seen.insert(fs::weakly_canonical(folder)).second)
        throw InputError(typed.string(), "is named twice",
                         "each recording once, to be fitted or held out");
      recordings.push_back(read_recording(folder, outside_files(flags.allow_outside)));
      if (flags.whole && folders == &flags.recordings)
        recordings.back().held_out_from_frame.reset();
    }
  return recordings;
}

/// Judges the models found as fits are.
void judge_found(Diagnosis& diagnosis) {
  const double expected = std::sqrt(diagnosis.after.discretisation_square),
               found = std::sqrt(diagnosis.after.discretisation_found);
  for (DiagnosedRecording& recording : diagnosis.recordings)
    for (FitReport* report : {&recording.after, &recording.with_law}) {
      if (!report->usable()) continue;
      for (ObservationErrors& errors : report->result.errors) {
        errors.discretisation = errors.noise * expected;
        errors.discretisation_found = errors.noise * found;
      }
      report->result.converged = report->stop == FitStop::converged;
      judge(report->result);
    }
}

void write_results(const Diagnosis& diagnosis, std::span<const Recording> recordings,
                   const std::string& command, const fs::path& folder) {
  write_diagnosis(diagnosis, command, folder / "diagnosis.json");
  write_fit_result(diagnosis.found().result, folder / "fit.json");
  write_model(diagnosis.found().model, folder);
  write_csv_table(candidate_table(diagnosis), folder / "candidates.csv");
  write_csv_table(trial_table(diagnosis), folder / "trials.csv");
  write_csv_table(limit_table(diagnosis), folder / "limits.csv");
  if (!diagnosis.plants.empty()) write_csv_table(plant_table(diagnosis), folder / "planted.csv");
  if (!diagnosis.residual_force.markers.empty())
    write_csv_table(residual_force_table(diagnosis.residual_force, recordings.front()),
                    folder / "residual_force.csv");
  if (diagnosis.law.found() && diagnosis.with_law().usable()) {
    fs::create_directories(folder / "law");
    write_fit_result(diagnosis.with_law().result, folder / "law" / "fit.json");
    write_model(diagnosis.with_law().model, folder / "law");
  }
  write_text(diagnosis_page_html(diagnosis, recordings, command), folder / "report.html");
}

void print_result(const Diagnosis& diagnosis, const fs::path& folder) {
  const auto print = [](const Table& table) { say("{}\n", text_table(table)); };
  say("\n");
  for (const DiagnosedRecording& recording : diagnosis.recordings)
    say("{}", warnings_text(recording.after.result.warnings));
  say("{}\n\n", diagnosis_sentence(diagnosis));
  if (!diagnosis.complete) say("{}\n\n", incomplete_text(diagnosis));
  if (diagnosis.seen_elsewhere)
    say("Markers seen elsewhere: {}\n", seen_elsewhere_text(*diagnosis.seen_elsewhere));
  for (size_t n = 0; n < diagnosis.accepted.size(); ++n) {
    const Hypothesis& term = diagnosis.accepted[n].trial.hypothesis;
    say("{}\n", accepted_text(term, diagnosis.found()));
    if (const std::string remedy = remedy_text(term); !remedy.empty()) say("  {}\n", remedy);
    if (!diagnosis.separation_of(n).empty())
      say("  {}\n", separation_text(term, diagnosis.separation_of(n)));
  }
  for (const Hypothesis& trace : traces(diagnosis))
    say("A trace, little beside the noise or what was found: {}\n", trace.title());
  if (diagnosis.changed()) say("\n");
  print(before_after_table(diagnosis));
  say("Parameters of the model found:\n\n");
  print(short_parameter_table(diagnosis.found().result));
  if (diagnosis.law.found()) {
    say("A law for what remains:\n{}\n\n", diagnosis.law.formula);
    print(law_error_table(diagnosis));
  }
  print(short_candidate_table(diagnosis));
  if (!diagnosis.plants.empty()) {
    say("Planted on twins of the recording:\n");
    print(plant_table(diagnosis));
  }
  say("Report: {}\n", shown_path(folder / "report.html"));
}

int run_diagnose(DiagnoseFlags flags, const std::string& command) {
  FitOptions& fit = flags.options.fit;
  fit.observations = parse_observations(flags.observations);
  if (const auto mesh = parse_mesh(flags.mesh)) {
    fit.mesh_columns = mesh->columns;
    fit.mesh_rows = mesh->rows;
  }
  for (const std::string& prior : flags.priors) fit.priors.push_back(parse_prior(prior));
  flags.options.plants = parse_plant(flags.plant);
  flags.options.reinject = flags.options.plants > 0;
  flags.options.is_enough = [] { return interrupted() && !terminated(); };
  fit.is_cancelled = interrupted;
  fit.loss = flags.loss == "squared" ? Loss::squared : Loss::huber;
  flags.options.validate();
  if (flags.whole && flags.held_out.empty())
    throw InputError("--whole", "no recording judges", "recordings behind --held-out",
                     "name some, or leave --whole out");
  std::vector<Recording> recordings = read_recordings(flags);

  std::vector<fs::path> read;
  for (const Recording& recording : recordings)
    std::ranges::copy(input_paths(recording), std::back_inserter(read));
  ResultFolder out(out_folder(flags.out, recordings.front().name + ".diagnosis"), read);
  Diagnosis diagnosis;
  std::vector<Findings> warnings;
  {
    ProgressLine line;
    const ProgressCallback progress = watch(line);
    std::vector<FitInput> inputs;
    for (Recording& recording : recordings) {
      const fs::path steps = out.path() / "steps";
      CheckedInput checked = checked_input(
          recording, fit.observations,
          recordings.size() > 1 ? steps / std::to_string(inputs.size()) : steps, progress);
      recording = checked.input.recording;
      inputs.push_back(std::move(checked.input));
      warnings.push_back(std::move(checked.findings));
    }
    const std::span<const FitInput> all(inputs);
    diagnosis = diagnose(all.first(flags.recordings.size()), all.subspan(flags.recordings.size()),
                         flags.options, progress);
  }
  if (diagnosis.stop == FitStop::cancelled || (interrupted() && diagnosis.complete))
    throw Cancelled();
  if (!diagnosis.usable()) throw NoResult("no diagnosis: " + diagnosis.message);
  for (size_t n = 0; n < diagnosis.recordings.size(); ++n)
    for (FitReport* report : {&diagnosis.recordings[n].before, &diagnosis.recordings[n].after,
                              &diagnosis.recordings[n].with_law}) {
      std::ranges::copy(warnings[n], std::back_inserter(report->result.warnings));
      report->result.version = program_version();
      report->result.command = command;
    }
  judge_found(diagnosis);
  write_results(diagnosis, recordings, command, out.path());
  if (interrupted() && diagnosis.complete) throw Cancelled();
  out.publish();
  print_result(diagnosis, out.final_path());
  return kExitGood;
}

}  // namespace

void add_diagnose_verb(Verb program) {
  const auto flags = std::make_shared<DiagnoseFlags>();
  DiagnoseOptions& options = flags->options;
  Verb verb = program.add_verb(
      "diagnose", "Find out what the model of a recording lacks, with the error before and after");
  verb.add_option("recordings", &flags->recordings,
                  "Folder of the recording, or of several of one cloth")
      .required()
      .type_name("RECORDING");
  verb.add_option("--held-out", &flags->held_out,
                  "Further recordings of the cloth, which nothing sees until the end")
      .type_name("RECORDING");
  verb.add_flag("--whole", flags->whole,
                "Fit recordings whole, the frames that they hold out included: those behind "
                "--held-out judge");
  verb.add_option("--effect", &options.fit.effects,
                  "Effect that is known to act, fitted from the beginning; may be repeated")
      .type_name("NAME");
  verb.add_option("--without", &options.without, "Effect not to test; may be repeated")
      .type_name("NAME");
  add_prior_option(verb, flags->priors);
  verb.add_option("--observations", &flags->observations,
                  "What to look at: 3D tracks where there are any, unless told otherwise")
      .one_of({"automatic", "tracks3d", "tracks2d"})
      .shows_default();
  verb.add_option("--mesh", &flags->mesh, "Columns and rows of the mesh (default: the recording's)")
      .type_name("CxR")
      .check(check_mesh);
  verb.add_option("--seed", &options.fit.seed, "Seed of the search")
      .check(check_seed)
      .shows_default();
  verb.add_option("--start-nodes", &options.fit.start_nodes,
                  "Nodes per side of the corrections of a start in motion (start: unknown); 0: 4 "
                  "where the first shape is smooth, else 8")
      .shows_default();
  verb.add_option("--loss", &flags->loss,
                  "What large residuals weigh: less than others, or as much")
      .one_of({"huber", "squared"})
      .shows_default();
  verb.add_option("--marker-offsets", &options.fit.marker_offset_sigma_m,
                  "Standard deviation of constants by which markers lie elsewhere than stated, "
                  "such as 10mm")
      .is_length();
  verb.add_option("--drive-knots", &options.fit.drive_knots,
                  "Knots by which tracked held points are corrected; 0: not at all")
      .shows_default();
  verb.add_option("--work", &options.fit.work,
                  "Times as much work as refinement is allowed before it ends unconverged")
      .shows_default();
  verb.add_option("--lines", &options.beam_width,
                  "Entries of the beam that are followed side by side")
      .shows_default();
  verb.add_option("--refits", &options.refits,
                  "Modes that are fitted in one round, of each entry of the beam")
      .shows_default();
  verb.add_option("--most-effects", &options.most_effects, "Effects to add, at most")
      .shows_default();
  verb.add_option("--law-terms", &options.law_terms,
                  "Terms of a law that is proposed for what remains, at most; 0: none is")
      .shows_default();
  verb.add_option("--plant", &flags->plant,
                  "Modes that are planted on twins of the recording at 1.6 times their limit, to "
                  "see whether they are named: a number, or all")
      .shows_default();
  verb.add_option("--budget", &options.budget_s,
                  "Seconds after which the search ends with what it has; 0: it takes what it needs")
      .shows_default();
  verb.add_option("--threads", &options.fit.threads, "Threads; 0 for as many as the machine has")
      .shows_default()
      .shapes_no_result();
  add_out_option(verb, flags->out, "NAME.diagnosis");
  add_outside_option(verb, flags->allow_outside);
  verb.footer(
      "Examples:\n"
      "  clothfit diagnose data/recordings/swing_breeze\n"
      "  clothfit diagnose data/recordings/tags_onecam --without self_contact\n"
      "  clothfit diagnose MONDAY TUESDAY --held-out WEDNESDAY THURSDAY");
  verb.runs([flags, verb] { return run_diagnose(*flags, verb.command_text()); });
}

}  // namespace clothfit
