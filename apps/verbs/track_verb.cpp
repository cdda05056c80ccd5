#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "apps/steps/calibrate_step.h"
#include "apps/steps/steps.h"
#include "apps/steps/track_step.h"
#include "apps/terminal/exit_code.h"
#include "apps/terminal/json_file.h"
#include "apps/terminal/number_text.h"
#include "apps/terminal/option_flags.h"
#include "apps/terminal/progress_line.h"
#include "apps/terminal/result_folder.h"
#include "apps/terminal/say.h"
#include "apps/terminal/text_table.h"
#include "apps/verbs/checked_input.h"
#include "apps/verbs/verb.h"
#include "data/finding_json.h"
#include "data/input_error.h"
#include "data/text_file.h"
#include "data/unreadable_file.h"
#include "fit/jobs/thread_limit.h"
#include "fit/preflight/preflight.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

struct TrackVerbOptions {
  fs::path recording;
  TrackOptions track;
  int threads = 0;
  fs::path out;
  bool allow_outside = false;
};

void print_counts(const char* title, const std::map<std::string, int>& counts) {
  if (counts.empty()) return;
  std::vector<std::vector<std::string>> rows;
  for (const auto& [reason, count] : counts) rows.push_back({reason, std::to_string(count)});
  say("\n{}", text_table({{title, "count"}, rows}));
}

void print_tracks(const CameraTracks& tracks, const Recording& recording) {
  const TrackResult& result = tracks.result;
  const auto good = std::count_if(result.tracks.begin(), result.tracks.end(),
                                  [](const Position2d& row) { return row.rejected.empty(); });
  const double possible =
      static_cast<double>(result.frames) * static_cast<double>(recording.markers.markers.size());
  say("\nCamera {}: {} of {:.0f} marker places in {} frames ({}%)\n{}\n", tracks.camera, good,
      possible, result.frames, significant(100 * static_cast<double>(good) / possible, 3),
      result.message);
  print_counts("rejected because", result.rejected);
  print_counts("not found because", result.missing);
  if (tracks.placement) say("\n{}\n", tracks.placement->message);
}

/// Holds the tracks against what the recording declares; nothing where a camera has no place. What
/// cannot be read beside the tracks is a finding too: they are found already, and stay.
Findings check_tracks(const TrackStepResult& step, const Recording& given) {
  for (const CameraTracks& tracks : step.cameras)
    if (!tracks.not_placed.empty()) return {};
  try {
    const FitInput input = read_fit_input(step.recording, ObservationKind::tracks2d);
    return findings_of(input, given, ObservationKind::tracks2d);
  } catch (const UnreadableFile&) {
    throw;
  } catch (const InputError& error) {
    return {finding_of(error, step.recording.folder, given.folder)};
  }
}

/// Adds what was found wrong or doubtful to a JSON file, as fit.json has it.
void add_findings(const Findings& findings, const fs::path& file) {
  auto json = nlohmann::ordered_json::parse(read_text(file));
  for (const auto& [state, key] : {std::pair(FindingState::warning, "warnings"),
                                   std::pair(FindingState::refused, "refused")}) {
    json[key] = nlohmann::ordered_json::array();
    for (const Finding& finding : with_state(findings, state))
      json[key].push_back(to_json(finding));
  }
  write_json(json, file);
}

int run_track(const TrackVerbOptions& options) {
  options.track.validate();
  require_threads(options.threads);
  const ThreadLimit limit(options.threads);
  const Recording given = typed_recording(options.recording, options.allow_outside);
  refuse_wrong(check_declarations(given));
  Recording recording = given;
  const std::vector<std::string> cameras = cameras_to_track(recording, true);
  if (cameras.empty())
    throw InputError((recording.folder / "recording.yaml").string(), "no camera has pictures",
                     "`images: FOLDER or VIDEO` in a camera's entry");

  require_footage(given, cameras);
  ResultFolder out(out_folder(options.out, recording.name + ".tracks"), input_paths(given));
  TrackStepResult step;
  {
    ProgressLine line;
    const std::vector<std::string> uncalibrated = cameras_to_calibrate(recording, false);
    if (!uncalibrated.empty()) {
      const fs::path folder = out.path() / "steps" / "calibrated";
      fs::create_directories(folder);
      recording = calibrate_step(recording, uncalibrated, {}, folder, watch(line)).recording;
    }
    step = track_step(recording, cameras, options.track, out.path(), watch(line));
  }
  Findings findings = step.footage;
  const Findings of_tracks = check_tracks(step, given);
  findings.insert(findings.end(), of_tracks.begin(), of_tracks.end());
  add_findings(findings, out.path() / "tracks.json");
  out.publish();

  for (const CameraTracks& tracks : step.cameras) {
    print_tracks(tracks, step.recording);
    if (!tracks.not_placed.empty())
      spdlog::warn("camera '{}' has no place in the world, which a fit needs: {}", tracks.camera,
                   tracks.not_placed);
  }
  for (const Finding& note : with_state(step.footage, FindingState::passed))
    say("\n{}\n", note.found);
  say("\nRecording with tracks: {}\n", shown_path(out.final_path()));
  for (const Finding& warning : with_state(findings, FindingState::warning))
    spdlog::warn("{}", with_flags(sentence(warning)));
  // The tracks are what the pictures show and stay. What is declared beside them is to be
  // corrected.
  refuse_wrong(findings);
  return kExitGood;
}

}  // namespace

void add_track_verb(Verb program) {
  const auto options = std::make_shared<TrackVerbOptions>();
  Verb verb = program.add_verb(
      "track", "Find the cloth's markers in the pictures and place the cameras in the world");
  verb.add_option("recording", &options->recording, "Folder of the recording")
      .required()
      .type_name("RECORDING");
  verb.add_option("--max-speed", &options->track.max_speed_px,
                  "A marker that moved further than this between frames is doubted (px)")
      .shows_default();
  verb.add_option("--min-margin", &options->track.min_decision_margin,
                  "Tag readings weaker than this are rejected")
      .shows_default();
  verb.add_option("--threads", &options->threads, "Threads; 0 for as many as the machine has")
      .shows_default()
      .shapes_no_result();
  add_out_option(verb, options->out, "NAME.tracks");
  add_outside_option(verb, options->allow_outside);
  verb.footer("Example:\n  clothfit track data/recordings/tags_onecam");
  verb.runs([options] { return run_track(*options); });
}

}  // namespace clothfit
