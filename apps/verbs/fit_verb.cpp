#include "apps/verbs/fit_verb.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <memory>
#include <optional>
#include <utility>

#include "apps/report/fit/background_picture.h"
#include "apps/report/fit/fit_page.h"
#include "apps/report/fit/fit_tables.h"
#include "apps/report/fit/summary.h"
#include "apps/steps/fit_step.h"
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

namespace clothfit {
namespace {

namespace fs = std::filesystem;

struct FitFlags {
  std::string observations = "automatic";
  std::string mesh;
  fs::path forecast;
  std::string springs;  ///< empty: the earlier fit's, or the fabric
  std::string cost = "trajectory";
  std::string search = "paper";
  std::string loss = "huber";
  fs::path start;
  std::vector<std::string> priors;
};

/// Returns the parameter set asked for, or that of the earlier fit which `flag` names.
SpringSet chosen_springs(const std::string& asked, const char* flag, const FitResult* earlier) {
  const std::optional<SpringSet> wanted = spring_set_named(asked);
  if (earlier == nullptr) return wanted.value_or(SpringSet::fabric);
  const std::optional<SpringSet> known = spring_set_named(earlier->parameter_set);
  if (!known)
    throw InputError(flag, "the fit has the unknown parameter set '" + earlier->parameter_set + "'",
                     "fabric, louchet5 or louchet18");
  if (wanted && *wanted != *known)
    throw InputError("--springs",
                     asked + ", but the fit of " + flag + " has " + earlier->parameter_set,
                     "the same parameter set", "leave --springs out");
  return *known;
}

/// Returns an earlier fit's numbers of the cloth; its measurement unknowns belong to its recording.
std::map<std::string, double> known_values(FitResult earlier) {
  earlier = at_density(std::move(earlier), std::nullopt);
  std::map<std::string, double> values;
  for (const ParameterEstimate& parameter : earlier.parameters)
    if (parameter.name != "areal_density") values[parameter.name] = parameter.value;
  for (const EffectEstimate& effect : earlier.effects)
    for (const ParameterEstimate& parameter : effect.parameters)
      if (parameter.state != ParameterState::fixed)
        values[effect.name + "." + parameter.name] = parameter.value;
  return values;
}

/// Throws for a checkpoint that exists: hours of searching are not written over.
void require_new_checkpoint(const FitOptions& options) {
  if (options.checkpoint.empty() || options.resume || !fs::exists(options.checkpoint)) return;
  throw InputError("--checkpoint", options.checkpoint.string() + " exists already",
                   "the name of a new file, or --resume to go on from this one",
                   "remove it to search from scratch");
}

/// Tells how to go on from what a cancelled fit leaves.
std::string how_to_go_on(const FitOptions& options) {
  if (options.checkpoint.empty() || !fs::exists(options.checkpoint)) return "";
  return fmt::format("the search stands in {}: the same command{} goes on from there",
                     options.checkpoint.string(), options.resume ? "" : " with --resume");
}

void write_results(const FitReport& report, const Recording& recording, const fs::path& folder) {
  write_fit_result(report.result, folder / "fit.json");
  write_model(report.model, folder);
  const Table parameters = parameter_table(report.result);
  const Table errors = error_table(report.result);
  const Table residuals = residual_table(report, recording);
  write_csv_table(parameters, folder / "parameters.csv");
  write_csv_table(errors, folder / "errors.csv");
  write_csv_table(residuals, folder / "residuals.csv");

  const std::vector<BackgroundPicture> pictures = background_pictures(report, recording);
  write_text(fit_page_html(report, recording, pictures), folder / "report.html");
  const std::string overlay = overlay_svg(report, recording, pictures);
  if (!overlay.empty()) write_text(overlay, folder / "overlay.svg");
}

void print_result(const FitReport& report, const fs::path& folder) {
  const FitSummary summary = summarise(report);
  say("\n{}{}.\n", warnings_text(report.result.warnings), summary.verdict);
  if (!report.result.next_command.empty())
    say("To ask what is missing: {}\n", report.result.next_command);
  if (!summary.contradicting.empty()) say("{}\n", summary.contradicting);
  const Table parameters = short_parameter_table(report.result);
  const Table errors = short_error_table(report.result);
  say("\n{}\n", text_table(parameters));
  say("Errors (rms per coordinate):\n\n{}\n", text_table(errors));
  const Table clouds = cloud_table(report.result);
  if (!clouds.rows.empty()) say("{}\n", text_table(clouds));
  say("Report: {}\n", shown_path(folder / "report.html"));
}

/// Mass per area, where the cloth was weighed.
std::optional<double> areal_density(const Recording& recording) {
  const ClothDescription& cloth = recording.cloth;
  if (!cloth.mass_kg) return std::nullopt;
  return *cloth.mass_kg / (cloth.width_m * cloth.height_m);
}

}  // namespace

int run_fit(const FitVerbOptions& given_options) {
  FitVerbOptions options = given_options;
  const auto begin = std::chrono::steady_clock::now();
  options.fit.is_cancelled = interrupted;
  options.fit.validate();
  require_new_checkpoint(options.fit);
  const Recording given = typed_recording(options.recording, options.allow_outside);

  if (options.fit.forecast)
    options.fit.forecast = at_density(std::move(*options.fit.forecast), areal_density(given));
  std::vector<fs::path> inputs = input_paths(given);
  inputs.insert(inputs.end(), {options.fit.checkpoint, options.earlier_fit});
  ResultFolder out(out_folder(options.out, given.name + ".fit"), inputs);
  CheckedInput checked;
  FitReport report;
  {
    ProgressLine line;
    const ProgressCallback progress = watch(line);
    checked = checked_input(given, options.fit.observations, out.path() / "steps", progress);
    report = fit_and_judge(checked.input, options.fit, progress);
  }
  const Recording& recording = checked.input.recording;
  if (report.stop == FitStop::cancelled || interrupted())
    throw Cancelled(how_to_go_on(options.fit));
  if (!report.usable()) throw NoResult("no fit: " + report.message);
  if (!report.result.usable()) report.result.next_command = options.diagnose_command;
  if (report.result.verdict == FitVerdict::do_not_use && !options.keep)
    throw NoResult(
        fmt::format("do not use: {}; no result was written (--keep writes it). To ask "
                    "what is missing: {}",
                    report.result.verdict_reason, report.result.next_command));

  std::ranges::move(checked.findings, std::back_inserter(report.result.warnings));
  report.result.version = program_version();
  report.result.command = options.command;
  report.result.seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  write_results(report, recording, out.path());
  if (interrupted()) throw Cancelled(how_to_go_on(options.fit));
  out.publish();
  print_result(report, out.final_path());
  return kExitGood;
}

void add_fit_verb(Verb program) {
  const auto options = std::make_shared<FitVerbOptions>();
  const auto flags = std::make_shared<FitFlags>();
  Verb verb = program.add_verb(
      "fit", "Identify the cloth's parameters, with their uncertainty and the held-out error");
  verb.add_option("recording", &options->recording, "Folder of the recording")
      .required()
      .type_name("RECORDING");
  verb.add_option("--effect", &options->fit.effects,
                  "Effect to fit beside those the recording declares, of motion or of the "
                  "measurement; may be repeated")
      .type_name("NAME");
  add_prior_option(verb, flags->priors);
  verb.add_option("--observations", &flags->observations,
                  "What to fit to: 3D tracks where there are any, unless told otherwise")
      .one_of({"automatic", "tracks3d", "tracks2d"})
      .shows_default();
  verb.add_option("--mesh", &flags->mesh, "Columns and rows of the mesh (default: the recording's)")
      .type_name("CxR")
      .check(check_mesh);
  verb.add_option("--seed", &options->fit.seed,
                  "Seed of the search; the same one gives the same result")
      .check(check_seed)
      .shows_default();
  verb.add_option("--forecast", &flags->forecast,
                  "Take the parameters of this fit.json, fit nothing, forecast the recording from "
                  "its own first frame")
      .type_name("FIT.json");
  verb.add_option("--start", &flags->start,
                  "Begin with the parameters of this fit.json; search only if they lead nowhere")
      .type_name("FIT.json")
      .excludes(verb.option("--forecast"));
  verb.add_option("--springs", &flags->springs,
                  "Parameter set of the springs: fabric (default), or the founding paper's 5 or "
                  "18 numbers with its strain limit")
      .one_of({"fabric", "louchet5", "louchet18"});
  verb.add_option("--start-nodes", &options->fit.start_nodes,
                  "Nodes per side of the corrections of a start in motion (start: unknown); 0: 4 "
                  "where the first shape is smooth, else 8")
      .shows_default();
  verb.add_option("--loss", &flags->loss,
                  "What large residuals weigh: less than others, or as much")
      .one_of({"huber", "squared"})
      .shows_default();
  verb.add_option("--marker-offsets", &options->fit.marker_offset_sigma_m,
                  "Let every marker be seen beside its place by a constant, with this standard "
                  "deviation: 0.01 or 10mm; 0 for none")
      .is_length();
  verb.add_option("--drive-knots", &options->fit.drive_knots,
                  "Fit what the measured motion of tracked held points is off by, at so many "
                  "knots over the fitted frames; 0 takes the smoothed tracks as exact")
      .type_name("N")
      .shows_default();
  verb.add_option(
          "--cost", &flags->cost,
          "What leads to where the trajectory's cost takes over: the trajectory's own after "
          "a search, shooting, or the founding paper's over states from 3D tracks")
      .one_of({"trajectory", "shooting", "full", "small"})
      .shows_default();
  verb.add_option("--search", &flags->search,
                  "The founding paper's evolutionary strategy, or CMA-ES with restarts and as "
                  "many simulations")
      .one_of({"paper", "cma"})
      .shows_default();
  verb.add_option("--population", &options->fit.population, "Individuals of the search")
      .shows_default();
  verb.add_option("--generations", &options->fit.generations, "Generations of the search, at most")
      .shows_default();
  verb.add_option("--search-share", &options->fit.search_share,
                  "Share of the fitted frames that the search looks at")
      .shows_default();
  verb.add_option("--refine-best", &options->fit.refine_best, "Individuals that go to refinement")
      .shows_default();
  verb.add_option("--stop-cost", &options->fit.stop_cost,
                  "End the search once the mean error over its window is this low, in sigmas");
  const Option checkpoint = verb.add_option("--checkpoint", &options->fit.checkpoint,
                                            "Save the search here after each generation")
                                .shapes_no_result()
                                .type_name("FILE");
  verb.add_flag("--resume", options->fit.resume, "Go on from the checkpoint, to the same result")
      .shapes_no_result()
      .needs(checkpoint);
  verb.add_option("--work", &options->fit.work,
                  "Times as much work as refinement is allowed before it ends unconverged")
      .shows_default();
  verb.add_option("--substep-scale", &options->fit.substep_scale,
                  "Above 1: smaller time steps than stability asks for")
      .shows_default();
  verb.add_flag("--profile", options->fit.profile,
                "Intervals from the profiled cost where it is no parabola");
  verb.add_option("--bootstrap", &options->fit.bootstrap,
                  "Intervals from so many replicates of a bootstrap over blocks of the cloth, "
                  "beside the others")
      .type_name("N");
  verb.add_flag("--two-meshes", options->fit.two_meshes,
                "Fit again on a mesh of other resolution, and show the difference");
  verb.add_flag("--keep", options->keep,
                "Write the result also where the verdict is not to use it, marked as such");
  verb.add_option("--threads", &options->fit.threads, "Threads; 0 for as many as the machine has")
      .shows_default()
      .shapes_no_result();
  add_out_option(verb, options->out, "NAME.fit");
  add_outside_option(verb, options->allow_outside);
  verb.footer(
      "Examples:\n"
      "  clothfit fit data/recordings/tags_onecam\n"
      "  clothfit fit data/recordings/swing_breeze --effect wind --seed 7\n"
      "  clothfit fit data/recordings/swing_plain --search cma --checkpoint search.txt\n"
      "  clothfit fit OTHER_RECORDING --forecast swing_plain.fit/fit.json");
  verb.runs([options, flags, verb] {
    options->fit.observations = parse_observations(flags->observations);
    if (const auto mesh = parse_mesh(flags->mesh)) {
      options->fit.mesh_columns = mesh->columns;
      options->fit.mesh_rows = mesh->rows;
    }
    const bool starts = !flags->start.empty();
    const fs::path& file = starts ? flags->start : flags->forecast;
    std::optional<FitResult> earlier;
    if (!file.empty()) earlier = read_fit_result(file);
    options->earlier_fit = file;
    options->fit.spring_set = chosen_springs(flags->springs, starts ? "--start" : "--forecast",
                                             earlier ? &*earlier : nullptr);
    if (starts) options->fit.start = known_values(*earlier);
    if (!starts) options->fit.forecast = std::move(earlier);
    for (const std::string& prior : flags->priors)
      options->fit.priors.push_back(parse_prior(prior));
    options->fit.cost = *leading_cost_named(flags->cost);
    options->fit.search = flags->search == "cma" ? SearchMethod::cma : SearchMethod::paper;
    options->fit.loss = flags->loss == "squared" ? Loss::squared : Loss::huber;
    options->command = verb.command_text();
    options->diagnose_command = verb.command_text_as("diagnose");
    return run_fit(*options);
  });
}

}  // namespace clothfit
