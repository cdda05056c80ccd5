#include "data/pattern_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>

#include "data/drawn_outline.h"
#include "data/dxf_outline.h"
#include "data/garment_code.h"
#include "data/nearest_name.h"
#include "data/number_text.h"
#include "data/reading.h"
#include "data/shown_text.h"
#include "data/svg_outline.h"
#include "data/yaml_value.h"

namespace clothfit {
namespace {

constexpr double kFarthestOfGarment_m = 20;  ///< coordinates of a garment
constexpr size_t kMostPanels = 200, kMostCorners = 1000;

/// A panel while it is read.
struct DraftPanel {
  Panel panel;
  std::map<std::string, std::vector<int>> edges;  ///< by name; darts part one
  std::vector<std::array<int, 2>> dart_legs;      ///< edges
  std::vector<int> dart_lines;
  std::filesystem::path drawing;  ///< that its outline comes from; may be empty
  bool is_drawn = false;          ///< its outline comes from a drawing, whose edges all have names
};

Eigen::Vector2d point_of(const YamlValue& value, double unit_m) {
  const std::array<double, 2> at = value.numbers_between<2>(
      -kFarthestOfGarment_m / unit_m, kFarthestOfGarment_m / unit_m, "a coordinate");
  return unit_m * Eigen::Vector2d(at[0], at[1]);
}

Eigen::Vector3d vector_of(const YamlValue& value, double largest, const std::string& what) {
  const std::array<double, 3> at = value.numbers_between<3>(-largest, largest, what);
  return {at[0], at[1], at[2]};
}

/// A corner of the outline with the edge that begins there.
struct DraftCorner {
  Eigen::Vector2d place_m;
  PatternEdge edge;
  std::string name;  ///< of the edge; empty: none
};

/// Returns the name of an edge; refuses what a seam could take for something else.
std::string edge_name_of(const YamlValue& value) {
  std::string name = value.text();
  if (name.find('.') != std::string::npos || parse_number(name))
    value.refuse(fmt::format("edge = {}", shown_text(name)),
                 "a name that is no number and has no dot");
  return name;
}

DraftCorner corner_of(const YamlValue& value, double unit_m) {
  if (value.is_list()) return {point_of(value, unit_m), {}, {}};
  const YamlMap map = value.map({"at", "edge", "curve", "bulge"});
  DraftCorner corner{point_of(map.at("at"), unit_m), {}, {}};
  if (const YamlValue* name = map.find("edge")) corner.name = edge_name_of(*name);
  if (const YamlValue* curve = map.find("curve")) {
    for (const YamlValue& point : curve->items())
      corner.edge.control_m.push_back(point_of(point, unit_m));
    if (corner.edge.control_m.empty() || corner.edge.control_m.size() > 2)
      curve->refuse(fmt::format("a curve of {} points", corner.edge.control_m.size()),
                    "one control point (quadratic) or two (cubic)");
  }
  if (const YamlValue* bulge = map.find("bulge")) {
    if (!corner.edge.control_m.empty())
      bulge->refuse("an edge with curve and bulge", "one of the two");
    corner.edge.bulge = bulge->number_between(
        -100, 100, "the tangent of a quarter of the arc's angle, > 0 to the right");
  }
  return corner;
}

/// A dart in a straight edge: how far along it its tip points inwards.
struct Dart {
  double along_m = 0, width_m = 0, depth_m = 0;
  int line = 0;
};

Dart dart_of(const YamlMap& map, const DraftCorner& from, const Eigen::Vector2d& to_m,
             double unit_m) {
  if (!from.edge.control_m.empty() || from.edge.bulge != 0)
    map.whole().refuse("a dart in a curved edge", "a straight edge",
                       "give its corners and legs in the outline, and a seam");
  const double length_m = (to_m - from.place_m).norm(), largest = kFarthestOfGarment_m / unit_m;
  const double share = map.at("at").number_between(0, 1, "a share of the edge");
  Dart dart{.along_m = share * length_m,
            .width_m = unit_m * map.at("width").number_between(1e-3 / unit_m, largest, "a width"),
            .depth_m = unit_m * map.at("depth").number_between(1e-3 / unit_m, largest, "a depth"),
            .line = map.whole().line()};
  if (0.5 * dart.width_m >= std::min(share, 1 - share) * length_m)
    map.at("width").refuse(fmt::format("a dart {:.4g} mm wide at {:.4g} of an edge of {:.4g} mm",
                                       1e3 * dart.width_m, share, 1e3 * length_m),
                           "a dart within its edge");
  return dart;
}

size_t edge_of(const YamlValue& value, const std::vector<DraftCorner>& corners) {
  const std::string name = value.text();
  std::vector<std::string> names;
  for (size_t k = 0; k < corners.size(); ++k) {
    if (corners[k].name == name) {
      if (k + 1 < corners.size() && corners[k + 1].name == name)
        value.refuse(fmt::format("a dart in edge {}, which has several parts", shown_text(name)),
                     "an edge of one straight line", "draw the dart in the outline, and sew it");
      return k;
    }
    if (!corners[k].name.empty() && (names.empty() || names.back() != corners[k].name))
      names.push_back(corners[k].name);
  }
  value.refuse(fmt::format("edge = {}", shown_text(name)),
               names.empty() ? "an edge that its corner names" : known_names(name, names));
}

/// Adds the edges of an outline, in place of one with darts its parts and the darts' legs.
void add_edges(const std::vector<DraftCorner>& corners, std::map<size_t, std::vector<Dart>>& darts,
               const YamlMap& map, DraftPanel& draft) {
  std::vector<Eigen::Vector2d> places;
  Panel& panel = draft.panel;
  const auto add = [&](const Eigen::Vector2d& place_m, const PatternEdge& edge) {
    places.push_back(place_m);
    panel.edges.push_back(edge);
    return static_cast<int>(places.size()) - 1;
  };
  for (size_t k = 0; k < corners.size(); ++k) {
    const DraftCorner& corner = corners[k];
    std::vector<int> parts{add(corner.place_m, corner.edge)};
    std::vector<Dart>& of_edge = darts[k];
    std::ranges::sort(of_edge, {}, &Dart::along_m);
    const Eigen::Vector2d along =
        (corners[(k + 1) % corners.size()].place_m - corner.place_m).normalized();
    const Eigen::Vector2d inwards{-along.y(), along.x()};
    double free_m = 0;
    for (const Dart& dart : of_edge) {
      if (dart.along_m - 0.5 * dart.width_m <= free_m)
        map.at("darts").refuse(fmt::format("two darts meet in edge {}", corner.name),
                               "some of the edge between darts");
      free_m = dart.along_m + 0.5 * dart.width_m;
      const int first_leg = add(corner.place_m + (dart.along_m - 0.5 * dart.width_m) * along, {});
      const int second_leg =
          add(corner.place_m + dart.along_m * along + dart.depth_m * inwards, {});
      draft.dart_legs.push_back({first_leg, second_leg});
      draft.dart_lines.push_back(dart.line);
      parts.push_back(add(corner.place_m + free_m * along, {}));
    }
    if (corner.name.empty()) continue;
    std::vector<int>& named = draft.edges[corner.name];  // several corners of a drawing have one
    named.insert(named.end(), parts.begin(), parts.end());
  }
  panel.corner_m.resize(2, static_cast<Eigen::Index>(places.size()));
  for (size_t k = 0; k < places.size(); ++k)
    panel.corner_m.col(static_cast<Eigen::Index>(k)) = places[k];
}

std::vector<DraftCorner> listed_corners(const YamlValue& outline, double unit_m) {
  std::vector<DraftCorner> corners;
  const std::vector<YamlValue> items = outline.items();
  if (items.size() < 2 || items.size() > kMostCorners)
    outline.refuse(fmt::format("an outline of {} corners", items.size()),
                   fmt::format("2 to {} corners", kMostCorners));
  for (const YamlValue& item : items) {
    corners.push_back(corner_of(item, unit_m));
    const std::string& name = corners.back().name;
    const auto same = std::ranges::count(corners, name, &DraftCorner::name);
    if (!name.empty() && same > 1)
      item.refuse(fmt::format("a second edge {}", shown_text(name)), "names that differ");
  }
  return corners;
}

/// Returns the names of a drawn outline's edges: those of a list, or else numbers from 1.
std::vector<std::string> drawn_edge_names(const YamlMap& map, size_t count) {
  std::vector<std::string> names;
  const YamlValue* const list = map.find("edges");
  if (list == nullptr) {
    for (size_t k = 1; k <= count; ++k) names.push_back(std::to_string(k));
    return names;
  }
  const std::vector<YamlValue> items = list->items();
  if (items.size() != count)
    list->refuse(fmt::format("{} names for {} edges", items.size(), count),
                 "a name for each edge, counterclockwise from the outline's first corner",
                 "without `edges` they are named by number, 1, 2, ...");
  for (const YamlValue& item : items) {
    names.push_back(edge_name_of(item));
    if (std::ranges::count(names, names.back()) > 1)
      item.refuse(fmt::format("a second edge {}", shown_text(names.back())), "names that differ");
  }
  return names;
}

/// Reads an outline from the drawing that the pattern names.
std::vector<DraftCorner> drawn_corners(const YamlMap& map, const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / map.at("file").text();
  const std::string piece = map.at("piece").text();
  std::optional<double> unit_m;
  if (const YamlValue* unit = map.find("unit"))
    unit_m = unit->one_of<double>(
        {{"mm", 0.001}, {"cm", 0.01}, {"m", 1}, {"in", 0.0254}, {"inch", 0.0254}});
  std::string extension = file.extension().string();
  for (char& letter : extension)
    if (letter >= 'A' && letter <= 'Z') letter = static_cast<char>(letter - 'A' + 'a');
  if (extension != ".svg" && extension != ".dxf")
    map.at("file").refuse(fmt::format("file = {}", shown_text(file.filename().string())),
                          "a drawing whose name ends in .svg or .dxf");
  const PanelOutline outline = extension == ".svg" ? read_svg_outline(file, piece, unit_m)
                                                   : read_dxf_outline(file, piece, unit_m);
  const std::vector<std::string> names = drawn_edge_names(map, outline.begin_at_corner.size());
  std::vector<DraftCorner> corners;
  size_t named = 0;
  for (size_t k = 0; k < outline.edges.size(); ++k) {
    if (named < names.size() && outline.begin_at_corner[named] == static_cast<int>(k)) ++named;
    corners.push_back(
        {outline.corner_m.col(static_cast<Eigen::Index>(k)), outline.edges[k], names[named - 1]});
  }
  return corners;
}

void read_outline(const YamlMap& map, double unit_m, const std::filesystem::path& folder,
                  DraftPanel& draft) {
  const YamlValue& outline = map.at("outline");
  draft.is_drawn = outline.is_map();
  if (draft.is_drawn)
    draft.drawing = folder / outline.map({"file", "piece", "unit", "edges"}).at("file").text();
  const std::vector<DraftCorner> corners =
      draft.is_drawn ? drawn_corners(outline.map({"file", "piece", "unit", "edges"}), folder)
                     : listed_corners(outline, unit_m);
  std::map<size_t, std::vector<Dart>> darts;  // of each edge
  if (const YamlValue* list = map.find("darts"))
    for (const YamlValue& item : list->items()) {
      const YamlMap dart = item.map({"edge", "at", "width", "depth"});
      const size_t index = edge_of(dart.at("edge"), corners);
      darts[index].push_back(
          dart_of(dart, corners[index], corners[(index + 1) % corners.size()].place_m, unit_m));
    }
  add_edges(corners, darts, map, draft);
}

DraftPanel panel_of(const YamlValue& value, const std::string& name, double unit_m,
                    const std::vector<std::string>& fabrics, const std::filesystem::path& folder) {
  const YamlMap map = value.map({"fabric", "grain", "at", "turn", "outline", "darts"});
  DraftPanel draft;
  Panel& panel = draft.panel;
  panel.name = name;
  panel.line = value.line();
  read_outline(map, unit_m, folder, draft);
  if (const YamlValue* fabric = map.find("fabric")) {
    const std::string word = fabric->text();
    const auto at = std::ranges::find(fabrics, word);
    if (at == fabrics.end())
      fabric->refuse(fmt::format("fabric = {}", shown_text(word)), known_names(word, fabrics));
    panel.fabric = static_cast<int>(at - fabrics.begin());
  }
  const double degree = std::numbers::pi / 180;
  if (const YamlValue* grain = map.find("grain"))
    panel.grain_rad = degree * grain->number_between(-180, 180, "degrees from the panel's y axis");
  using Eigen::AngleAxisd, Eigen::Vector3d;
  panel.placement.translate(unit_m *
                            vector_of(map.at("at"), kFarthestOfGarment_m / unit_m, "a coordinate"));
  const Vector3d turn = degree * vector_of(map.at("turn"), 360, "degrees");
  panel.placement.rotate(AngleAxisd(turn.z(), Vector3d::UnitZ()) *
                         AngleAxisd(turn.y(), Vector3d::UnitY()) *
                         AngleAxisd(turn.x(), Vector3d::UnitX()));
  return draft;
}

/// Reads PANEL.EDGE, the edge by its name or its number in the outline.
SeamSide side_of(const YamlValue& value, const std::vector<DraftPanel>& drafts) {
  const std::string text = value.text();
  const size_t dot = text.rfind('.');
  if (dot == std::string::npos)
    value.refuse(fmt::format("side = {}", shown_text(text)), "PANEL.EDGE, such as front.side");
  const std::string panel = text.substr(0, dot), edge = text.substr(dot + 1);
  const auto draft =
      std::ranges::find(drafts, panel, [](const DraftPanel& of) { return of.panel.name; });
  if (draft == drafts.end()) {
    std::vector<std::string> names;
    for (const DraftPanel& of : drafts) names.push_back(of.panel.name);
    value.refuse(fmt::format("panel {}", shown_text(panel)), known_names(panel, names));
  }
  SeamSide side{.panel = static_cast<int>(draft - drafts.begin()), .edges = {}};
  const auto named = draft->edges.find(edge);
  if (const auto number = parse_whole_number(edge); number && !draft->is_drawn) {
    if (*number < 0 || *number >= draft->panel.edge_count())
      value.refuse(fmt::format("edge {} of panel {}", *number, panel),
                   fmt::format("a name, or 0 to {}", draft->panel.edge_count() - 1));
    side.edges = {*number};
    return side;
  }
  if (named == draft->edges.end()) {
    std::vector<std::string> names;
    for (const auto& [name, edges] : draft->edges) names.push_back(name);
    value.refuse(fmt::format("edge {} of panel {}", shown_text(edge), panel),
                 names.empty() ? "an edge that its corner names" : known_names(edge, names));
  }
  side.edges = named->second;
  return side;
}

Seam seam_of(const YamlValue& value, const std::vector<DraftPanel>& drafts) {
  Seam seam;
  seam.line = value.line();
  std::optional<YamlMap> map;
  if (!value.is_list()) map = value.map({"sides", "easing"});
  const YamlValue& sides = map ? map->at("sides") : value;
  const std::vector<YamlValue> items = sides.items();
  if (items.size() != 2)
    sides.refuse(fmt::format("a seam of {} sides", items.size()), "two, [front.side, back.side]");
  for (size_t n = 0; n < 2; ++n) seam.sides[n] = side_of(items[n], drafts);
  if (map)
    if (const YamlValue* easing = map->find("easing"))
      seam.easing = easing->number_between(0, 10, "the share by which a side may be longer");
  return seam;
}

Pattern parsed_pattern(const std::filesystem::path& file) {
  const YamlMap map = read_yaml(file).map({"format", "name", "unit", "fabrics", "panels", "seams"});
  map.at("format").one_of<int>({{"clothfit-pattern/1", 0}});
  Pattern pattern;
  pattern.file = file.string();
  pattern.name = map.at("name").text();
  const YamlValue* unit = map.find("unit");
  const double unit_m =
      unit ? unit->one_of<double>({{"m", 1}, {"cm", 0.01}, {"mm", 0.001}, {"inch", 0.0254}}) : 1;
  if (const YamlValue* fabrics = map.find("fabrics")) {
    for (const auto& [name, sheet] : fabrics->entries()) {
      pattern.fabrics.push_back(name);
      pattern.fabric_files.push_back(file.parent_path() / sheet.text());
    }
  } else {
    pattern.fabrics = {"cloth"};
    pattern.fabric_files.resize(1);
  }
  const std::vector<std::pair<std::string, YamlValue>> panels = map.at("panels").entries();
  if (panels.empty() || panels.size() > kMostPanels)
    map.at("panels").refuse(fmt::format("{} panels", panels.size()),
                            fmt::format("1 to {}", kMostPanels));
  std::vector<DraftPanel> drafts;
  for (const auto& [name, panel] : panels)
    drafts.push_back(panel_of(panel, name, unit_m, pattern.fabrics, file.parent_path()));
  if (const YamlValue* seams = map.find("seams"))
    for (const YamlValue& seam : seams->items()) pattern.seams.push_back(seam_of(seam, drafts));
  for (size_t p = 0; p < drafts.size(); ++p) {
    for (size_t n = 0; n < drafts[p].dart_legs.size(); ++n) {
      const auto [one, other] = drafts[p].dart_legs[n];
      Seam seam;
      seam.sides = {SeamSide{static_cast<int>(p), {one}}, SeamSide{static_cast<int>(p), {other}}};
      seam.line = drafts[p].dart_lines[n];
      pattern.seams.push_back(seam);
    }
    if (drafts[p].is_drawn) pattern.drawing_files.push_back(drafts[p].drawing);
    pattern.panels.push_back(std::move(drafts[p].panel));
  }
  return pattern;
}

}  // namespace

Pattern read_pattern(const std::filesystem::path& file) {
  if (file.extension() == ".json") return read_garment_code(file);
  return reading(file, [&] { return parsed_pattern(file); });
}

}  // namespace clothfit
