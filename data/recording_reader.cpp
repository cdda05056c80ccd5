#include <fmt/format.h>

#include <algorithm>

#include "data/csv_reader.h"
#include "data/file_name.h"
#include "data/input_error.h"
#include "data/nearest_name.h"
#include "data/number_limits.h"
#include "data/ply_mesh.h"
#include "data/reading.h"
#include "data/recording.h"
#include "data/recording_parts.h"
#include "data/recording_words.h"
#include "data/shown_text.h"
#include "data/yaml_value.h"

namespace clothfit {
namespace {

void read_marker_set(const YamlValue& value, const RecordingFiles& files, Recording& recording) {
  const YamlMap map = value.map({"kind", "family", "file"});
  MarkerSet& set = recording.markers;
  set.kind = map.at("kind").one_of(marker_kind_words());
  const bool needs_family = set.kind == MarkerKind::apriltag;
  if (const YamlValue* family = needs_family ? &map.at("family") : map.find("family"))
    set.family = family->text();
  // A cloth without marks may still have named points, measured by other means.
  const bool needs_file = set.kind != MarkerKind::none;
  if (const YamlValue* file = needs_file ? &map.at("file") : map.find("file")) {
    recording.markers_file = files.file(*file);
    set.markers =
        read_markers(files.shown(*file), recording.cloth.width_m, recording.cloth.height_m);
  }
  for (size_t i = 0; i < set.markers.size(); ++i)
    set.index.emplace(set.markers[i].name, static_cast<int>(i));
}

constexpr const char* kTimeWords = "{frame_rate: FRAMES_PER_SECOND} or {file: times.csv}";

void read_time(const YamlValue& value, const RecordingFiles& files, Recording& recording) {
  const YamlMap map = value.map({"frame_rate", "file"});
  const YamlValue* rate = map.find("frame_rate");
  const YamlValue* file = map.find("file");
  if ((rate == nullptr) == (file == nullptr))
    value.refuse(rate ? "time has both a frame_rate and a file" : "time is not given", kTimeWords);
  if (rate != nullptr) {
    recording.frame_rate_hz = read_frame_rate(*rate);
  } else {
    recording.times_file = files.file(*file);
    recording.times_s = read_times(files.shown(*file));
  }
}

CalibrationStills read_calibration(const YamlValue& value, const RecordingFiles& files) {
  const YamlMap map = value.map({"images", "board"});
  CalibrationStills stills;
  stills.images = files.file_or_folder(map.at("images"));
  const YamlMap board = map.at("board").map({"kind", "columns", "rows", "square"});
  board.at("kind").one_of<int>({{"chessboard", 0}});
  stills.board.columns = board.at("columns").whole_number(kFewestBoardCorners, kMostBoardCorners);
  stills.board.rows = board.at("rows").whole_number(kFewestBoardCorners, kMostBoardCorners);
  stills.board.square_m =
      board.at("square").number_between(kSmallest_m, kLargest_m, "a square's side in metres");
  return stills;
}

std::vector<CameraEntry> read_cameras(const YamlValue& value, const RecordingFiles& files) {
  std::vector<CameraEntry> cameras;
  for (const YamlValue& item : value.items()) {
    const YamlMap map = item.map({"name", "file", "images", "calibration"});
    CameraEntry camera;
    const YamlValue& name = map.at("name");
    camera.name = read_file_name(name);
    for (const CameraEntry& earlier : cameras)
      if (earlier.name == camera.name)
        name.refuse("a second camera `" + camera.name + "`", "a name of its own for every camera");
    if (const YamlValue* file = map.find("file")) camera.file = files.file(*file);
    if (const YamlValue* images = map.find("images")) camera.images = files.file_or_folder(*images);
    if (const YamlValue* calibration = map.find("calibration"))
      camera.calibration = read_calibration(*calibration, files);
    cameras.push_back(std::move(camera));
  }
  return cameras;
}

/// Refuses a recording whose frames nothing gives a time: videos alone state them. One without
/// pictures and tracks, such as that of a printed sheet, has no frames.
void require_time(const Recording& recording, const std::filesystem::path& file) {
  const auto has_video = [](const CameraEntry& camera) {
    std::error_code error;
    return camera.images && std::filesystem::is_regular_file(*camera.images, error);
  };
  const bool has_frames =
      !recording.cameras.empty() || recording.tracks3d || !recording.tracks2d.empty();
  if (!has_frames || recording.frame_rate_hz || recording.times_file ||
      std::ranges::any_of(recording.cameras, has_video))
    return;
  throw InputError(file.string(), "no `time` is given, and no video states it", kTimeWords,
                   "give the rate at which the frames were taken");
}

void require_camera(const Recording& recording, const YamlValue& where, const std::string& name) {
  if (recording.find_camera(name) != nullptr) return;
  std::vector<std::string> known;
  for (const CameraEntry& camera : recording.cameras) known.push_back(camera.name);
  where.refuse(
      "there is no camera `" + shown_text(name) + "`",
      known.empty() ? "a camera listed under `cameras`, which is empty" : known_names(name, known));
}

void read_observations(const YamlValue& value, const RecordingFiles& files, Recording& recording) {
  const YamlMap map = value.map({"tracks3d", "tracks2d"});
  if (const YamlValue* tracks3d = map.find("tracks3d")) recording.tracks3d = files.file(*tracks3d);
  if (const YamlValue* tracks2d = map.find("tracks2d")) {
    for (const auto& [camera, file] : tracks2d->entries()) {
      require_camera(recording, file, camera);
      recording.tracks2d.emplace(camera, files.file(file));
    }
  }
}

std::vector<RigidBody> read_bodies(const YamlValue& value, const RecordingFiles& files,
                                   const ClothDescription& cloth) {
  std::vector<RigidBody> bodies;
  for (const YamlValue& item : value.items()) {
    const YamlMap map = item.map({"name", "file", "clock_offset", "holds"});
    RigidBody body;
    body.name = map.at("name").text();
    for (const RigidBody& earlier : bodies) {
      if (earlier.name == body.name)
        map.at("name").refuse("a second body `" + body.name + "`",
                              "a name of its own for every body");
    }
    body.file = files.file_anywhere(map.at("file"));
    if (const YamlValue* offset = map.find("clock_offset")) {
      if (offset->is_number())
        body.clock_offset_s =
            offset->number_between(-kLatest_s, kLatest_s, "a clock offset in seconds");
      else if (!offset->is_word("unknown"))
        offset->refuse(offset->name() + " is neither", "a number of seconds, or `unknown`");
    }
    if (const YamlValue* holds = map.find("holds"))
      for (const YamlValue& place : holds->items())
        body.holds_m.push_back(read_place(place, cloth));
    bodies.push_back(std::move(body));
  }
  return bodies;
}

std::filesystem::path find_recording_file(const std::filesystem::path& given) {
  constexpr const char* kName = "recording.yaml";
  std::error_code error;
  if (given.filename() == kName && !std::filesystem::is_directory(given, error)) return given;
  if (!std::filesystem::exists(given, error))
    throw InputError(given.string(), "there is no such folder",
                     "a recording: a folder that holds recording.yaml", "check the path");
  if (!std::filesystem::exists(given / kName, error))
    throw InputError(given.string(), "holds no recording.yaml",
                     "a recording: a folder that holds recording.yaml",
                     "write one after the example in docs/formats.md");
  return given / kName;
}

Recording parsed_recording(const std::filesystem::path& folder, OutsideFiles outside) {
  const std::filesystem::path file = find_recording_file(folder);
  const RecordingFiles files(file.has_parent_path() ? file.parent_path() : ".", outside);
  const YamlMap map = read_yaml(file).map(
      {"format", "name", "origin", "cloth", "markers", "time", "gravity", "cameras", "observations",
       "reference", "bodies", "clouds", "obstacle", "held", "start", "declared", "held_out"});
  map.at("format").one_of<int>({{"clothfit-recording/1", 0}});

  Recording recording;
  recording.folder = files.root();
  recording.name = read_file_name(map.at("name"));
  if (const YamlValue* origin = map.find("origin")) recording.origin = origin->text();
  recording.cloth = read_cloth(map.at("cloth"));
  read_marker_set(map.at("markers"), files, recording);
  if (const YamlValue* time = map.find("time")) read_time(*time, files, recording);
  if (const YamlValue* gravity = map.find("gravity"))
    recording.gravity_m_per_s2 = read_gravity(*gravity);
  if (const YamlValue* cameras = map.find("cameras"))
    recording.cameras = read_cameras(*cameras, files);
  require_time(recording, file);
  if (const YamlValue* observations = map.find("observations"))
    read_observations(*observations, files, recording);
  if (const YamlValue* reference = map.find("reference")) {
    recording.reference_file = files.file(*reference);
    recording.reference = read_reference_points(files.shown(*reference));
  }
  if (const YamlValue* bodies = map.find("bodies"))
    recording.bodies = read_bodies(*bodies, files, recording.cloth);
  if (const YamlValue* clouds = map.find("clouds")) {
    const YamlMap entry = clouds->map({"camera", "files"});
    const YamlValue& camera = entry.at("camera");
    require_camera(recording, camera, camera.text());
    recording.clouds = Clouds{camera.text(), files.folder(entry.at("files"))};
  }
  if (const YamlValue* obstacle = map.find("obstacle")) {
    recording.obstacle_file = files.file(*obstacle);
    recording.obstacle = read_surface(files.shown(*obstacle));
  }
  if (const YamlValue* held = map.find("held"))
    recording.held = read_held(*held, files, recording.cloth, held_motion_words());
  recording.start = map.at("start").one_of(start_words());
  if (const YamlValue* declared = map.find("declared"))
    recording.declared = read_declared(*declared);
  if (const YamlValue* held_out = map.find("held_out"))
    recording.held_out_from_frame = held_out->map({"from_frame"}).at("from_frame").whole_number(1);
  return recording;
}

}  // namespace

Recording read_recording(const std::filesystem::path& folder, OutsideFiles outside) {
  return reading(folder, [&] { return parsed_recording(folder, outside); });
}

namespace {

HeldPath parsed_held_path(const std::filesystem::path& file) {
  enum Column { kTime, kX, kY, kZ };
  CsvReader table(file, {{"time"}, {"x"}, {"y"}, {"z"}});
  HeldPath path;
  while (table.next()) {
    path.time_s.push_back(table.rising_time(kTime));
    path.position_m.push_back(table.vector_within<3>(kX, kFarthest_m, "metres"));
  }
  table.require_rows("positions");
  return path;
}

}  // namespace

HeldPath read_held_path(const std::filesystem::path& file) {
  return reading(file, [&] { return parsed_held_path(file); });
}

}  // namespace clothfit
