#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "apps/csv_table.h"
#include "apps/exit_code.h"
#include "apps/grid_size.h"
#include "apps/interrupt.h"
#include "apps/json_file.h"
#include "apps/progress_line.h"
#include "apps/study/recordings_study.h"
#include "apps/study/recordings_tables.h"
#include "apps/study/study_row_json.h"
#include "apps/text_table.h"
#include "apps/verb.h"
#include "apps/version.h"
#include "data/input_error.h"
#include "data/output_folder.h"
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

/// Searches of a study look at all fitted frames, with CMA-ES: docs/verbs/study.md says why.
FitOptions study_defaults() {
  FitOptions options;
  options.search = SearchMethod::cma;
  options.search_share = 1;
  options.stop_cost = 0;  // what refinement is allowed here replaces no search
  options.marker_offset_sigma_m = 0.01;
  return options;
}

/// What a model has beside effects.
constexpr const char* kMarkerOffsets = "marker_offsets";

/// The base model, and one more for each --effect: NAME, or NAME+NAME for several effects at once,
/// the offsets of markers among them.
std::vector<StudiedModel> models_of(const std::vector<std::string>& effects) {
  std::vector<StudiedModel> models{{.name = "base", .effects = {}}};
  for (const std::string& text : effects) {
    StudiedModel model{.name = "base+" + text, .effects = {}};
    for (std::size_t begin = 0; begin <= text.size();) {
      const std::size_t end = std::min(text.find('+', begin), text.size());
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

/// What study.json keeps of the command line: the options that shape the result, in fixed order.
std::string command_text(const StudyFlags& flags) {
  const FitOptions& fit = flags.options.fit;
  const FitOptions defaults = study_defaults();
  std::string text = "clothfit study recordings";
  for (const fs::path& folder : flags.folders) text += " " + folder.string();
  for (const std::string& effect : flags.effects) text += " --effect " + effect;
  if (!flags.mesh.empty()) text += " --mesh " + flags.mesh;
  if (!flags.weights.empty()) text += " --weights " + flags.weights.string();
  if (!flags.published.empty()) text += " --published " + flags.published.string();
  if (flags.search != StudyFlags().search) text += " --search " + flags.search;
  const auto add = [&](const char* flag, const auto& value, const auto& default_value) {
    if (value != default_value) text += fmt::format(" {} {}", flag, value);
  };
  add("--seed", fit.seed, defaults.seed);
  add("--search-share", fit.search_share, defaults.search_share);
  add("--marker-offsets", fit.marker_offset_sigma_m, defaults.marker_offset_sigma_m);
  add("--refine-best", fit.refine_best, defaults.refine_best);
  add("--generations", fit.generations, defaults.generations);
  add("--work", fit.work, defaults.work);
  return text;
}

void write_results(const std::vector<StudyRow>& rows, const std::string& command,
                   const fs::path& folder) {
  const Table table = study_table(rows);
  write_csv_table(table.header, table.rows, folder / "study.csv");
  nlohmann::ordered_json json;
  json["format"] = "clothfit-study-recordings/1";
  json["version"] = program_version();
  json["command"] = command;
  json["rows"] = nlohmann::ordered_json::array();
  for (const StudyRow& row : rows) json["rows"].push_back(to_json(row));
  write_json(json, folder / "study.json");
  write_text(study_page_html(rows, command), folder / "report.html");
}

int run_recordings_study(const StudyFlags& flags) {
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

  OutputFolder out(out_folder(flags.out, "recordings.study"));
  const fs::path journal_file =
      flags.journal.empty() ? fs::path(out.final_path().string() + ".journal") : flags.journal;
  std::vector<StudyRow> rows;
  {
    Journal journal(journal_file, options.key(),
                    flags.resume ? JournalStart::resume : JournalStart::anew);
    ProgressLine line;
    try {
      rows = study_recordings(options, &journal, watch(line));
    } catch (const Cancelled&) {
      throw Cancelled(
          fmt::format("finished fits are kept in {}: the same command with --resume goes on",
                      shown_path(journal_file)));
    }
  }
  if (interrupted()) throw Cancelled();
  write_results(rows, command_text(flags), out.path());
  out.publish();
  if (flags.journal.empty()) fs::remove(journal_file);

  const Table table = short_study_table(rows), summary = study_summary(rows);
  fmt::print("\n{}\n", text_table(table.header, table.rows));
  fmt::print("Root mean square of the distance. Medians:\n\n{}\n",
             text_table(summary.header, summary.rows));
  if (const Table contest = study_contest(rows); !contest.rows.empty())
    fmt::print("Weighted error over all frames, recordings:\n\n{}\n",
               text_table(contest.header, contest.rows));
  fmt::print("Report: {}\n", shown_path(out.final_path() / "report.html"));
  if (std::ranges::none_of(rows, &StudyRow::fitted))
    throw NoResult("no recording could be fitted: " + rows.front().reason);
  return kExitGood;
}

}  // namespace

void add_study_verb(CLI::App& program, VerbAction& action) {
  const auto flags = std::make_shared<StudyFlags>();
  CLI::App* verb = program.add_subcommand("study", "Fit many recordings, and judge the models");
  verb->require_subcommand(1);
  CLI::App* recordings = verb->add_subcommand(
      "recordings", "Fit every recording with every model; one table beside the trivial guesses");
  FitOptions& fit = flags->options.fit;
  fit = study_defaults();
  recordings
      ->add_option("folders", flags->folders, "Recordings, or folders with recordings in them")
      ->required()
      ->type_name("FOLDER");
  recordings
      ->add_option("--effect", flags->effects,
                   "One more model beside the base: with this effect, or with several (A+B), "
                   "marker_offsets among them; may be repeated")
      ->type_name("NAME");
  recordings
      ->add_option("--mesh", flags->mesh,
                   "Columns and rows of the mesh (default: each recording's)")
      ->type_name("CxR")
      ->check(check_mesh);
  recordings
      ->add_option("--weights", flags->weights,
                   "Table of markers and weights for one more error, over all frames")
      ->type_name("FILE.csv");
  recordings
      ->add_option("--published", flags->published,
                   "Table of recordings and errors that others have stated for them, with these "
                   "weights")
      ->type_name("FILE.csv");
  recordings
      ->add_option("--marker-offsets", fit.marker_offset_sigma_m,
                   "Standard deviation of the offsets in models with marker_offsets")
      ->transform(length_in_metres())
      ->capture_default_str();
  recordings->add_option("--search", flags->search, "CMA-ES, or the founding paper's strategy")
      ->check(CLI::IsMember({"paper", "cma"}))
      ->capture_default_str();
  recordings
      ->add_option("--search-share", fit.search_share,
                   "Share of the fitted frames that the searches look at")
      ->capture_default_str();
  recordings
      ->add_option("--refine-best", fit.refine_best, "Optima of a search that go to refinement")
      ->capture_default_str();
  recordings->add_option("--seed", fit.seed, "Seed of the searches")->capture_default_str();
  recordings->add_option("--generations", fit.generations, "Generations of a search, at most")
      ->capture_default_str();
  recordings
      ->add_option("--work", fit.work,
                   "Times as much work as a refinement is allowed before it ends unconverged")
      ->capture_default_str();
  recordings
      ->add_option("--journal", flags->journal,
                   "Where finished fits are kept (default: OUT.journal)")
      ->type_name("FILE");
  recordings->add_flag("--resume", flags->resume, "Go on from the journal of an interrupted run");
  recordings
      ->add_option("--threads", flags->options.threads,
                   "Fits side by side; 0 for as many as the machine has")
      ->capture_default_str();
  add_out_option(*recordings, flags->out, "recordings.study");
  recordings->footer(
      "Example:\n"
      "  clothfit study recordings data/recordings --effect viscous_damping \\\n"
      "      --effect natural_size+viscous_damping+marker_offsets");
  recordings->callback(
      [flags, &action] { action = [flags] { return run_recordings_study(*flags); }; });
}

}  // namespace clothfit
