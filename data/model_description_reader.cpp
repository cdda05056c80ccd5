#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>
#include <tuple>

#include "data/csv_reader.h"
#include "data/input_error.h"
#include "data/model_description.h"
#include "data/model_words.h"
#include "data/number_limits.h"
#include "data/ply_mesh.h"
#include "data/reading.h"
#include "data/recording_parts.h"
#include "data/unit_quaternion.h"
#include "data/yaml_value.h"

namespace clothfit {
namespace {

/// Numbers beyond these are slips in the unit or the exponent.
constexpr double kStiffest_n_per_m = 1e9;
constexpr double kLongestRetardation_s = 1e3;
constexpr double kLongest_s = 1e6;
constexpr double kMostElongation = 100;

bool is_stiffness(const FabricParameterName& parameter) {
  return std::string_view(parameter.unit) == "N/m";
}

std::map<std::string, double> read_fabric(const YamlValue& value) {
  std::vector<std::string> names;
  for (const FabricParameterName& parameter : kFabricParameters) names.emplace_back(parameter.name);
  const YamlMap map = value.map(names);
  std::map<std::string, double> fabric;
  double stiffest = 0;
  for (const FabricParameterName& parameter : kFabricParameters) {
    const bool stiffness = is_stiffness(parameter);
    const double most = stiffness ? kStiffest_n_per_m : kLongestRetardation_s;
    const double number = map.at(parameter.name)
                              .number_between(0, most,
                                              stiffness ? "a stiffness in newtons per metre"
                                                        : "a retardation time in seconds");
    fabric[parameter.name] = number;
    if (stiffness) stiffest = std::max(stiffest, number);
  }
  if (stiffest == 0)
    value.refuse("fabric: every stiffness is 0",
                 "springs: at least one of tension, shear and flexion above 0",
                 "a woven cloth has a tension of some ten to some hundred newtons per metre");
  return fabric;
}

ModelSprings read_springs(const YamlValue& value) {
  const YamlMap map = value.map({"natural_length", "stiffness", "damping", "critical_elongation"});
  const auto six = [&](const char* key, double least, double most, const char* what) {
    return map.at(key).numbers_between<6>(least, most, what);
  };
  ModelSprings springs{
      .natural_length_m = six("natural_length", 1e-9, kLargest_m, "natural lengths in metres"),
      .stiffness_n_per_m = six("stiffness", 0, kStiffest_n_per_m, "stiffness in newtons per metre"),
      .damping_ns_per_m = six("damping", 0, kStiffest_n_per_m * kLongestRetardation_s,
                              "dampings in newton seconds per metre")};
  if (map.find("critical_elongation") != nullptr)
    springs.critical_elongation =
        six("critical_elongation", 0, kMostElongation, "elongations as shares of the lengths");
  if (std::ranges::max(springs.stiffness_n_per_m) == 0)
    value.refuse("springs: every stiffness is 0", "at least one type of springs that pulls");
  return springs;
}

/// Reads the fabric, or the springs instead.
void read_cloth_springs(const YamlMap& map, ModelDescription& model) {
  const YamlValue* springs = map.find("springs");
  if (springs == nullptr) {
    const YamlValue& fabric = map.at("fabric");
    model.fabric = read_fabric(fabric);
    model.fabric_line = fabric.line();
    return;
  }
  if (const YamlValue* fabric = map.find("fabric"))
    fabric->refuse("the model has both a fabric and springs", "one of the two");
  model.springs = read_springs(*springs);
  model.fabric_line = springs->line();
}

void read_strain_limit(const YamlValue& value, ModelDescription& model) {
  const YamlMap map = value.map({"mode", "elongation"});
  model.strain_limit = map.at("mode").one_of(strain_limit_words());
  if (model.springs) {
    if (const YamlValue* elongation = map.find("elongation"))
      elongation->refuse("strain_limit.elongation stands beside springs",
                         "springs.critical_elongation, a number for each type");
    if (model.strain_limit != StrainLimitKind::off && !model.springs->critical_elongation)
      value.refuse("the strain is limited, and the springs have no limits",
                   "springs.critical_elongation, a number for each type");
    return;
  }
  const bool needed = model.strain_limit != StrainLimitKind::off;
  if (const YamlValue* elongation = needed ? &map.at("elongation") : map.find("elongation"))
    model.critical_elongation = elongation->number_between(
        0, kMostElongation, "an elongation as a share of the natural length");
}

SheetPose read_sheet(const YamlMap& start) {
  SheetPose sheet;
  if (const YamlValue* position = start.find("position")) {
    const auto [x, y, z] = position->numbers_between<3>(-1e6, 1e6, "metres along each axis");
    sheet.position_m = {x, y, z};
  }
  if (const YamlValue* orientation = start.find("orientation")) {
    const auto [w, x, y, z] = orientation->numbers<4>();
    const std::optional<Eigen::Quaterniond> unit = unit_quaternion(w, x, y, z);
    if (!unit)
      orientation->refuse(
          fmt::format("{} = [{}, {}, {}, {}] is no rotation", orientation->name(), w, x, y, z),
          "a unit quaternion [w, x, y, z]", "divide it by its norm");
    sheet.orientation = *unit;
  }
  return sheet;
}

/// Reads position and velocity of every vertex.
ModelStartState read_start_state(const std::filesystem::path& file, int columns, int rows) {
  enum Column { kRow, kColumn, kX, kY, kZ, kVx, kVy, kVz };
  CsvReader table(file, {{"row"}, {"column"}, {"x"}, {"y"}, {"z"}, {"vx"}, {"vy"}, {"vz"}});
  const std::string expected =
      fmt::format("one row for each of the mesh's {} x {} vertices", columns, rows);
  constexpr double kUnset = std::numeric_limits<double>::quiet_NaN();
  ModelStartState state;
  state.position_m.setConstant(3, columns * rows, kUnset);
  state.velocity_m_per_s = state.position_m;
  while (table.next()) {
    const int row = table.whole_number(kRow, 0), column = table.whole_number(kColumn, 0);
    if (row >= rows || column >= columns)
      table.refuse(fmt::format("there is no vertex [{}, {}]", row, column), expected,
                   "count rows and columns from 0");
    const int vertex = row * columns + column;
    if (!std::isnan(state.position_m(0, vertex)))
      table.refuse(fmt::format("vertex [{}, {}] comes twice", row, column), expected);
    state.position_m.col(vertex) = table.vector_within<3>(kX, kFarthest_m, "metres");
    state.velocity_m_per_s.col(vertex) =
        table.vector_within<3>(kVx, kFastest_m_per_s, "metres per second");
  }
  if (table.rows() != columns * rows)
    throw InputError(file.string(), fmt::format("has {} rows", table.rows()), expected);
  return state;
}

void read_start(const YamlMap& map, const RecordingFiles& files, ModelDescription& model) {
  model.start = map.at("kind").one_of(model_start_words());
  const bool in_motion = model.start == StartKind::unknown;
  for (const char* key : {"position", "orientation", "file"}) {
    const YamlValue* value = map.find(key);
    if (value != nullptr && in_motion != (std::string_view(key) == "file"))
      value->refuse(fmt::format("{} stands beside {}", value->name(),
                                word_of(model_start_words(), model.start)),
                    in_motion ? "a file, which says where each vertex is"
                              : "position and orientation of the flat sheet");
  }
  if (!in_motion) {
    model.sheet = read_sheet(map);
    return;
  }
  const YamlValue& file = map.at("file");
  files.file(file);
  const std::filesystem::path shown = files.shown(file);
  model.start_state =
      reading(shown, [&] { return read_start_state(shown, model.mesh_columns, model.mesh_rows); });
}

void read_model_time(const YamlValue& value, const RecordingFiles& files, ModelDescription& model) {
  const YamlMap map = value.map({"frame_rate", "duration", "file"});
  const YamlValue* file = map.find("file");
  if (file != nullptr) {
    for (const char* key : {"frame_rate", "duration"}) {
      if (const YamlValue* other = map.find(key))
        other->refuse(fmt::format("time has both a file and a {}", key),
                      "{frame_rate: HZ, duration: SECONDS} or {file: times.csv}");
    }
    files.file(*file);
    model.frame_time_s = read_times(files.shown(*file));
    if (model.frame_time_s.size() < 2)
      file->refuse("there is one frame only", "at least two frames");
    return;
  }
  model.frame_rate_hz = read_frame_rate(map.at("frame_rate"));
  const YamlValue& duration = map.at("duration");
  const double duration_s = duration.number();
  const auto times = frame_times(*model.frame_rate_hz, duration_s);
  if (!times)
    duration.refuse(
        fmt::format("{} = {}", duration.name(), duration_s),
        fmt::format("seconds, at least one frame interval ({:.3g} s) and at most {} of them",
                    1 / *model.frame_rate_hz, kMostModelFrames - 1));
  model.frame_time_s = *times;
}

ModelDescription parsed_model(const std::filesystem::path& file, OutsideFiles outside) {
  const RecordingFiles files(file.has_parent_path() ? file.parent_path() : ".", outside);
  const YamlMap map =
      read_yaml(file).map({"format", "name", "cloth", "mesh", "fabric", "springs", "strain_limit",
                           "gravity", "obstacle", "held", "effects", "start", "time", "time_step"});
  map.at("format").one_of<int>({{kModelFormat, 0}});

  ModelDescription model;
  model.file = file.string();
  model.name = read_file_name(map.at("name"));
  const YamlValue& cloth = map.at("cloth");
  model.cloth = read_cloth(cloth);
  if (!model.cloth.mass_kg)
    cloth.refuse("cloth.mass is missing", "the dry cloth's mass in kilograms",
                 "a light woven fabric weighs 0.1 kg per square metre");
  model.mesh_columns = model.cloth.mesh_columns;
  model.mesh_rows = model.cloth.mesh_rows;
  if (const YamlValue* mesh = map.find("mesh"))
    std::tie(model.mesh_columns, model.mesh_rows) = read_mesh(*mesh);
  read_cloth_springs(map, model);
  if (const YamlValue* limit = map.find("strain_limit")) read_strain_limit(*limit, model);
  if (const YamlValue* gravity = map.find("gravity"))
    model.gravity_m_per_s2 = read_gravity(*gravity);
  if (const YamlValue* obstacle = map.find("obstacle")) {
    files.file(*obstacle);
    model.obstacle_file = files.shown(*obstacle);
    model.obstacle = read_surface(files.shown(*obstacle));
  }
  if (const YamlValue* held = map.find("held")) {
    for (HeldPoint& point : read_held(*held, files, model.cloth, model_motion_words())) {
      HeldPath path;
      if (point.file) path = read_held_path(*point.file);
      model.held.push_back({std::move(point), std::move(path)});
    }
  }
  if (const YamlValue* effects = map.find("effects")) model.effects = read_declared(*effects);
  read_start(map.at("start").map({"kind", "position", "orientation", "file"}), files, model);
  read_model_time(map.at("time"), files, model);
  if (const YamlValue* step = map.find("time_step")) {
    model.time_step_s = step->number_between(1e-9, kLongest_s, "a time step in seconds");
    model.time_step_line = step->line();
  }
  return model;
}

}  // namespace

ModelDescription read_model(const std::filesystem::path& file, OutsideFiles outside) {
  return reading(file, [&] { return parsed_model(file, outside); });
}

}  // namespace clothfit
