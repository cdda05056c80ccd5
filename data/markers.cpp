#include "data/markers.h"

#include <fmt/format.h>

#include "data/csv_reader.h"
#include "data/number_limits.h"
#include "data/number_text.h"
#include "data/reading.h"
#include "data/text_file.h"

namespace clothfit {
namespace {

/// Reads the optional pair tag, corner into a marker or a reference point.
template <class Point>
void read_tag(const CsvReader& table, int tag_column, int corner_column, Point& point) {
  const bool has_tag = !table.empty(tag_column);
  const bool has_corner = !table.empty(corner_column);
  if (has_tag != has_corner)
    table.refuse(fmt::format("`{}` has a {} but no {}", point.name, has_tag ? "tag" : "corner",
                             has_tag ? "corner" : "tag"),
                 "both tag and corner, or neither");
  if (!has_tag) return;
  point.tag = table.whole_number(tag_column, 0);
  point.corner = table.whole_number(corner_column, 0);
  if (*point.corner > 3)
    table.refuse(fmt::format("corner = {}", *point.corner),
                 "0 bottom left, 1 bottom right, 2 top right or 3 top left");
}

/// Refuses a second use of a point's name or of a tag's corner.
class NamesSoFar {
 public:
  template <class Point>
  void add(const CsvReader& table, const Point& point, const std::string& what) {
    check(table, what + " `" + point.name + "`", point.name, names_);
    if (point.tag) {
      const std::string corner = fmt::format("corner {} of tag {}", *point.corner, *point.tag);
      check(table, corner, corner, corners_);
    }
  }

 private:
  using LineOfName = std::unordered_map<std::string, int>;
  static void check(const CsvReader& table, const std::string& what, const std::string& name,
                    LineOfName& lines) {
    const auto [earlier, is_new] = lines.emplace(name, table.line());
    if (!is_new)
      table.refuse(fmt::format("{} stands on line {} already", what, earlier->second), "each once",
                   "remove one of the two rows");
  }
  LineOfName names_;
  LineOfName corners_;
};

template <class Point>
std::string tag_fields(const Point& point) {
  return point.tag ? fmt::format(",{},{}", *point.tag, point.corner.value()) : ",,";
}

template <class Point>
bool any_tag(const std::vector<Point>& points) {
  for (const Point& point : points)
    if (point.tag) return true;
  return false;
}

}  // namespace

bool lies_on_cloth(double s_m, double t_m, double width_m, double height_m) {
  return s_m >= -kPlaceRounding_m && s_m <= width_m + kPlaceRounding_m &&
         t_m >= -kPlaceRounding_m && t_m <= height_m + kPlaceRounding_m;
}

namespace {

std::vector<Marker> parsed_markers(const std::filesystem::path& file, double width_m,
                                   double height_m) {
  enum Column { kMarker, kS, kT, kTag, kCorner };
  CsvReader table(file, {{"marker"}, {"s"}, {"t"}, {"tag", false}, {"corner", false}});
  std::vector<Marker> markers;
  NamesSoFar names;
  while (table.next()) {
    Marker marker;
    marker.name = table.name(kMarker);
    marker.s_m = table.number(kS);
    marker.t_m = table.number(kT);
    if (!lies_on_cloth(marker.s_m, marker.t_m, width_m, height_m))
      table.refuse(fmt::format("marker `{}` at (s, t) = ({}, {}) lies outside the cloth",
                               marker.name, marker.s_m, marker.t_m),
                   fmt::format("0 <= s <= {}, 0 <= t <= {} (metres)", width_m, height_m),
                   "correct the marker, or `size` in recording.yaml");
    read_tag(table, kTag, kCorner, marker);
    names.add(table, marker, "marker");
    markers.push_back(std::move(marker));
  }
  table.require_rows("markers");
  return markers;
}

}  // namespace

std::vector<Marker> read_markers(const std::filesystem::path& file, double width_m,
                                 double height_m) {
  return reading(file, [&] { return parsed_markers(file, width_m, height_m); });
}

void write_markers(const std::vector<Marker>& markers, const std::filesystem::path& file) {
  const bool tags = any_tag(markers);
  std::string text = tags ? "marker,s,t,tag,corner\n" : "marker,s,t\n";
  for (const Marker& marker : markers)
    text += fmt::format("{},{},{}{}\n", csv_name(marker.name), number_text(marker.s_m),
                        number_text(marker.t_m), tags ? tag_fields(marker) : "");
  write_text(text, file);
}

namespace {

std::vector<ReferencePoint> parsed_reference_points(const std::filesystem::path& file) {
  enum Column { kPoint, kX, kY, kZ, kTag, kCorner };
  CsvReader table(file, {{"point"}, {"x"}, {"y"}, {"z"}, {"tag", false}, {"corner", false}});
  std::vector<ReferencePoint> points;
  NamesSoFar names;
  while (table.next()) {
    ReferencePoint point;
    point.name = table.name(kPoint);
    point.x_m = table.number_within(kX, kFarthest_m, "metres");
    point.y_m = table.number_within(kY, kFarthest_m, "metres");
    point.z_m = table.number_within(kZ, kFarthest_m, "metres");
    read_tag(table, kTag, kCorner, point);
    names.add(table, point, "point");
    points.push_back(std::move(point));
  }
  table.require_rows("reference points");
  return points;
}

}  // namespace

std::vector<ReferencePoint> read_reference_points(const std::filesystem::path& file) {
  return reading(file, [&] { return parsed_reference_points(file); });
}

void write_reference_points(const std::vector<ReferencePoint>& points,
                            const std::filesystem::path& file) {
  const bool tags = any_tag(points);
  std::string text = tags ? "point,x,y,z,tag,corner\n" : "point,x,y,z\n";
  for (const ReferencePoint& point : points)
    text +=
        fmt::format("{},{},{},{}{}\n", csv_name(point.name), number_text(point.x_m),
                    number_text(point.y_m), number_text(point.z_m), tags ? tag_fields(point) : "");
  write_text(text, file);
}

}  // namespace clothfit
