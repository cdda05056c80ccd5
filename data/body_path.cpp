#include "data/body_path.h"

#include <fmt/format.h>

#include "data/csv_reader.h"
#include "data/number_limits.h"
#include "data/reading.h"
#include "data/unit_quaternion.h"

namespace clothfit {

namespace {

BodyPath parsed_body_path(const std::filesystem::path& file) {
  enum Column { kTime, kX, kY, kZ, kQw, kQx, kQy, kQz };
  CsvReader table(file, {{"time"}, {"x"}, {"y"}, {"z"}, {"qw"}, {"qx"}, {"qy"}, {"qz"}});
  BodyPath path;
  while (table.next()) {
    path.time_s.push_back(table.rising_time(kTime));
    path.position_m.push_back(table.vector_within<3>(kX, kFarthest_m, "metres"));
    const double w = table.number(kQw), x = table.number(kQx);
    const double y = table.number(kQy), z = table.number(kQz);
    const std::optional<Eigen::Quaterniond> rotation = unit_quaternion(w, x, y, z);
    if (!rotation)
      table.refuse(fmt::format("quaternion ({}, {}, {}, {})", w, x, y, z),
                   "a rotation of norm 1, off by 0.001 at most");
    path.rotation.push_back(*rotation);
  }
  table.require_rows("poses");
  return path;
}

}  // namespace

BodyPath read_body_path(const std::filesystem::path& file) {
  return reading(file, [&] { return parsed_body_path(file); });
}

}  // namespace clothfit
