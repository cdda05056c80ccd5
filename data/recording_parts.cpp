#include "data/recording_parts.h"

#include <fmt/format.h>

#include <array>
#include <tuple>

#include "data/csv_reader.h"
#include "data/file_name.h"
#include "data/number_text.h"
#include "data/reading.h"
#include "data/recording_words.h"
#include "data/shown_text.h"
#include "data/text_file.h"

namespace clothfit {
namespace {

/// Bounds an interval, because a fit has to simulate all of it.
constexpr double kLongestInterval_s = 1000;

/// Each held point is a path of its own; as many as this no person types.
constexpr size_t kMostHeldEntries = 1024;

void require(const YamlValue& value, bool found, const std::string& expected) {
  if (found) return;
  value.refuse(fmt::format("{} = {}: there is no such {}", value.name(), shown_text(value.text()),
                           expected.substr(expected.find(' ') + 1)),
               expected + ", named relative to the folder of the file that names it",
               "check the path");
}

}  // namespace

RecordingFiles::RecordingFiles(std::filesystem::path given_folder, OutsideFiles outside)
    : given_folder_(std::move(given_folder)),
      folder_(std::filesystem::weakly_canonical(std::filesystem::absolute(given_folder_))),
      outside_(outside) {}

std::filesystem::path RecordingFiles::file(const YamlValue& value) const {
  const std::filesystem::path file = file_anywhere(value);
  std::error_code error;
  // A link inside may lead outside.
  const std::filesystem::path target = std::filesystem::canonical(file, error);
  const std::filesystem::path inside = target.lexically_relative(folder_);
  if (outside_ == OutsideFiles::refused && (inside.empty() || *inside.begin() == ".."))
    value.refuse(fmt::format("{} = {} lies outside the folder", value.name(),
                             without_controls(value.text())),
                 "a file inside the folder of the file that names it",
                 "copy it there, or allow it by OutsideFiles::allowed");
  return file;
}

std::filesystem::path RecordingFiles::file_anywhere(const YamlValue& value) const {
  require(value, std::filesystem::is_regular_file(status(value)), "a file");
  return absolute(value);
}
std::filesystem::path RecordingFiles::folder(const YamlValue& value) const {
  require(value, std::filesystem::is_directory(status(value)), "a folder");
  return absolute(value);
}
std::filesystem::path RecordingFiles::file_or_folder(const YamlValue& value) const {
  require(value, std::filesystem::exists(status(value)), "a folder of pictures or a video file");
  return absolute(value);
}

std::filesystem::file_status RecordingFiles::status(const YamlValue& value) const {
  std::error_code error;
  return std::filesystem::status(given_folder_ / value.text(), error);
}
std::filesystem::path RecordingFiles::absolute(const YamlValue& value) const {
  std::filesystem::path path = (folder_ / value.text()).lexically_normal();
  if (!path.has_filename()) path = path.parent_path();  // a slash at the end
  // A link keeps its own name: `.csv.gz` and `.mp4` say what the file holds.
  return std::filesystem::weakly_canonical(path.parent_path()) / path.filename();
}

RelativePaths::RelativePaths(const std::filesystem::path& folder)
    : folder_(std::filesystem::weakly_canonical(std::filesystem::absolute(folder))) {}
std::string RelativePaths::operator()(const std::filesystem::path& path) const {
  const std::filesystem::path whole = std::filesystem::absolute(path).lexically_normal();
  const std::filesystem::path parent = std::filesystem::weakly_canonical(whole.parent_path());
  return (parent / whole.filename()).lexically_relative(folder_).generic_string();
}

std::string read_file_name(const YamlValue& value) {
  const std::string name = value.text();
  if (!can_name_a_file(name))
    value.refuse(value.name() + " cannot name a file",
                 "printable characters without a slash, the first of them no dot");
  return name;
}

std::pair<int, int> read_mesh(const YamlValue& value) {
  const YamlMap sizes = value.map({"columns", "rows"});
  const int columns = sizes.at("columns").whole_number(2);
  const int rows = sizes.at("rows").whole_number(2);
  if (!is_possible_mesh(columns, rows))
    value.refuse(fmt::format("{} = {} x {}", value.name(), columns, rows),
                 fmt::format("{} vertices at most", kMostMeshVertices));
  return {columns, rows};
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
  if (const YamlValue* masses = map.find("masses"))
    cloth.masses = masses->one_of(mass_distribution_words());
  if (const YamlValue* mesh = map.find("mesh"))
    std::tie(cloth.mesh_columns, cloth.mesh_rows) = read_mesh(*mesh);
  return cloth;
}

Eigen::Vector3d read_gravity(const YamlValue& value) {
  const auto [x, y, z] = value.numbers_between<3>(-1e3, 1e3, "m/s2 along each axis");
  return {x, y, z};
}

double read_frame_rate(const YamlValue& value) {
  return value.number_between(1e-3, 1e6, "frames per second");
}

namespace {

std::vector<double> parsed_times(const std::filesystem::path& file) {
  enum Column { kFrame, kTime };
  CsvReader table(file, {{"frame"}, {"time"}});
  std::vector<double> times_s;
  while (table.next()) {
    const int frame = table.whole_number(kFrame, 0);
    const int due = table.rows() - 1;
    if (frame != due)
      table.refuse(fmt::format("frame {} where frame {} was due", frame, due),
                   "every frame from 0 on, in order");
    times_s.push_back(table.rising_time(kTime));
    const double interval_s = due > 0 ? times_s.back() - times_s[times_s.size() - 2] : 0;
    if (interval_s > kLongestInterval_s)
      table.refuse(fmt::format("{} seconds after the frame before", interval_s),
                   fmt::format("{} seconds at most", kLongestInterval_s),
                   "correct the time (seconds), or make two recordings of it");
  }
  table.require_rows("times");
  return times_s;
}

}  // namespace

std::vector<double> read_times(const std::filesystem::path& file) {
  return reading(file, [&] { return parsed_times(file); });
}

void write_times(const std::vector<double>& times_s, const std::filesystem::path& file) {
  std::string text = "frame,time\n";
  for (size_t frame = 0; frame < times_s.size(); ++frame)
    text += fmt::format("{},{}\n", frame, number_text(times_s[frame]));
  write_text(text, file);
}

Eigen::Vector2d read_place(const YamlValue& value, const ClothDescription& cloth) {
  const auto [s, t] = value.numbers<2>();
  if (!lies_on_cloth(s, t, cloth.width_m, cloth.height_m))
    value.refuse(fmt::format("{} = [{}, {}] lies outside the cloth", value.name(), s, t),
                 fmt::format("0 <= s <= {}, 0 <= t <= {} (metres)", cloth.width_m, cloth.height_m));
  return {s, t};
}

std::vector<HeldPoint> read_held(const YamlValue& value, const RecordingFiles& files,
                                 const ClothDescription& cloth, const Words<HeldMotion>& motions) {
  std::vector<HeldPoint> held;
  const std::vector<YamlValue> items = value.items();
  if (items.size() > kMostHeldEntries)
    value.refuse(fmt::format("{} has {} entries", value.name(), items.size()),
                 fmt::format("at most {}", kMostHeldEntries),
                 "name an edge where all of its points are held");
  for (const YamlValue& item : items) {
    const YamlMap map = item.map({"at", "edge", "motion", "file"});
    const YamlValue* at = map.find("at");
    const YamlValue* edge = map.find("edge");
    if ((at == nullptr) == (edge == nullptr))
      item.refuse(item.name() + (at ? " has both `at` and `edge`" : " has neither `at` nor `edge`"),
                  "at: [s, t] or edge: top, bottom, left or right");
    HeldPoint point;
    if (at != nullptr) point.at_m = read_place(*at, cloth);
    if (edge != nullptr) point.edge = edge->one_of(cloth_edge_words());
    for (const HeldPoint& earlier : held)
      if (earlier.edge == point.edge && (earlier.at_m - point.at_m).norm() <= kPlaceRounding_m)
        item.refuse(item.name() + " is held already", "every held point or edge once");
    const YamlValue& motion = map.at("motion");
    point.motion = motion.one_of(motions);
    if (point.edge && point.motion != HeldMotion::fixed)
      motion.refuse(item.name() + ": an edge with motion " + motion.text(),
                    "motion: fixed for an edge", "list the edge's points one by one instead");
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
      if (earlier.name == effect.name)
        map.at("effect").refuse("effect `" + effect.name + "` is declared twice",
                                "every effect once");
    }
    if (const YamlValue* parameters = map.find("parameters")) {
      for (const auto& [name, number] : parameters->entries())
        effect.parameters[name] =
            number.is_list() ? number.numbers() : std::vector<double>{number.number()};
    }
    declared.push_back(std::move(effect));
  }
  return declared;
}

void write_mesh(YamlWriter& out, int columns, int rows) {
  out.key("mesh").begin_flow_map();
  out.key("columns").value(columns).key("rows").value(rows).end_map();
}

void write_cloth(YamlWriter& out, const ClothDescription& cloth) {
  out.key("cloth").begin_map();
  out.key("size").value(std::array{cloth.width_m, cloth.height_m});
  out.key("mass");
  if (cloth.mass_kg)
    out.value(*cloth.mass_kg);
  else
    out.null();
  out.key("masses").value(word_of(mass_distribution_words(), cloth.masses));
  write_mesh(out, cloth.mesh_columns, cloth.mesh_rows);
  out.end_map();
}

void write_held_point(YamlWriter& out, const HeldPoint& point, const RelativePaths& relative) {
  out.begin_flow_map();
  if (point.edge)
    out.key("edge").value(to_string(*point.edge));
  else
    out.key("at").value(numbers(point.at_m));
  out.key("motion").value(to_string(point.motion));
  if (point.file) out.key("file").value(relative(*point.file));
  out.end_map();
}

void write_declared_effect(YamlWriter& out, const DeclaredEffect& effect) {
  out.begin_flow_map().key("effect").value(effect.name);
  if (!effect.parameters.empty()) {
    out.key("parameters").begin_flow_map();
    for (const auto& [name, values] : effect.parameters) {
      out.key(name);
      if (values.size() == 1)
        out.value(values.front());
      else
        out.value(values);
    }
    out.end_map();
  }
  out.end_map();
}

}  // namespace clothfit
