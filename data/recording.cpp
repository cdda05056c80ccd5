#include "data/recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>

#include "data/csv_table.h"
#include "data/file_name.h"
#include "data/input_error.h"
#include "data/nearest_name.h"
#include "data/recording_words.h"
#include "data/shown_text.h"
#include "data/yaml_value.h"

namespace clothfit {
namespace {

/// Sizes of a cloth or a board's square beyond these are slips in the unit or the exponent.
constexpr double kSmallest_m = 1e-4;
constexpr double kLargest_m = 1e3;

/// Whoever fits the recording has to simulate all of it.
constexpr double kLongestInterval_s = 1000;

/// Finds the files that recording.yaml names. Errors show paths as the user gave them.
class RecordingFiles {
 public:
  explicit RecordingFiles(std::filesystem::path given_folder)
      : given_folder_(std::move(given_folder)),
        folder_(std::filesystem::weakly_canonical(std::filesystem::absolute(given_folder_))) {}

  const std::filesystem::path& root() const { return folder_; }
  std::filesystem::path shown(const YamlValue& value) const { return given_folder_ / value.text(); }

  std::filesystem::path file(const YamlValue& value) const {
    require(value, std::filesystem::is_regular_file(status(value)), "a file");
    return absolute(value);
  }
  std::filesystem::path folder(const YamlValue& value) const {
    require(value, std::filesystem::is_directory(status(value)), "a folder");
    return absolute(value);
  }
  std::filesystem::path file_or_folder(const YamlValue& value) const {
    require(value, std::filesystem::exists(status(value)), "a folder of pictures or a video file");
    return absolute(value);
  }

 private:
  std::filesystem::file_status status(const YamlValue& value) const {
    std::error_code error;
    return std::filesystem::status(given_folder_ / value.text(), error);
  }
  static void require(const YamlValue& value, bool found, const std::string& expected) {
    if (found) return;
    value.refuse(fmt::format("{} = {}: there is no such {}", value.name(), shown_text(value.text()),
                             expected.substr(expected.find(' ') + 1)),
                 expected + ", named relative to the recording's folder", "check the path");
  }
  std::filesystem::path absolute(const YamlValue& value) const {
    std::filesystem::path path = (folder_ / value.text()).lexically_normal();
    if (!path.has_filename()) path = path.parent_path();  // a slash at the end
    // A link keeps its own name: `.csv.gz` and `.mp4` say what the file holds.
    return std::filesystem::weakly_canonical(path.parent_path()) / path.filename();
  }

  std::filesystem::path given_folder_;
  std::filesystem::path folder_;
};

std::string read_file_name(const YamlValue& value) {
  const std::string name = value.text();
  if (!can_name_a_file(name)) {
    value.refuse(value.name() + " cannot name a file",
                 "printable characters without a slash, the first of them no dot");
  }
  return name;
}

ClothDescription read_cloth(const YamlValue& value) {
  const YamlMap map = value.map({"size", "mass", "masses", "mesh"});
  ClothDescription cloth;
  const auto [width, height] = map.at("size").numbers_between<2>(
      kSmallest_m, kLargest_m, "a side of the flat cloth in metres");
  cloth.width_m = width;
  cloth.height_m = height;
  if (const YamlValue* mass = map.find("mass"))
    cloth.mass_kg = mass->number_between(1e-6, 1e4, "the dry cloth's mass in kilograms (or null)");
  if (const YamlValue* masses = map.find("masses")) {
    cloth.masses = masses->one_of(mass_distribution_words());
  }
  if (const YamlValue* mesh = map.find("mesh")) {
    const YamlMap sizes = mesh->map({"columns", "rows"});
    cloth.mesh_columns = sizes.at("columns").whole_number(2);
    cloth.mesh_rows = sizes.at("rows").whole_number(2);
    if (!is_possible_mesh(cloth.mesh_columns, cloth.mesh_rows)) {
      mesh->refuse(fmt::format("cloth.mesh = {} x {}", cloth.mesh_columns, cloth.mesh_rows),
                   fmt::format("{} vertices at most", kMostMeshVertices));
    }
  }
  return cloth;
}

void read_marker_set(const YamlValue& value, const RecordingFiles& files, Recording& recording) {
  const YamlMap map = value.map({"kind", "family", "file"});
  MarkerSet& set = recording.markers;
  set.kind = map.at("kind").one_of(marker_kind_words());
  const bool needs_family = set.kind == MarkerKind::apriltag;
  if (const YamlValue* family = needs_family ? &map.at("family") : map.find("family")) {
    set.family = family->text();
  }
  // A cloth without marks may still have named points, measured by other means.
  const bool needs_file = set.kind != MarkerKind::none;
  if (const YamlValue* file = needs_file ? &map.at("file") : map.find("file")) {
    recording.markers_file = files.file(*file);
    set.markers =
        read_markers(files.shown(*file), recording.cloth.width_m, recording.cloth.height_m);
  }
  for (std::size_t i = 0; i < set.markers.size(); ++i) {
    set.index.emplace(set.markers[i].name, static_cast<int>(i));
  }
}

std::vector<double> read_times(const std::filesystem::path& file) {
  enum Column { kFrame, kTime };
  const CsvTable table(file, {{"frame"}, {"time"}});
  table.require_rows("times");
  std::vector<double> times_s;
  for (int row = 0; row < table.rows(); ++row) {
    const int frame = table.whole_number(row, kFrame, 0);
    if (frame != row) {
      table.refuse(row, fmt::format("frame {} where frame {} was due", frame, row),
                   "every frame from 0 on, in order");
    }
    times_s.push_back(table.rising_number(row, kTime));
    const double interval_s = row > 0 ? times_s.back() - times_s[times_s.size() - 2] : 0;
    if (interval_s > kLongestInterval_s) {
      table.refuse(row, fmt::format("{} seconds after the frame before", interval_s),
                   fmt::format("{} seconds at most", kLongestInterval_s),
                   "correct the time (seconds), or make two recordings of it");
    }
  }
  return times_s;
}

void read_time(const YamlValue& value, const RecordingFiles& files, Recording& recording) {
  const YamlMap map = value.map({"frame_rate", "file"});
  const YamlValue* rate = map.find("frame_rate");
  const YamlValue* file = map.find("file");
  if ((rate == nullptr) == (file == nullptr)) {
    value.refuse(rate ? "time has both a frame_rate and a file" : "time is not given",
                 "{frame_rate: FRAMES_PER_SECOND} or {file: times.csv}");
  }
  if (rate != nullptr) {
    recording.frame_rate_hz = rate->number_between(1e-3, 1e6, "frames per second");
  } else {
    recording.times_file = files.file(*file);
    recording.times_s = read_times(files.shown(*file));
  }
}

CalibrationStills read_calibration(const YamlValue& value, const RecordingFiles& files) {
  const YamlMap map = value.map({"images", "board"});
  CalibrationStills stills;
  stills.images = files.folder(map.at("images"));
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
    for (const CameraEntry& earlier : cameras) {
      if (earlier.name == camera.name) {
        name.refuse("a second camera `" + camera.name + "`", "a name of its own for every camera");
      }
    }
    if (const YamlValue* file = map.find("file")) camera.file = files.file(*file);
    if (const YamlValue* images = map.find("images")) {
      camera.images = files.file_or_folder(*images);
    }
    if (const YamlValue* calibration = map.find("calibration")) {
      camera.calibration = read_calibration(*calibration, files);
    }
    cameras.push_back(std::move(camera));
  }
  return cameras;
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

/// A place (s, t) inside the cloth.
Eigen::Vector2d read_place(const YamlValue& value, const ClothDescription& cloth) {
  const auto [s, t] = value.numbers<2>();
  if (!lies_on_cloth(s, t, cloth.width_m, cloth.height_m)) {
    value.refuse(fmt::format("{} = [{}, {}] lies outside the cloth", value.name(), s, t),
                 fmt::format("0 <= s <= {}, 0 <= t <= {} (metres)", cloth.width_m, cloth.height_m));
  }
  return {s, t};
}

std::vector<RigidBody> read_bodies(const YamlValue& value, const RecordingFiles& files,
                                   const ClothDescription& cloth) {
  std::vector<RigidBody> bodies;
  for (const YamlValue& item : value.items()) {
    const YamlMap map = item.map({"name", "file", "clock_offset", "holds"});
    RigidBody body;
    body.name = map.at("name").text();
    for (const RigidBody& earlier : bodies) {
      if (earlier.name == body.name) {
        map.at("name").refuse("a second body `" + body.name + "`",
                              "a name of its own for every body");
      }
    }
    body.file = files.file(map.at("file"));
    if (const YamlValue* offset = map.find("clock_offset")) {
      if (offset->is_number()) {
        body.clock_offset_s = offset->number();
      } else if (!offset->is_word("unknown")) {
        offset->refuse(offset->name() + " is neither", "a number of seconds, or `unknown`");
      }
    }
    if (const YamlValue* holds = map.find("holds")) {
      for (const YamlValue& place : holds->items())
        body.holds_m.push_back(read_place(place, cloth));
    }
    bodies.push_back(std::move(body));
  }
  return bodies;
}

std::vector<HeldPoint> read_held(const YamlValue& value, const RecordingFiles& files,
                                 const ClothDescription& cloth) {
  std::vector<HeldPoint> held;
  for (const YamlValue& item : value.items()) {
    const YamlMap map = item.map({"at", "edge", "motion", "file"});
    const YamlValue* at = map.find("at");
    const YamlValue* edge = map.find("edge");
    if ((at == nullptr) == (edge == nullptr)) {
      item.refuse(item.name() + (at ? " has both `at` and `edge`" : " has neither `at` nor `edge`"),
                  "at: [s, t] or edge: top, bottom, left or right");
    }
    HeldPoint point;
    if (at != nullptr) point.at_m = read_place(*at, cloth);
    if (edge != nullptr) point.edge = edge->one_of(cloth_edge_words());
    for (const HeldPoint& earlier : held) {
      if (earlier.edge == point.edge && (earlier.at_m - point.at_m).norm() <= kPlaceRounding_m) {
        item.refuse(item.name() + " is held already", "every held point or edge once");
      }
    }
    const YamlValue& motion = map.at("motion");
    point.motion = motion.one_of(held_motion_words());
    if (point.edge && point.motion != HeldMotion::fixed) {
      motion.refuse(item.name() + ": an edge with motion " + motion.text(),
                    "motion: fixed for an edge", "list the edge's points one by one instead");
    }
    if (point.motion == HeldMotion::path) {
      point.file = files.file(map.at("file"));
    } else if (const YamlValue* file = map.find("file")) {
      file->refuse(item.name() + ": a file with motion " + motion.text(),
                   "a file with motion: path only");
    }
    held.push_back(std::move(point));
  }
  return held;
}

std::vector<DeclaredEffect> read_declared(const YamlValue& value) {
  std::vector<DeclaredEffect> declared;
  for (const YamlValue& item : value.items()) {
    const YamlMap map = item.map({"effect", "parameters"});
    DeclaredEffect effect;
    effect.name = map.at("effect").text();
    effect.line = map.at("effect").line();
    for (const DeclaredEffect& earlier : declared) {
      if (earlier.name == effect.name) {
        map.at("effect").refuse("effect `" + effect.name + "` is declared twice",
                                "every effect once");
      }
    }
    if (const YamlValue* parameters = map.find("parameters")) {
      for (const auto& [name, number] : parameters->entries()) {
        effect.parameters[name] =
            number.is_list() ? number.numbers() : std::vector<double>{number.number()};
      }
    }
    declared.push_back(std::move(effect));
  }
  return declared;
}

std::filesystem::path find_recording_file(const std::filesystem::path& given) {
  constexpr const char* kName = "recording.yaml";
  std::error_code error;
  if (given.filename() == kName && !std::filesystem::is_directory(given, error)) return given;
  if (!std::filesystem::exists(given, error)) {
    throw InputError(given.string(), "there is no such folder",
                     "a recording: a folder that holds recording.yaml", "check the path");
  }
  if (!std::filesystem::exists(given / kName, error)) {
    throw InputError(given.string(), "holds no recording.yaml",
                     "a recording: a folder that holds recording.yaml",
                     "write one after the example in docs/formats.md");
  }
  return given / kName;
}

}  // namespace

double Recording::frame_time_s(int frame) const {
  if (frame_rate_hz) return frame / *frame_rate_hz;
  assert(frame >= 0);
  if (frame >= static_cast<int>(times_s.size())) {
    throw InputError(times_file ? times_file->string() : name,
                     fmt::format("there is no time for frame {}", frame),
                     "a time for every frame that the tracks name",
                     fmt::format("the last one is frame {}", times_s.size() - 1));
  }
  return times_s[static_cast<std::size_t>(frame)];
}

const CameraEntry* Recording::find_camera(const std::string& camera_name) const {
  const auto found = std::find_if(cameras.begin(), cameras.end(), [&](const CameraEntry& camera) {
    return camera.name == camera_name;
  });
  return found == cameras.end() ? nullptr : &*found;
}

Recording read_recording(const std::filesystem::path& folder) {
  const std::filesystem::path file = find_recording_file(folder);
  const RecordingFiles files(file.has_parent_path() ? file.parent_path() : ".");
  const YamlMap map = read_yaml(file).map(
      {"format", "name", "origin", "cloth", "markers", "time", "gravity", "cameras", "observations",
       "reference", "bodies", "clouds", "held", "start", "declared", "held_out"});
  map.at("format").one_of<int>({{"clothfit-recording/1", 0}});

  Recording recording;
  recording.folder = files.root();
  recording.name = read_file_name(map.at("name"));
  if (const YamlValue* origin = map.find("origin")) recording.origin = origin->text();
  recording.cloth = read_cloth(map.at("cloth"));
  read_marker_set(map.at("markers"), files, recording);
  read_time(map.at("time"), files, recording);
  if (const YamlValue* gravity = map.find("gravity")) {
    const auto [x, y, z] = gravity->numbers_between<3>(-1e3, 1e3, "m/s2 along each axis");
    recording.gravity_m_per_s2 = {x, y, z};
  }
  if (const YamlValue* cameras = map.find("cameras")) {
    recording.cameras = read_cameras(*cameras, files);
  }
  if (const YamlValue* observations = map.find("observations")) {
    read_observations(*observations, files, recording);
  }
  if (const YamlValue* reference = map.find("reference")) {
    recording.reference_file = files.file(*reference);
    recording.reference = read_reference_points(files.shown(*reference));
  }
  if (const YamlValue* bodies = map.find("bodies")) {
    recording.bodies = read_bodies(*bodies, files, recording.cloth);
  }
  if (const YamlValue* clouds = map.find("clouds")) {
    const YamlMap entry = clouds->map({"camera", "files"});
    const YamlValue& camera = entry.at("camera");
    require_camera(recording, camera, camera.text());
    recording.clouds = Clouds{camera.text(), files.folder(entry.at("files"))};
  }
  if (const YamlValue* held = map.find("held")) {
    recording.held = read_held(*held, files, recording.cloth);
  }
  recording.start = map.at("start").one_of(start_words());
  if (const YamlValue* declared = map.find("declared")) {
    recording.declared = read_declared(*declared);
  }
  if (const YamlValue* held_out = map.find("held_out")) {
    recording.held_out_from_frame = held_out->map({"from_frame"}).at("from_frame").whole_number(1);
  }
  return recording;
}

HeldPath read_held_path(const std::filesystem::path& file) {
  enum Column { kTime, kX, kY, kZ };
  const CsvTable table(file, {{"time"}, {"x"}, {"y"}, {"z"}});
  table.require_rows("positions");
  HeldPath path;
  for (int row = 0; row < table.rows(); ++row) {
    path.time_s.push_back(table.rising_number(row, kTime));
    path.position_m.emplace_back(table.number(row, kX), table.number(row, kY),
                                 table.number(row, kZ));
  }
  return path;
}

}  // namespace clothfit
