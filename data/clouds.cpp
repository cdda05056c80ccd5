#include "data/clouds.h"

#include <charconv>
#include <string>
#include <vector>

#include "data/csv_reader.h"
#include "data/folder_entries.h"
#include "data/input_error.h"
#include "data/number_limits.h"
#include "data/reading.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

/// Says whether a file is a table; `frame` is the number that names it, -1 where none does.
bool is_table(const fs::path& file, int& frame) {
  std::string name = file.filename().string();
  if (name.ends_with(".gz")) name.resize(name.size() - 3);
  if (!name.ends_with(".csv")) return false;
  name.resize(name.size() - 4);
  const char* const end = name.data() + name.size();
  const auto [stopped, error] = std::from_chars(name.data(), end, frame);
  if (error != std::errc() || stopped != end || frame < 0) frame = -1;
  return true;
}

PointClouds parsed_point_clouds(const fs::path& folder) {
  PointClouds clouds;
  for (const FolderEntry& entry : list_folder(folder)) {
    const fs::path& path = entry.path;
    const std::string file = path.string();
    int frame = -1;
    if (!is_table(path, frame)) continue;
    if (frame < 0)
      throw InputError(file, "is named by no frame", "the number of its frame, such as 000012.csv");
    CsvReader table(path, {{"x"}, {"y"}, {"z"}});
    std::vector<Eigen::Vector3d> points_m;
    while (table.next()) points_m.push_back(table.vector_within<3>(0, kFarthest_m, "metres"));
    table.require_rows("points");
    const Eigen::Map<const Eigen::Matrix3Xd> cloud(points_m.front().data(), 3,
                                                   static_cast<Eigen::Index>(points_m.size()));
    if (!clouds.try_emplace(frame, cloud).second)
      throw InputError(file, "is a second cloud of its frame", "one file per frame");
  }
  return clouds;
}

}  // namespace

PointClouds read_point_clouds(const fs::path& folder) {
  return reading(folder, [&] { return parsed_point_clouds(folder); });
}

}  // namespace clothfit
