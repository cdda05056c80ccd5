#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "apps/report/study/recover_page.h"
#include "apps/report/study/recover_tables.h"
#include "apps/study/trials/recover.h"
#include "apps/terminal/csv_table.h"
#include "apps/terminal/exit_code.h"
#include "apps/terminal/grid_size.h"
#include "apps/terminal/interrupt.h"
#include "apps/terminal/progress_line.h"
#include "apps/terminal/say.h"
#include "apps/terminal/text_table.h"
#include "apps/verbs/recover_undeclared.h"
#include "apps/verbs/resumable_run.h"
#include "apps/verbs/verb.h"
#include "data/text_file.h"
#include "fit/jobs/draws.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

struct RecoverFlags {
  RecoverOptions study;
  UndeclaredFlags undeclared;
  bool render = false;
  PictureOptions pictures;
  std::string picture_size = "1280x960";
  double exposure_ms = 2;
  std::string observations;  ///< empty: 3D tracks, or with pictures 2D ones
  std::string loss = "squared";
  double seconds = 1, noise_mm = 1;
  int mesh = 17;
  fs::path out, journal;
  bool resume = false;
};

std::string check_picture_size(const std::string& text) {
  if (parse_grid_size(text)) return "";
  return fmt::format("'{}' is no size of pictures, such as 1280x960", text);
}

RecoverOptions options_of(const RecoverFlags& flags) {
  RecoverOptions options = flags.study;
  // Beyond any range that the scene allows the product is cut: integers would overflow.
  const double frames = std::min(std::round(flags.seconds * options.scene.frame_rate_hz), 1e9);
  options.scene.frames = frames >= 0 ? 1 + static_cast<int>(frames) : 0;
  options.scene.noise_m = 1e-3 * flags.noise_mm;
  options.fit.mesh_columns = options.fit.mesh_rows = flags.mesh;
  const bool of_pixels =
      flags.observations.empty() ? flags.render : flags.observations == "tracks2d";
  options.fit.observations = of_pixels ? ObservationKind::tracks2d : ObservationKind::tracks3d;
  options.fit.loss = flags.loss == "huber" ? Loss::huber : Loss::squared;
  if (flags.render) {
    const GridSize size = parse_grid_size(flags.picture_size).value();  // checked when it was read
    options.pictures = flags.pictures;
    options.pictures->width_px = size.columns;
    options.pictures->height_px = size.rows;
    options.pictures->exposure_s = 1e-3 * flags.exposure_ms;
  }
  return options;
}

/// Sets up the study: undeclared effects have cloths of their own size, unless told another one.
UndeclaredRun undeclared_run(RecoverFlags flags, const Verb& verb, const std::string& command) {
  const auto is_given = [&](const char* option) { return verb.is_given(option); };
  if (!is_given("--mesh")) flags.mesh = 9;
  if (!is_given("--markers")) flags.study.scene.markers = 9;
  if (!is_given("--noise-mm")) flags.noise_mm = 0.5;
  if (!is_given("--loss")) flags.loss = "huber";
  const bool of_pixels = flags.observations == "tracks2d";
  if (!is_given("--before") && of_pixels) flags.study.scene.before_s = 0.25;
  const RecoverOptions options = options_of(flags);
  return {.scene = options.scene,
          .fit = options.fit,
          .trials = options.trials,
          .seed = options.seed,
          .threads = options.threads,
          .command = command,
          .out = flags.out,
          .journal = flags.journal,
          .resume = flags.resume};
}

int run_recover(const RecoverFlags& flags, const std::string& command) {
  RecoverOptions options = options_of(flags);
  options.fit.is_cancelled = options.scene.is_cancelled = terminated;
  options.validate();
  ResumableRun run(flags.out, "recover", flags.journal);
  Journal journal(run.journal(), options.key(),
                  flags.resume ? JournalStart::resume : JournalStart::fresh);
  RecoverResult result;
  {
    ProgressLine line;
    result = recover(options, &journal, watch(line));
  }
  if (result.stop == ExecuteStop::cancelled)
    run.cancel(fmt::format("{} of {} trials", journal.finished().size(), options.trials));
  const Table parameters = recovery_table(result);
  const Table counts = recovery_counts(result);
  const Table trials = recovery_trials_table(result);
  write_csv_table(parameters, run.folder() / "parameters.csv");
  write_csv_table(trials, run.folder() / "trials.csv");
  std::string picture_png;
  if (options.pictures) {
    const Table tracker = tracker_trials_table(result);
    write_csv_table(tracker, run.folder() / "tracker.csv");
    picture_png = rendered_picture_png(options.scene, *options.pictures,
                                       derived_seed(options.seed, 0), 0, options.scene.frames / 2);
    write_text(picture_png, run.folder() / "picture.png");
  }
  write_text(recover_page_html(options, result, command, picture_png),
             run.folder() / "report.html");
  run.publish();
  say("{}\n{}\n", text_table(counts), text_table(parameters));
  if (result.tracker) {
    const Table tracker = tracker_table(*result.tracker);
    const Table rejections = tracker_rejections(*result.tracker);
    say("{}\n", text_table(tracker));
    if (!rejections.rows.empty()) say("{}\n", text_table(rejections));
  }
  run.print_report_path();
  return kExitGood;
}

}  // namespace

void add_recover_verb(Verb program) {
  const auto flags = std::make_shared<RecoverFlags>();
  Verb verb = program.add_verb(
      "recover", "Simulate cloth whose numbers are known, fit it, hold the fits against the truth");
  SyntheticScene& scene = flags->study.scene;
  const auto add = [&](const char* name, auto& value, const char* what) {
    return verb.add_option(name, &value, what).shows_default();
  };
  add("--trials", flags->study.trials, "Recordings, each released another way");
  verb.add_option("--observations", &flags->observations,
                  "What to fit to (default: tracks3d; tracks2d with --render)")
      .one_of({"tracks3d", "tracks2d"});
  const Option render = verb.add_flag("--render", flags->render,
                                      "Find the markers in rendered pictures of a printed cloth");
  const Option noise_mm =
      add("--noise-mm", flags->noise_mm, "Noise of 3D tracks, standard deviation per coordinate");
  const Option noise_px = add("--noise-px", scene.noise_px, "Noise of pixels");
  add("--cameras", scene.cameras, "Cameras, 1 to 4");
  add("--rate", scene.frame_rate_hz, "Frames per second");
  add("--seconds", flags->seconds, "Length of a recording");
  add("--before", scene.before_s,
      "Seconds that the cloth has been swinging when the recording begins: its start is then "
      "unknown to the fit");
  const Option markers = add("--markers", scene.markers, "Markers a side");
  for (Option option : {noise_mm, noise_px, markers}) option.excludes(render);
  const auto add_of_pictures = [&](const char* name, auto& value, const char* what) {
    return add(name, value, what).needs(render);
  };
  add_of_pictures("--tags", flags->pictures.tags, "Tags a side");
  add_of_pictures("--picture", flags->picture_size, "Size of pictures")
      .type_name("WIDTHxHEIGHT")
      .check(check_picture_size);
  add_of_pictures("--exposure-ms", flags->exposure_ms, "Exposure, milliseconds");
  add_of_pictures("--instants", flags->pictures.instants,
                  "Instants that an exposure is averaged over, odd");
  add_of_pictures("--samples", flags->pictures.samples, "Lines of sight across a pixel");
  add_of_pictures("--blur-px", flags->pictures.blur_px, "Blur of the lens, standard deviation");
  add_of_pictures("--grey-noise", flags->pictures.noise_levels,
                  "Noise of the sensor, standard deviation of grey levels");
  add_of_pictures("--shot-noise", flags->pictures.shot_levels,
                  "Variance of shot noise per grey level");
  add("--mesh", flags->mesh, "Vertices a side of the fit");
  add("--truth-mesh", scene.truth_mesh, "Vertices a side of the truth");
  add("--truth-steps", scene.truth_steps, "As many times more time steps in the truth");
  add("--drag", scene.drag_per_s,
      "Viscous damping of the truth that the recordings do not declare");
  add("--missing", scene.missing, "Share of the observations that are lost");
  verb.add_flag("--hand", scene.hand,
                "A hand hides a quarter of the cloth for a third of the time");
  add("--outliers", scene.outliers, "Share of the observations that are far off");
  add("--start-factor", flags->study.start_factor,
      "Fits begin off by this factor, without a search; 0: from scratch");
  add("--loss", flags->loss, "What large residuals weigh").one_of({"squared", "huber"});
  verb.add_option("--effect", &flags->study.fit.effects, "Effect to fit; may be repeated")
      .type_name("NAME");
  add("--start-nodes", flags->study.fit.start_nodes,
      "Nodes a side of the corrections of a start that is unknown");
  add("--seed", flags->study.seed, "Seed of releases, noise and searches");
  add("--threads", flags->study.threads, "Threads; 0 for as many as the machine has")
      .shapes_no_result();
  add_journal_options(verb, flags->journal, flags->resume, "trials");
  add_undeclared_options(verb, flags->undeclared);
  for (const char* other : {"--render", "--start-factor", "--effect"})
    verb.option("--undeclared").excludes(verb.option(other));
  add_out_option(verb, flags->out, "recover");
  verb.footer(
      "Examples:\n"
      "  clothfit recover --trials 100 --start-factor 5\n"
      "  clothfit recover --observations tracks2d --before 0.25 --trials 20\n"
      "  clothfit recover --drag 0.5 --trials 50\n"
      "  clothfit recover --render --rate 30 --trials 4\n"
      "  clothfit recover --undeclared --trials 20\n"
      "  clothfit recover --undeclared --clean --observations tracks2d --trials 100");
  verb.runs([flags, verb] {
    const std::string command = verb.command_text();
    if (flags->undeclared.undeclared)
      return run_undeclared(flags->undeclared, undeclared_run(*flags, verb, command));
    return run_recover(*flags, command);
  });
}

}  // namespace clothfit
