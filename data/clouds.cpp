#include "data/clouds.h"

#include <charconv>
#include <string>

#include "data/csv_table.h"
#include "data/input_error.h"

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

}  // namespace

PointClouds read_point_clouds(const fs::path& folder) {
  PointClouds clouds;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::string file = entry.path().string();
    int frame = -1;
    if (!is_table(entry.path(), frame)) continue;
    if (frame < 0)
      throw InputError(file, "is named by no frame", "the number of its frame, such as 000012.csv");
    const CsvTable table(entry.path(), {{"x"}, {"y"}, {"z"}});
    table.require_rows("points");
    Eigen::Matrix3Xd points_m(3, table.rows());
    for (int row = 0; row < table.rows(); ++row)
      for (int axis = 0; axis < 3; ++axis) points_m(axis, row) = table.number(row, axis);
    if (!clouds.try_emplace(frame, std::move(points_m)).second)
      throw InputError(file, "is a second cloud of its frame", "one file per frame");
  }
  return clouds;
}

}  // namespace clothfit
