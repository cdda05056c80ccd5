#include "data/body_path.h"

#include <fmt/format.h>

#include "data/csv_table.h"
#include "data/unit_quaternion.h"

namespace clothfit {

BodyPath read_body_path(const std::filesystem::path& file) {
  enum Column { kTime, kX, kY, kZ, kQw, kQx, kQy, kQz };
  const CsvTable table(file, {{"time"}, {"x"}, {"y"}, {"z"}, {"qw"}, {"qx"}, {"qy"}, {"qz"}});
  table.require_rows("poses");
  BodyPath path;
  for (int row = 0; row < table.rows(); ++row) {
    path.time_s.push_back(table.rising_number(row, kTime));
    path.position_m.emplace_back(table.number(row, kX), table.number(row, kY),
                                 table.number(row, kZ));
    const double w = table.number(row, kQw), x = table.number(row, kQx);
    const double y = table.number(row, kQy), z = table.number(row, kQz);
    const std::optional<Eigen::Quaterniond> rotation = unit_quaternion(w, x, y, z);
    if (!rotation)
      table.refuse(row, fmt::format("quaternion ({}, {}, {}, {})", w, x, y, z),
                   "a rotation of norm 1, off by 0.001 at most");
    path.rotation.push_back(*rotation);
  }
  return path;
}

}  // namespace clothfit
