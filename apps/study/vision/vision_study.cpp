#include "apps/study/vision/vision_study.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <system_error>

#include "apps/study/vision/chain_rows.h"
#include "apps/study/vision/dot_rows.h"
#include "apps/study/vision/judge_texture.h"
#include "apps/study/vision/photo_sets.h"
#include "apps/study/vision/spoiled_pictures.h"
#include "apps/terminal/exit_code.h"
#include "apps/terminal/interrupt.h"
#include "data/folder_entries.h"
#include "data/input_error.h"
#include "data/recording.h"
#include "vision/track/tag_tracker.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();

/// A row that spoils recordings.
struct SpoilRow {
  VisionRow row;
  Spoil spoil;
};

const std::vector<SpoilRow>& spoil_rows() {
  static const std::vector<SpoilRow> rows = {
      {{"stills", "pictures as they are"}, as_they_are},
      {{"blur3", "3 px of blur along the motion"}, blurred_along_motion(3)},
      {{"blur6", "6 px of blur along the motion"}, blurred_along_motion(6)},
      {{"hand", "a hand over a quarter of the corners"}, behind_a_hand},
      {{"dark", "brightness x 0.15, noise of 3 levels"}, darkened(0.15, 3)},
      {{"small", "tags 11 px wide"}, shrunk_to_tags(11)},
      {{"crf18", "H.264 at crf 18"}, through_codec(18)},
      {{"crf23", "H.264 at crf 23"}, through_codec(23)},
      {{"crf30", "H.264 at crf 30"}, through_codec(30)},
  };
  return rows;
}

/// Rows of photos, each with the folder below vision/ and what judges it.
struct PhotoRow {
  VisionRow row;
  std::vector<const char*> sets;
  std::function<TagScore(const fs::path& folder)> score;
};

const std::vector<PhotoRow>& photo_rows() {
  static const std::vector<PhotoRow> rows = {
      {{"room", "tags on the walls of a room"}, {"apriltag-room"}, score_room},
      {{"sheet", "40 tags, shrunk to 29, 14 and 12 px"},
       {"apriltag-sheet-40"},
       [](const fs::path& folder) { return score_sheet(folder).score; }},
      {{"false", "pictures without a tag of the family"},
       {"aprilgrid-kalibr", "opencv-aruco", "cloth-colour-grid-nc"},
       score_false_tags},
  };
  return rows;
}

/// Rows that draw the motion of recordings with another cloth.
struct ClothRow {
  VisionRow row;
  ClothTextureOptions texture;
};

const std::vector<ClothRow>& cloth_rows() {
  static const std::vector<ClothRow> rows = {
      {{"texture", "the motion with a printed texture, rendered"}, {}},
      {{"weave", "the same with a plain weave of low contrast"},
       {.pattern = TexturePattern::weave, .finest_m = 1e-3, .contrast = 0.06}},
  };
  return rows;
}

/// Rows that track the pictures of recordings of dots.
struct DotRow {
  VisionRow row;
  PictureSpoil spoil;
};

const std::vector<DotRow>& dot_rows() {
  static const std::vector<DotRow> rows = {
      {{"dots", "dots as they are"}, untouched()},
      {{"dots_noise8", "dots under noise of 8 levels"}, with_noise(8)},
      {{"dots_blur3", "dots under 3 px of blur along the motion"}, blurred_by(3)},
  };
  return rows;
}

bool asked_for(const VisionStudyOptions& options, const std::string& row) {
  return options.rows.empty() || std::ranges::find(options.rows, row) != options.rows.end();
}

/// A camera of a recording whose truth is known.
struct JudgedCamera {
  fs::path folder;
  std::string camera;
};

/// Finds cameras with pictures and truth in recordings of one kind of markers, all of them or the
/// first of each recording.
std::vector<JudgedCamera> judged_cameras(const fs::path& data, MarkerKind kind, bool all) {
  std::vector<JudgedCamera> found;
  const fs::path folder = data / "recordings";
  std::error_code error;
  if (!fs::is_directory(folder, error)) return found;
  for (const FolderEntry& entry : list_whole_folder(folder)) {
    if (!fs::exists(entry.path / "recording.yaml", error)) continue;
    const Recording recording = read_recording(entry.path);
    if (recording.markers.kind != kind) continue;
    for (const CameraEntry& camera : recording.cameras) {
      const fs::path truth = entry.path / ("truth_tracks2d_" + camera.name + ".csv.gz");
      if (camera.images && fs::exists(truth, error))
        found.push_back({.folder = entry.path, .camera = camera.name});
      if (!all) break;
    }
  }
  std::ranges::sort(found, {},
                    [](const JudgedCamera& one) { return std::pair(one.folder, one.camera); });
  return found;
}

/// Tracks the pictures in order, as `clothfit track` does.
TagScore score_recording(const JudgedRecording& recording, const Spoil& spoil,
                         const VisionStudyOptions& options) {
  std::vector<size_t> frames;
  for (size_t frame = 0; frame < recording.pictures.size();
       frame += static_cast<size_t>(options.stride))
    frames.push_back(frame);
  const std::vector<SpoiledPicture> pictures = spoil(recording, frames, options.seed);
  std::set<int> tags = recording.other_tags;
  for (const auto& [id, corners] : recording.layout) tags.insert(id);
  TagTracker tracker(recording.family, recording.layout, tags);
  TagScore all;
  for (size_t i = 0; i < pictures.size(); ++i) {
    const SpoiledPicture& picture = pictures[i];
    const SheetTags read = tracker.next(picture.grey, static_cast<int>(i));
    all.add(score_tags(read.read, picture.truth, recording.other_tags, picture.grey.size()));
  }
  return all;
}

/// A row of one set, measured when it is asked for.
struct Measurement {
  std::string row, set;
  std::function<TagScore()> score;
};

/// Adds the rows that spoil recordings of tags. Pictures are read once for all rows of one.
void add_spoiled(const VisionStudyOptions& options, std::vector<Measurement>& all) {
  for (const JudgedCamera& one : judged_cameras(options.data, MarkerKind::apriltag, false)) {
    const auto recording = std::make_shared<std::optional<JudgedRecording>>();
    for (const SpoilRow& row : spoil_rows()) {
      if (!asked_for(options, row.row.name)) continue;
      all.push_back({row.row.name, one.folder.filename().string(), [=, &options, &row] {
                       if (!*recording) *recording = read_judged_recording(one.folder);
                       return score_recording(**recording, row.spoil, options);
                     }});
    }
  }
}

void add_photos(const VisionStudyOptions& options, std::vector<Measurement>& all) {
  for (const PhotoRow& row : photo_rows())
    for (const char* set : row.sets) {
      const fs::path folder = options.data / "vision" / set;
      if (asked_for(options, row.row.name) && fs::is_directory(folder))
        all.push_back({row.row.name, set, [=, &row] { return row.score(folder); }});
    }
}

void add_dots(const VisionStudyOptions& options, std::vector<Measurement>& all) {
  for (const DotRow& row : dot_rows())
    for (const JudgedCamera& one : judged_cameras(options.data, MarkerKind::dots, true))
      if (asked_for(options, row.row.name))
        all.push_back(
            {row.row.name, one.folder.filename().string() + ", " + one.camera, [=, &options, &row] {
               return score_dots(one.folder, one.camera, row.spoil, options.seed);
             }});
}

void add_cloths(const VisionStudyOptions& options, std::vector<Measurement>& all) {
  for (const ClothRow& row : cloth_rows())
    for (const JudgedCamera& one : judged_cameras(options.data, MarkerKind::apriltag, false)) {
      if (!asked_for(options, row.row.name)) continue;
      TexturedFootageOptions footage{.texture = row.texture};
      footage.texture.seed = options.seed;
      all.push_back({row.row.name, one.folder.filename().string(),
                     [=] { return score_texture(render_textured(one.folder, footage)); }});
    }
}

std::vector<Measurement> measurements(const VisionStudyOptions& options) {
  std::vector<Measurement> all;
  add_spoiled(options, all);
  add_photos(options, all);
  add_dots(options, all);
  add_cloths(options, all);
  return all;
}

/// Measures with a clock, and keeps why nothing could be measured.
VisionResult measured(const Measurement& one) {
  VisionResult result{.row = one.row, .set = one.set, .score = {}, .reason = {}};
  const auto begin = std::chrono::steady_clock::now();
  try {
    result.score = one.score();
  } catch (const InputError& error) {
    result.reason = error.what();
  }
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return result;
}

}  // namespace

const std::vector<VisionRow>& vision_rows() {
  static const std::vector<VisionRow> rows = [] {
    std::vector<VisionRow> all;
    for (const SpoilRow& one : spoil_rows()) all.push_back(one.row);
    for (const PhotoRow& one : photo_rows()) all.push_back(one.row);
    for (const DotRow& one : dot_rows()) all.push_back(one.row);
    for (const ClothRow& one : cloth_rows()) all.push_back(one.row);
    std::ranges::copy(chain_rows(), std::back_inserter(all));
    return all;
  }();
  return rows;
}

void VisionStudyOptions::validate() const {
  if (stride < 1) throw InputError("--stride", fmt::format("{}", stride), "1 or more");
  std::vector<std::string> known;
  for (const VisionRow& row : vision_rows()) known.push_back(row.name);
  for (const std::string& row : rows)
    if (std::ranges::find(known, row) == known.end())
      throw InputError("--rows", fmt::format("there is no row '{}'", row),
                       fmt::format("{}", fmt::join(known, ", ")));
  if (!fs::is_directory(data))
    throw InputError(data.string(), "is not a folder", "a folder with recordings/ and vision/");
}

std::vector<VisionResult> study_vision(const VisionStudyOptions& options,
                                       const ProgressCallback& progress) {
  options.validate();
  std::vector<VisionResult> results;
  for (const Measurement& one : measurements(options)) {
    const Progress now{.stage = "judge",
                       .done = static_cast<double>(results.size()),
                       .total = 0,
                       .unit = "rows",
                       .note = one.row + " of " + one.set};
    if (interrupted() || (progress && !progress(now))) throw Cancelled();
    results.push_back(measured(one));
  }
  return results;
}

}  // namespace clothfit
