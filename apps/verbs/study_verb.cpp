#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "apps/report/study/recordings_tables.h"
#include "apps/study/recordings/recordings_study.h"
#include "apps/study/recordings/study_row_json.h"
#include "apps/terminal/csv_table.h"
#include "apps/terminal/exit_code.h"
#include "apps/terminal/grid_size.h"
#include "apps/terminal/json_file.h"
#include "apps/terminal/progress_line.h"
#include "apps/terminal/say.h"
#include "apps/terminal/text_table.h"
#include "apps/verbs/resumable_run.h"
#include "apps/verbs/study_foreign.h"
#include "apps/verbs/study_vision.h"
#include "apps/verbs/verb.h"
#include "data/input_error.h"
#include "data/program_version.h"
#include "data/text_file.h"
#include "fit/measurement_effects/registry.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

struct StudyFlags {
  std::vector<fs::path> folders;
  std::vector<std::string> effects;
  std::string mesh;
  fs::path weights;
  fs::path published;
  std::string search = "cma";
  fs::path out, journal;
  bool resume = false;
  RecordingsStudyOptions options;
};

/// Makes searches of a study look at all fitted frames, with CMA-ES: docs/verbs/study.md says why.
FitOptions study_defaults() {
  FitOptions options;
  options.search = SearchMethod::cma;
  options.search_share = 1;
  options.stop_cost = 0;  // the work that refinement is allowed here replaces no search
  options.marker_offset_sigma_m = 0.01;
  return options;
}

/// The name of a model's part that is no effect.
constexpr const char* kMarkerOffsets = "marker_offsets";

/// Returns the base model, and one more for each --effect. That is NAME, or NAME+NAME for several
/// effects at once, the offsets of markers among them.
std::vector<StudiedModel> models_of(const std::vector<std::string>& effects) {
  std::vector<StudiedModel> models{{.name = "base", .effects = {}}};
  for (const std::string& text : effects) {
    StudiedModel model{.name = "base+" + text, .effects = {}};
    for (size_t begin = 0; begin <= text.size();) {
      const size_t end = std::min(text.find('+', begin), text.size());
      if (const std::string name = text.substr(begin, end - begin); name == kMarkerOffsets) {
        model.marker_offsets = true;
      } else {
        require_effect(name, "--effect");
        model.effects.push_back(name);
      }
      begin = end + 1;
    }
    models.push_back(std::move(model));
  }
  return models;
}

void write_results(const std::vector<StudyRow>& rows, const std::string& command,
                   const fs::path& folder) {
  const Table table = study_table(rows);
  write_csv_table(table, folder / "study.csv");
  nlohmann::ordered_json json;
  json["format"] = "clothfit-study-recordings/1";
  json["version"] = program_version();
  json["command"] = command;
  json["rows"] = nlohmann::ordered_json::array();
  for (const StudyRow& row : rows) json["rows"].push_back(to_json(row));
  write_json(json, folder / "study.json");
  write_text(study_page_html(rows, command), folder / "report.html");
}

int run_recordings_study(const StudyFlags& flags, const std::string& command) {
  RecordingsStudyOptions options = flags.options;
  options.models = models_of(flags.effects);
  if (const auto mesh = parse_grid_size(flags.mesh)) {
    options.fit.mesh_columns = mesh->columns;
    options.fit.mesh_rows = mesh->rows;
  }
  options.fit.search = flags.search == "cma" ? SearchMethod::cma : SearchMethod::paper;
  if (!flags.weights.empty()) options.weights = read_marker_weights(flags.weights);
  if (!flags.published.empty()) options.published = read_published_errors(flags.published);
  options.recordings = find_recordings(flags.folders);

  options.validate();

  ResumableRun run(flags.out, "recordings.study", flags.journal, options.recordings);
  std::vector<StudyRow> rows;
  {
    Journal journal(run.journal(), options.key(),
                    flags.resume ? JournalStart::resume : JournalStart::fresh);
    ProgressLine line;
    try {
      rows = study_recordings(options, &journal, watch(line));
    } catch (const Cancelled&) {
      run.cancel("finished fits");
    }
  }
  write_results(rows, command, run.folder());
  run.publish();

  const Table table = short_study_table(rows), summary = study_summary(rows);
  say("\n{}\n", text_table(table));
  say("Root mean square of the distance. Medians:\n\n{}\n", text_table(summary));
  if (const Table contest = study_contest(rows); !contest.rows.empty())
    say("Weighted error over all frames, recordings:\n\n{}\n", text_table(contest));
  run.print_report_path();
  if (std::ranges::none_of(rows, &StudyRow::fitted))
    throw NoResult("no recording could be fitted: " + rows.front().reason);
  return kExitGood;
}

}  // namespace

void add_study_verb(Verb program) {
  const auto flags = std::make_shared<StudyFlags>();
  Verb verb = program.add_verb("study", "Fit or diagnose many recordings, and judge the models");
  verb.requires_verb();
  Verb recordings = verb.add_verb(
      "recordings", "Fit every recording with every model; one table beside the trivial guesses");
  FitOptions& fit = flags->options.fit;
  fit = study_defaults();
  recordings
      .add_option("folders", &flags->folders, "Recordings, or folders with recordings in them")
      .required()
      .type_name("FOLDER");
  recordings
      .add_option("--effect", &flags->effects,
                  "One more model beside the base: with this effect, or with several (A+B), "
                  "marker_offsets among them; may be repeated")
      .type_name("NAME");
  recordings
      .add_option("--mesh", &flags->mesh,
                  "Columns and rows of the mesh (default: each recording's)")
      .type_name("CxR")
      .check(check_mesh);
  recordings
      .add_option("--weights", &flags->weights,
                  "Table of markers and weights for one more error, over all frames")
      .type_name("FILE.csv");
  recordings
      .add_option("--published", &flags->published,
                  "Table of recordings and errors that others have stated for them, with these "
                  "weights")
      .type_name("FILE.csv");
  recordings
      .add_option("--marker-offsets", &fit.marker_offset_sigma_m,
                  "Standard deviation of the offsets in models with marker_offsets")
      .is_length()
      .shows_default();
  recordings.add_option("--search", &flags->search, "CMA-ES, or the founding paper's strategy")
      .one_of({"paper", "cma"})
      .shows_default();
  recordings
      .add_option("--search-share", &fit.search_share,
                  "Share of the fitted frames that the searches look at")
      .shows_default();
  recordings
      .add_option("--refine-best", &fit.refine_best, "Optima of a search that go to refinement")
      .shows_default();
  recordings.add_option("--seed", &fit.seed, "Seed of the searches").shows_default();
  recordings.add_option("--generations", &fit.generations, "Generations of a search, at most")
      .shows_default();
  recordings
      .add_option("--work", &fit.work,
                  "Times as much work as a refinement is allowed before it ends unconverged")
      .shows_default();
  add_journal_options(recordings, flags->journal, flags->resume, "fits");
  recordings
      .add_option("--threads", &flags->options.threads,
                  "Fits side by side; 0 for as many as the machine has")
      .shows_default()
      .shapes_no_result();
  add_out_option(recordings, flags->out, "recordings.study");
  recordings.footer(
      "Example:\n"
      "  clothfit study recordings data/recordings --effect viscous_damping \\\n"
      "      --effect natural_size+viscous_damping+marker_offsets");
  recordings.runs(
      [flags, recordings] { return run_recordings_study(*flags, recordings.command_text()); });
  add_foreign_study(verb);
  add_vision_study(verb);
}

}  // namespace clothfit
