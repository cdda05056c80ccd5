#include "data/garment_code.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "data/drawn_outline.h"
#include "data/json_value.h"
#include "data/number_limits.h"
#include "data/read_json.h"
#include "data/reading.h"

namespace clothfit {
namespace {

constexpr const char* kSpecification = "a pattern specification of GarmentCode (JSON)";
constexpr const char* kExport = "export the pattern as a specification";
/// Share by which a gathered side may be longer.
constexpr double kGathered = 5;
constexpr size_t kMostPanels = 200, kMostEdges = 1000;

/// Returns N numbers.
template <int N>
Eigen::Vector<double, N> vector_of(const JsonValue& json, double farthest) {
  const std::vector<JsonValue> items = json.items();
  if (items.size() != static_cast<size_t>(N))
    json.refuse(fmt::format("has {} numbers", items.size()), fmt::format("a list of {}", N));
  Eigen::Vector<double, N> result;
  for (int k = 0; k < N; ++k)
    result[k] = items[static_cast<size_t>(k)].number_from(-farthest, farthest);
  return result;
}

/// Reads an arc: its radius, whether it is the larger one, and whether it bulges to the right.
PatternEdge arc_of(const JsonValue& json, double chord_m, double unit_m) {
  const std::vector<JsonValue> params = json.items();
  if (params.size() != 3)
    json.refuse(fmt::format("has {} numbers", params.size()),
                "a radius, 0 or 1 for the larger arc, 0 or 1 for the right side");
  const double radius_m = unit_m * params[0].number_from(0, kFarthest_m / unit_m);
  const double sine = 0.5 * chord_m / radius_m;
  // A file's decimals let a half circle's chord exceed its diameter.
  if (!(sine <= 1 + 1e-6))
    params[0].refuse("is less than half its chord", "a radius that reaches both ends");
  double angle = 2 * std::asin(std::min(sine, 1.0));
  if (params[1].number_from(0, 1) > 0.5) angle = 2 * std::numbers::pi - angle;
  PatternEdge edge;
  edge.bulge = std::tan(0.25 * angle);
  if (params[2].number_from(0, 1) < 0.5) edge.bulge = -edge.bulge;
  return edge;
}

/// Reads a curve whose points are given along its chord and to the left of it.
PatternEdge curve_of(const JsonValue& json, const Eigen::Vector2d& from_m,
                     const Eigen::Vector2d& to_m, double unit_m) {
  const Eigen::Vector2d chord = to_m - from_m, left{-chord.y(), chord.x()};
  const std::string type = json.at("type").text();
  if (type == "circle") return arc_of(json.at("params"), chord.norm(), unit_m);
  const size_t expected = type == "quadratic" ? 1 : type == "cubic" ? 2 : 0;
  if (expected == 0) json.at("type").refuse("is `" + type + "`", "quadratic, cubic or circle");
  const std::vector<JsonValue> params = json.at("params").items();
  if (params.size() != expected)
    json.at("params").refuse(fmt::format("has {} points", params.size()),
                             fmt::format("{} for a {} curve", expected, type));
  PatternEdge edge;
  for (const JsonValue& point : params) {
    const Eigen::Vector2d at = vector_of<2>(point, 1e3);
    edge.control_m.emplace_back(from_m + at.x() * chord + at.y() * left);
  }
  return edge;
}

Eigen::Isometry3d placement_of(const JsonValue& json, double unit_m) {
  using Eigen::AngleAxisd, Eigen::Vector3d;
  const Vector3d degrees = vector_of<3>(json.at("rotation"), 3600);
  const Vector3d angle = std::numbers::pi / 180 * degrees;
  const Vector3d offset = unit_m * vector_of<3>(json.at("translation"), kFarthest_m / unit_m);
  Eigen::Isometry3d placement(AngleAxisd(0.5 * std::numbers::pi, Vector3d::UnitX()));
  placement.translate(offset);
  placement.rotate(AngleAxisd(angle.x(), Vector3d::UnitX()) *
                   AngleAxisd(angle.y(), Vector3d::UnitY()) *
                   AngleAxisd(angle.z(), Vector3d::UnitZ()));
  return placement;
}

/// Returns the vertices from which the edges of a panel go to the next, and the last of them again.
std::vector<int> loop_of(const std::vector<JsonValue>& edges, int vertices) {
  std::vector<int> loop;
  for (const JsonValue& edge : edges) {
    const std::vector<JsonValue> two = edge.at("endpoints").items();
    if (two.size() != 2) edge.at("endpoints").refuse("does not have two ends", "two vertices");
    const int from = two[0].count_from(0, vertices - 1), to = two[1].count_from(0, vertices - 1);
    if (loop.empty()) loop.push_back(from);
    if (loop.back() != from)
      edge.refuse("does not begin where the last one ends", "edges in order around the panel");
    loop.push_back(to);
  }
  if (loop.front() != loop.back())
    edges.back().refuse("does not end where the first begins", "edges in order around the panel");
  return loop;
}

/// Turns a panel that is drawn as seen from inside.
void turn_over(Panel& panel) {
  panel.corner_m.row(0) *= -1;
  for (PatternEdge& edge : panel.edges) {
    edge.bulge = -edge.bulge;
    for (Eigen::Vector2d& point : edge.control_m) point.x() *= -1;
  }
  panel.placement.rotate(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitY()));
}

Panel panel_of(const JsonValue& json, const std::string& name, double unit_m) {
  Panel panel;
  panel.name = name;
  std::vector<Eigen::Vector2d> vertices;
  for (const JsonValue& vertex : json.at("vertices").items())
    vertices.emplace_back(unit_m * vector_of<2>(vertex, kFarthest_m / unit_m));
  const std::vector<JsonValue> edges = json.at("edges").items();
  if (edges.size() < 2 || edges.size() > kMostEdges)
    json.at("edges").refuse(fmt::format("has {} edges", edges.size()),
                            fmt::format("2 to {}", kMostEdges));
  const std::vector<int> loop = loop_of(edges, static_cast<int>(vertices.size()));
  panel.corner_m.resize(2, static_cast<Eigen::Index>(edges.size()));
  for (size_t k = 0; k < edges.size(); ++k) {
    const Eigen::Vector2d &from = vertices[static_cast<size_t>(loop[k])],
                          &to = vertices[static_cast<size_t>(loop[k + 1])];
    panel.corner_m.col(static_cast<Eigen::Index>(k)) = from;
    panel.edges.push_back(edges[k].has("curvature")
                              ? curve_of(edges[k].at("curvature"), from, to, unit_m)
                              : PatternEdge());
  }
  panel.placement = placement_of(json, unit_m);
  if (twice_outline_area_m2(panel.corner_m, panel.edges) < 0) turn_over(panel);
  return panel;
}

/// Returns the length of the file's unit (m).
double unit_of(const JsonValue& whole) {
  if (!whole.has("properties")) return 0.01;
  const JsonValue properties = whole.at("properties");
  if (properties.has("curvature_coords") && properties.at("curvature_coords").text() != "relative")
    properties.at("curvature_coords").refuse("is not relative", "relative");
  return properties.has("units_in_meter")
             ? 1 / properties.at("units_in_meter").number_from(0.001, 1e4)
             : 0.01;
}

Seam seam_of(const JsonValue& stitch, const std::map<std::string, int>& number,
             const std::vector<Panel>& panels) {
  const std::vector<JsonValue> sides = stitch.items();
  if (sides.size() != 2)
    stitch.refuse(fmt::format("has {} parts", sides.size()),
                  "two sides; stitches that turn one round are not read");
  Seam seam;
  seam.easing = kGathered;
  for (size_t n = 0; n < 2; ++n) {
    const std::string name = sides[n].at("panel").text();
    const auto at = number.find(name);
    if (at == number.end()) sides[n].at("panel").refuse("is `" + name + "`", "the name of a panel");
    seam.sides[n].panel = at->second;
    const int last_edge = panels[static_cast<size_t>(at->second)].edge_count() - 1;
    seam.sides[n].edges = {sides[n].at("edge").count_from(0, last_edge)};
  }
  return seam;
}

Pattern parsed_garment_code(const std::filesystem::path& file) {
  const nlohmann::json parsed = read_json(file, kSpecification, kExport);
  const JsonFile named{file.string(), kSpecification, kExport};
  const JsonValue whole(parsed, named, "");
  const double unit_m = unit_of(whole);
  const JsonValue json = whole.at("pattern"), panels = json.at("panels");
  Pattern pattern;
  pattern.file = file.string();
  pattern.name = file.stem().string();
  pattern.fabrics = {"cloth"};
  pattern.fabric_files.resize(1);
  const std::vector<std::string> names = panels.keys();
  if (names.size() > kMostPanels)
    panels.refuse(fmt::format("has {} panels", names.size()), fmt::format("up to {}", kMostPanels));
  std::map<std::string, int> number;
  for (const std::string& name : names) {
    number[name] = static_cast<int>(pattern.panels.size());
    pattern.panels.push_back(panel_of(panels.at(name), name, unit_m));
  }
  for (const JsonValue& stitch : json.at("stitches").items())
    pattern.seams.push_back(seam_of(stitch, number, pattern.panels));
  return pattern;
}

}  // namespace

Pattern read_garment_code(const std::filesystem::path& file) {
  return reading(file, [&] { return parsed_garment_code(file); });
}

}  // namespace clothfit
