#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "data/recording.h"
#include "data/yaml_value.h"
#include "data/yaml_writer.h"

namespace clothfit {

/// The common parts of recording.yaml and model files. Inside data/ only.

/// Sizes of a cloth or of a board's square beyond these are slips in the unit or the exponent.
inline constexpr double kSmallest_m = 1e-4;
inline constexpr double kLargest_m = 1e3;

/// Finds the files that a YAML file names, relative to its folder. Errors show paths as the user
/// gave them.
class RecordingFiles {
 public:
  RecordingFiles(std::filesystem::path given_folder, OutsideFiles outside);

  const std::filesystem::path& root() const { return folder_; }
  std::filesystem::path shown(const YamlValue& value) const { return given_folder_ / value.text(); }

  /// Returns a file inside the folder, unless `outside` allows others.
  std::filesystem::path file(const YamlValue& value) const;
  std::filesystem::path file_anywhere(const YamlValue& value) const;
  std::filesystem::path folder(const YamlValue& value) const;
  std::filesystem::path file_or_folder(const YamlValue& value) const;

 private:
  std::filesystem::file_status status(const YamlValue& value) const;
  std::filesystem::path absolute(const YamlValue& value) const;

  std::filesystem::path given_folder_;
  std::filesystem::path folder_;
  OutsideFiles outside_;
};

/// Names files relative to the folder that a YAML file is written to.
class RelativePaths {
 public:
  explicit RelativePaths(const std::filesystem::path& folder);
  std::string operator()(const std::filesystem::path& path) const;

 private:
  std::filesystem::path folder_;
};

/// Reads a name that can name files.
std::string read_file_name(const YamlValue& value);
ClothDescription read_cloth(const YamlValue& value);
Eigen::Vector3d read_gravity(const YamlValue& value);
double read_frame_rate(const YamlValue& value);
/// Reads columns and rows of a mesh.
std::pair<int, int> read_mesh(const YamlValue& value);
/// Reads a table of frame times.
std::vector<double> read_times(const std::filesystem::path& file);
/// Writes such a table, a row for each frame.
void write_times(const std::vector<double>& times_s, const std::filesystem::path& file);
/// Reads a place (s, t) on the cloth.
Eigen::Vector2d read_place(const YamlValue& value, const ClothDescription& cloth);
/// Reads held points and edges; `motions` are the allowed words.
std::vector<HeldPoint> read_held(const YamlValue& value, const RecordingFiles& files,
                                 const ClothDescription& cloth,
                                 const std::vector<std::pair<std::string, HeldMotion>>& motions);
std::vector<DeclaredEffect> read_declared(const YamlValue& value);

inline std::array<double, 2> numbers(const Eigen::Vector2d& v) {
  return {v.x(), v.y()};
}
inline std::array<double, 3> numbers(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

void write_cloth(YamlWriter& out, const ClothDescription& cloth);
void write_mesh(YamlWriter& out, int columns, int rows);
void write_held_point(YamlWriter& out, const HeldPoint& point, const RelativePaths& relative);
void write_declared_effect(YamlWriter& out, const DeclaredEffect& effect);

/// Writes a list with an item per line; `[]` when there is none.
template <class Item, class WriteItem>
void write_list(YamlWriter& out, const std::string& key, const std::vector<Item>& items,
                const WriteItem& write_item) {
  out.key(key);
  if (items.empty()) {
    out.begin_flow_list().end_list();
    return;
  }
  out.begin_list();
  for (const Item& item : items) write_item(item);
  out.end_list();
}

}  // namespace clothfit
