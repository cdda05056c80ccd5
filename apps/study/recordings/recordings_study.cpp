#include "apps/study/recordings/recordings_study.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <system_error>

#include "apps/report/fit/fit_tables.h"
#include "apps/steps/steps.h"
#include "apps/study/recordings/recordings_checksum.h"
#include "apps/study/recordings/study_row_json.h"
#include "apps/terminal/exit_code.h"
#include "apps/terminal/interrupt.h"
#include "apps/terminal/option_flags.h"
#include "data/folder_entries.h"
#include "data/input_error.h"
#include "fit/jobs/executor.h"
#include "fit/jobs/journal_key.h"
#include "fit/jobs/thread_limit.h"
#include "fit/observe/marker_error.h"
#include "fit/observe/trivial_predictors.h"
#include "fit/problem/drive.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

using Tracks = std::vector<Eigen::MatrixXd>;

/// Follows links to folders, each folder once, so that a link upwards leads to no endless walk.
void add_recordings_below(const fs::path& folder, std::set<fs::path>& walked,
                          std::set<fs::path>& found) {
  std::error_code error;
  const fs::path itself = fs::canonical(folder, error);
  if (!error && !walked.insert(itself).second) return;
  if (fs::exists(folder / kRecordingFile, error)) {
    found.insert(folder);
    return;
  }
  for (const FolderEntry& entry : list_whole_folder(folder))
    if (entry.kind == FolderEntry::Kind::folder) add_recordings_below(entry.path, walked, found);
}

/// Observed and predicted places of the markers in all frames.
struct MarkerTracks {
  Tracks observed;
  Tracks predicted;
};

MarkerTracks no_tracks(size_t markers, int dimension, int frames) {
  const Eigen::MatrixXd nothing = Eigen::MatrixXd::Constant(dimension, frames, kNan);
  return {.observed = Tracks(markers, nothing), .predicted = Tracks(markers, nothing)};
}

/// Returns the markers with which a fit was compared.
MarkerTracks compared_markers(const FitReport::Residuals& residuals, size_t markers) {
  const int dimension =
      residuals.rows.empty() ? 3 : static_cast<int>(residuals.rows.front().observed.size());
  MarkerTracks tracks =
      no_tracks(markers, dimension, static_cast<int>(residuals.rms_by_frame.size()));
  for (const FitReport::Residuals::Row& row : residuals.rows) {
    tracks.observed[static_cast<size_t>(row.marker)].col(row.frame) = row.observed;
    tracks.predicted[static_cast<size_t>(row.marker)].col(row.frame) = row.predicted;
  }
  return tracks;
}

/// Returns the markers that drive held points, at their driven places.
MarkerTracks driving_markers(const FitInput& input, size_t markers, int frames) {
  MarkerTracks tracks = no_tracks(markers, 3, frames);
  Recording driven = input.recording;
  std::erase_if(driven.held,
                [](const HeldPoint& point) { return point.motion != HeldMotion::tracked; });
  if (driven.held.empty() || input.tracks3d.empty()) return tracks;
  std::vector<double> time_s;
  for (int f = 0; f < frames; ++f) time_s.push_back(driven.frame_time_s(f));
  const Mesh any{2, 2, driven.cloth.width_m, driven.cloth.height_m};
  const Drive drive = make_drive(driven, any, input.tracks3d, time_s);
  for (size_t n = 0; n < drive.driving_markers.size(); ++n) {
    Eigen::MatrixXd& track = tracks.predicted[static_cast<size_t>(drive.driving_markers[n])];
    for (int f = 0; f < frames; ++f)
      track.col(f) = drive.held[n].motion(time_s[static_cast<size_t>(f)]);
  }
  for (const Position3d& row : input.tracks3d)
    if (std::ranges::find(drive.driving_markers, row.marker) != drive.driving_markers.end())
      tracks.observed[static_cast<size_t>(row.marker)].col(row.frame) = row.position_m;
  return tracks;
}

/// Returns the error from `held_out_from` on, with the mean error before subtracted.
double centred_held_out_rms(const Tracks& observed, const Tracks& predicted, int held_out_from) {
  Tracks later, forecast = centred(observed, predicted, held_out_from);
  for (size_t m = 0; m < observed.size(); ++m) {
    const Eigen::Index count = observed[m].cols() - held_out_from;
    later.push_back(observed[m].rightCols(count));
    forecast[m] = forecast[m].rightCols(count).eval();
  }
  return rms_distance(later, forecast);
}

/// Computes errors over all frames, of the model and of a rigid motion with the driven points.
void judge_whole(const FitInput& input, const FitReport::Residuals& residuals,
                 const std::optional<MarkerWeights>& weights, StudyRow& row) {
  const size_t markers = input.recording.markers.markers.size();
  MarkerTracks tracks = compared_markers(residuals, markers);
  row.whole_rms = rms_distance(tracks.observed, tracks.predicted);
  if (tracks.observed.empty() || tracks.observed.front().rows() != 3) return;

  const auto frames = static_cast<int>(residuals.rms_by_frame.size());
  const int held_out_from = std::min(input.recording.held_out_from_frame.value_or(frames), frames);
  row.centred_held_out_rms = centred_held_out_rms(tracks.observed, tracks.predicted, held_out_from);
  const MarkerTracks driving = driving_markers(input, markers, frames);
  Tracks driven;
  for (const Eigen::MatrixXd& track : driving.predicted)
    if (track.allFinite()) driven.push_back(track);
  const Eigen::MatrixXd displacement =
      driven.empty() ? Eigen::MatrixXd::Zero(3, frames) : mean_displacement(driven);
  const Tracks rigid = predict_rigid(tracks.observed, displacement, held_out_from).predicted;
  row.whole_rigid_rms = rms_distance(tracks.observed, rigid);
  row.centred_rigid_rms = centred_held_out_rms(tracks.observed, rigid, held_out_from);
  if (!weights) return;

  Tracks shifted = centred(tracks.observed, tracks.predicted, held_out_from);
  for (size_t m = 0; m < markers; ++m) {
    if (!driving.predicted[m].allFinite()) continue;
    shifted[m] = driving.predicted[m];
    tracks.observed[m] = driving.observed[m];
    tracks.predicted[m] = driving.predicted[m];
  }
  const std::vector<double> by_marker = weights_of(input.recording.markers, *weights);
  row.centred_weighted_rms = weighted_rms_distance(tracks.observed, shifted, by_marker);
  row.weighted_rms = weighted_rms_distance(tracks.observed, tracks.predicted, by_marker);
  row.weighted_rigid_rms = weighted_rms_distance(
      tracks.observed, predict_rigid(tracks.observed, displacement, frames).predicted, by_marker);
}

/// Returns the rows of a fit that worked out, one per kind of observation.
std::vector<StudyRow> rows_of(const FitInput& input, const FitReport& report,
                              const RecordingsStudyOptions& options, StudyRow row) {
  row.fitted = true;
  row.stop = to_string(report.stop);
  row.reason = report.message;
  const auto note = [&](const std::string& prefix, const ParameterEstimate& parameter) {
    row.parameters[prefix + parameter.name] = parameter.value;
  };
  for (const ParameterEstimate& parameter : report.result.parameters) note("", parameter);
  for (const ParameterEstimate& parameter : report.result.nuisance) note("", parameter);
  for (const EffectEstimate& effect : report.result.effects)
    for (const ParameterEstimate& parameter : effect.parameters) note(effect.name + ".", parameter);

  std::vector<StudyRow> rows;
  for (size_t k = 0; k < report.result.errors.size(); ++k) {
    const ObservationErrors& errors = report.result.errors[k];
    StudyRow one = row;
    one.kind = errors.kind;
    one.unit = errors.unit;
    const double points = std::sqrt(errors.unit == "m" ? 3.0 : 2.0);  // a distance per coordinate
    const bool judged = errors.held_out.count > 0;
    one.fitted_rms = errors.fitted.rms_distance;
    one.held_out_rms = judged ? errors.held_out.rms_distance : kNan;
    one.first_frame_rms = judged ? points * errors.trivial.first_frame : kNan;
    one.last_velocity_rms = judged ? points * errors.trivial.last_velocity : kNan;
    one.rigid_rms = judged ? points * errors.trivial.rigid : kNan;
    one.noise = points * errors.noise;
    const auto published = options.published.find(row.recording);
    one.published_rms = published == options.published.end() ? kNan : published->second;
    one.whole_rigid_rms = one.weighted_rms = one.weighted_rigid_rms = kNan;
    one.centred_held_out_rms = one.centred_rigid_rms = one.centred_weighted_rms = kNan;
    judge_whole(input, report.residuals[k], options.weights, one);
    rows.push_back(std::move(one));
  }
  return rows;
}

std::vector<StudyRow> fit_one(const fs::path& folder, const StudiedModel& model,
                              const RecordingsStudyOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  StudyRow row{.recording = folder.filename().string(),
               .folder = folder.generic_string(),
               .model = model.name};
  try {
    const Recording recording = read_recording(folder);
    row.recording = recording.name;
    const FitInput input = read_fit_input(recording, options.fit.observations);
    if (options.weights) weights_of(recording.markers, *options.weights);
    FitOptions fit_options = options.fit;
    fit_options.effects = model.effects;
    if (!model.marker_offsets) fit_options.marker_offset_sigma_m = 0;
    fit_options.is_cancelled = interrupted;
    fit_options.threads = 0;  // a limit of one fit would be one of all that are at work
    const FitReport report =
        fit(input, fit_options, [](const Progress&) { return !interrupted(); });
    if (report.stop == FitStop::cancelled) throw Cancelled();
    row.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    if (report.usable()) return rows_of(input, report, options, row);
    row.stop = to_string(report.stop);
    row.reason = report.message;
  } catch (const InputError& error) {
    row.stop = "refused";
    row.reason = with_flags(error.what());
  }
  return {row};
}

}  // namespace

std::vector<fs::path> find_recordings(const std::vector<fs::path>& folders) {
  std::set<fs::path> found;
  for (const fs::path& folder : folders) {
    const size_t before = found.size();
    std::error_code error;
    if (!fs::is_directory(folder, error))
      throw InputError(folder.string(), "is not a folder", "a folder with recordings in it");
    const fs::path clean = (folder.lexically_normal() / "").parent_path();
    std::set<fs::path> walked;
    add_recordings_below(clean, walked, found);
    if (found.size() == before)
      throw InputError(folder.string(), "holds no recording that was not named before",
                       std::string("a folder with a ") + kRecordingFile + " in it or below");
  }
  return {found.begin(), found.end()};
}

void RecordingsStudyOptions::validate() const {
  fit.validate();
  require_threads(threads);
  const bool offsets = std::ranges::any_of(models, &StudiedModel::marker_offsets);
  if (offsets && fit.marker_offset_sigma_m == 0)
    throw InputError("--marker-offsets", "is 0, and a model has offsets of markers",
                     "their standard deviation, such as 10mm");
  if (!published.empty() && !weights)
    throw InputError("--published", "is given without --weights",
                     "the weights that the published errors were computed with");
}

std::string RecordingsStudyOptions::key() const {
  std::uint64_t sum = recordings_checksum(recordings);
  const auto add = [&](const std::string& text) { sum = checksum_of_text(text, sum); };
  for (const StudiedModel& model : models) {
    add(model.name);
    for (const std::string& effect : model.effects) add(effect);
    if (model.marker_offsets) add("with offsets of markers");
  }
  for (const auto& [name, error_m] : published) add(fmt::format("{} {}", name, error_m));
  if (weights)
    for (const auto& [name, weight] : *weights) add(fmt::format("{} {}", name, weight));
  JournalKey key("study recordings/2");
  key.add("seed", fit.seed);
  key.add("mesh_columns", fit.mesh_columns).add("mesh_rows", fit.mesh_rows);
  key.add("observations", static_cast<int>(fit.observations));
  key.add("search", static_cast<int>(fit.search)).add("search_share", fit.search_share);
  key.add("population", fit.population).add("generations", fit.generations);
  key.add("refine_best", fit.refine_best).add("work", fit.work);
  key.add("substep_scale", fit.substep_scale);
  key.add("marker_offset_sigma_m", fit.marker_offset_sigma_m);
  key.add("recordings_and_models", fmt::format("{:016x}", sum));
  return key.line();
}

std::vector<StudyRow> study_recordings(const RecordingsStudyOptions& options, Journal* journal,
                                       const ProgressCallback& progress) {
  options.validate();
  const auto models = static_cast<int>(options.models.size());
  const Work work = [&](int index, std::uint64_t) {
    const fs::path& folder = options.recordings[static_cast<size_t>(index / models)];
    const StudiedModel& model = options.models[static_cast<size_t>(index % models)];
    return rows_to_text(fit_one(folder, model, options));
  };
  const ExecuteResult result =
      execute(models * static_cast<int>(options.recordings.size()), work,
              {.threads = options.threads,
               .seed = options.fit.seed,
               .unit = "fits",
               .accept = [](int, const std::string& payload) { rows_from_text(payload); }},
              journal, progress);
  if (!result.usable()) throw Cancelled();
  std::vector<StudyRow> rows;
  for (const std::string& payload : result.payloads)
    for (StudyRow& row : rows_from_text(payload)) rows.push_back(std::move(row));
  return rows;
}

}  // namespace clothfit
