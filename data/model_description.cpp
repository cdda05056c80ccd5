#include "data/model_description.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "data/model_words.h"
#include "data/recording_parts.h"
#include "data/unit_quaternion.h"
#include "data/yaml_value.h"

namespace clothfit {
namespace {

/// Beyond these a number is a slip in the unit or the exponent.
constexpr double kStiffest_n_per_m = 1e9;
constexpr double kLongestRetardation_s = 1e3;
constexpr double kLongest_s = 1e6;

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
  if (stiffest == 0) {
    value.refuse("fabric: every stiffness is 0",
                 "springs: at least one of tension, shear and flexion above 0",
                 "a woven cloth has a tension of some ten to some hundred newtons per metre");
  }
  return fabric;
}

void read_strain_limit(const YamlValue& value, ModelDescription& model) {
  const YamlMap map = value.map({"mode", "elongation"});
  model.strain_limit = map.at("mode").one_of(strain_limit_words());
  const bool needed = model.strain_limit != StrainLimitKind::off;
  if (const YamlValue* elongation = needed ? &map.at("elongation") : map.find("elongation")) {
    model.critical_elongation =
        elongation->number_between(0, 100, "an elongation as a share of the natural length");
  }
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
    if (!unit) {
      orientation->refuse(
          fmt::format("{} = [{}, {}, {}, {}] is no rotation", orientation->name(), w, x, y, z),
          "a unit quaternion [w, x, y, z]", "divide it by its norm");
    }
    sheet.orientation = *unit;
  }
  return sheet;
}

void read_model_time(const YamlValue& value, const RecordingFiles& files, ModelDescription& model) {
  const YamlMap map = value.map({"frame_rate", "duration", "file"});
  const YamlValue* file = map.find("file");
  if (file != nullptr) {
    for (const char* key : {"frame_rate", "duration"}) {
      if (const YamlValue* other = map.find(key)) {
        other->refuse(fmt::format("time has both a file and a {}", key),
                      "{frame_rate: HZ, duration: SECONDS} or {file: times.csv}");
      }
    }
    files.file(*file);
    model.frame_time_s = read_times(files.shown(*file));
    if (model.frame_time_s.size() < 2) {
      file->refuse("there is one frame only", "at least two frames");
    }
    return;
  }
  model.frame_rate_hz = read_frame_rate(map.at("frame_rate"));
  const YamlValue& duration = map.at("duration");
  const double duration_s = duration.number();
  const auto times = frame_times(*model.frame_rate_hz, duration_s);
  if (!times) {
    duration.refuse(
        fmt::format("{} = {}", duration.name(), duration_s),
        fmt::format("seconds, at least one frame interval ({:.3g} s) and at most {} of them",
                    1 / *model.frame_rate_hz, kMostModelFrames - 1));
  }
  model.frame_time_s = *times;
}

}  // namespace

std::string ModelDescription::where(int line) const {
  if (file.empty()) return name;
  return line > 0 ? fmt::format("{}:{}", file, line) : file;
}

std::optional<std::vector<double>> frame_times(double frame_rate_hz, double duration_s) {
  // A duration in decimals may miss its last frame by rounding.
  const double intervals = std::floor(duration_s * frame_rate_hz + 1e-6);
  if (!(intervals >= 1 && intervals <= kMostModelFrames - 1)) return std::nullopt;
  std::vector<double> times_s;
  for (int frame = 0; frame <= static_cast<int>(intervals); ++frame) {
    times_s.push_back(frame / frame_rate_hz);
  }
  return times_s;
}

ModelDescription read_model(const std::filesystem::path& file) {
  const RecordingFiles files(file.has_parent_path() ? file.parent_path() : ".");
  const YamlMap map =
      read_yaml(file).map({"format", "name", "cloth", "mesh", "fabric", "strain_limit", "gravity",
                           "obstacle", "held", "effects", "start", "time", "time_step"});
  map.at("format").one_of<int>({{kModelFormat, 0}});

  ModelDescription model;
  model.file = file.string();
  model.name = read_file_name(map.at("name"));
  const YamlValue& cloth = map.at("cloth");
  model.cloth = read_cloth(cloth);
  if (!model.cloth.mass_kg) {
    cloth.refuse("cloth.mass is missing", "the dry cloth's mass in kilograms",
                 "a light woven fabric weighs 0.1 kg per square metre");
  }
  model.mesh_columns = model.cloth.mesh_columns;
  model.mesh_rows = model.cloth.mesh_rows;
  if (const YamlValue* mesh = map.find("mesh")) {
    std::tie(model.mesh_columns, model.mesh_rows) = read_mesh(*mesh);
  }
  const YamlValue& fabric = map.at("fabric");
  model.fabric = read_fabric(fabric);
  model.fabric_line = fabric.line();
  if (const YamlValue* limit = map.find("strain_limit")) read_strain_limit(*limit, model);
  if (const YamlValue* gravity = map.find("gravity")) {
    model.gravity_m_per_s2 = read_gravity(*gravity);
  }
  if (const YamlValue* obstacle = map.find("obstacle")) {
    files.file(*obstacle);
    model.obstacle = read_obj(files.shown(*obstacle));
  }
  if (const YamlValue* held = map.find("held")) {
    for (HeldPoint& point : read_held(*held, files, model.cloth, model_motion_words())) {
      HeldPath path;
      if (point.file) path = read_held_path(*point.file);
      model.held.push_back({std::move(point), std::move(path)});
    }
  }
  if (const YamlValue* effects = map.find("effects")) model.effects = read_declared(*effects);
  const YamlMap start = map.at("start").map({"kind", "position", "orientation"});
  model.start = start.at("kind").one_of(model_start_words());
  model.sheet = read_sheet(start);
  read_model_time(map.at("time"), files, model);
  if (const YamlValue* step = map.find("time_step")) {
    model.time_step_s = step->number_between(1e-9, kLongest_s, "a time step in seconds");
    model.time_step_line = step->line();
  }
  return model;
}

}  // namespace clothfit
