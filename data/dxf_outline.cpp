#include "data/dxf_outline.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>
#include <span>
#include <string_view>
#include <vector>

#include "data/file_limits.h"
#include "data/input_error.h"
#include "data/number_text.h"
#include "data/reading.h"
#include "data/shown_text.h"
#include "data/text_file.h"
#include "data/unpacked_bytes.h"

namespace clothfit {
namespace {

using Eigen::Vector2d;

constexpr std::string_view kDxfCutLayer = "1", kDxfTurnLayer = "2", kDxfCurveLayer = "3";
constexpr const char* kDxfExpected = "a DXF drawing in text";

/// A group of a DXF file: a code and its value, in two lines.
struct DxfGroup {
  int code = 0;
  std::string_view value;
  int line = 0;  ///< of the value
};

/// An entity: its kind and what follows up to the next.
struct DxfEntity {
  std::string_view kind;
  std::span<const DxfGroup> groups;
  int line = 0;

  const DxfGroup* find(int code) const {
    const auto at = std::ranges::find(groups, code, &DxfGroup::code);
    return at == groups.end() ? nullptr : &*at;
  }
  std::string_view layer() const { return find(8) ? find(8)->value : std::string_view(); }
};

struct DxfBlock {
  std::string name;
  std::vector<DxfEntity> entities;
};

/// A DXF file; groups and names are views of its text.
struct DxfDrawing {
  std::string file, text;
  std::vector<DxfGroup> groups;
  std::vector<DxfBlock> blocks;
  std::vector<DxfEntity> entities;  ///< outside blocks
  const DxfGroup* units = nullptr;

  [[noreturn]] void refuse(int line, const std::string& problem, const std::string& expected,
                           const std::string& remedy = "") const {
    throw InputError(file, line, problem, expected, remedy);
  }
  double number_of(const DxfGroup& group) const {
    const std::optional<double> number = parse_number(group.value);
    if (!number || std::abs(*number) > 1e100)
      refuse(group.line, fmt::format("group {} = {}", group.code, shown_text(group.value)),
             "a number");
    return *number;
  }
  double number_of(const DxfEntity& entity, int code) const {
    const DxfGroup* const group = entity.find(code);
    if (group == nullptr)
      refuse(entity.line, fmt::format("{} without group {}", shown_text(entity.kind), code),
             "all numbers of an entity");
    return number_of(*group);
  }
  int flags_of(const DxfEntity& entity) const {
    const DxfGroup* const group = entity.find(70);
    if (group == nullptr) return 0;
    const std::optional<int> flags = parse_whole_number(group->value);
    if (!flags)
      refuse(group->line, fmt::format("group 70 = {}", shown_text(group->value)), "flags");
    return *flags;
  }
};

std::string_view without_spaces(std::string_view text) {
  const size_t begin = std::min(text.find_first_not_of(" \t"), text.size());
  text.remove_prefix(begin);
  return text.substr(0, text.find_last_not_of(" \t") + 1);
}

void refuse_binary_dxf(const std::filesystem::path& file) {
  constexpr std::string_view kBinary = "AutoCAD Binary DXF";
  std::array<char, kBinary.size()> begin{};
  UnpackedBytes bytes(file);
  size_t count = 0;
  while (count < begin.size()) {
    const size_t more = bytes.read(begin.data() + count, begin.size() - count);
    if (more == 0) break;
    count += more;
  }
  if (std::string_view(begin.data(), count) == kBinary)
    throw InputError(file.string(), "is a binary DXF drawing", kDxfExpected,
                     "export it as ASCII DXF");
}

/// Divides the text into groups.
void read_dxf_groups(DxfDrawing& drawing) {
  std::string_view rest = drawing.text;
  int line = 0;
  const auto next_line = [&] {
    const size_t end = std::min(rest.find('\n'), rest.size());
    const std::string_view text = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    ++line;
    return without_spaces(text);
  };
  while (!rest.empty()) {
    const std::string_view code_text = next_line();
    const std::optional<int> code = parse_whole_number(code_text);
    if (!code)
      drawing.refuse(line, fmt::format("group code = {}", shown_text(code_text)), kDxfExpected);
    if (rest.empty()) drawing.refuse(line, "the last group has no value", "a whole file");
    const std::string_view value = next_line();
    if (*code == 0 && value == "EOF") break;
    if (*code != 999) drawing.groups.push_back({*code, value, line});  // 999: a comment
  }
}

/// Sorts the entities into blocks.
void read_dxf_entities(DxfDrawing& drawing) {
  std::string_view section;
  DxfBlock* block = nullptr;
  const std::vector<DxfGroup>& groups = drawing.groups;
  for (size_t k = 0; k < groups.size();) {
    size_t end = k + 1;
    while (end < groups.size() && groups[end].code != 0) ++end;
    const DxfEntity entity{.kind = groups[k].value,
                           .groups = std::span(groups).subspan(k + 1, end - k - 1),
                           .line = groups[k].line};
    if (groups[k].code != 0) drawing.refuse(groups[k].line, "begins within a group", kDxfExpected);
    if (entity.kind == "SECTION") {
      section = entity.find(2) ? entity.find(2)->value : std::string_view();
      block = nullptr;
      for (size_t n = k + 1; section == "HEADER" && n + 1 < end; ++n)
        if (groups[n].code == 9 && groups[n].value == "$INSUNITS") drawing.units = &groups[n + 1];
    } else if (entity.kind == "BLOCK" && section == "BLOCKS") {
      const DxfGroup* const name = entity.find(2);
      drawing.blocks.push_back({std::string(name ? name->value : ""), {}});
      block = &drawing.blocks.back();
    } else if (entity.kind == "ENDBLK" || entity.kind == "ENDSEC") {
      block = nullptr;
    } else if (block != nullptr) {
      block->entities.push_back(entity);
    } else if (section == "ENTITIES") {
      drawing.entities.push_back(entity);
    }
    k = end;
  }
}

/// Returns the length of the drawing's unit (m).
double dxf_unit_m(const DxfDrawing& drawing) {
  const std::string remedy = "give the unit beside the piece: `unit: mm`";
  const std::string expected = "$INSUNITS = 1 (inch), 4 (mm), 5 (cm) or 6 (m)";
  if (drawing.units == nullptr) throw InputError(drawing.file, "names no unit", expected, remedy);
  const std::optional<int> code = parse_whole_number(drawing.units->value);
  switch (code.value_or(0)) {
    case 1:
      return 0.0254;
    case 4:
      return 0.001;
    case 5:
      return 0.01;
    case 6:
      return 1;
    default:
      drawing.refuse(drawing.units->line,
                     fmt::format("$INSUNITS = {}", shown_text(drawing.units->value)), expected,
                     remedy);
  }
}

/// What a piece holds of outlines.
struct DxfPiece {
  struct Polyline {
    DrawnOutline drawn;
    std::string_view layer;
    bool is_closed = false;
  };
  /// A line or an arc.
  struct Stroke {
    Vector2d from, to;
    PatternEdge edge;
    std::string_view layer;
    int line = 0;
  };
  std::vector<Polyline> polylines;
  std::vector<Stroke> strokes;
  std::vector<Vector2d> turn_points, curve_points;
  std::set<std::string> others;  ///< kinds of curves that are not read
};

/// Adds a vertex with the bulge of the edge before it.
void add_dxf_vertex(DrawnOutline& drawn, Vector2d at, double bulge_before) {
  if (drawn.vertex.empty()) {
    drawn.vertex.push_back(at);
    return;
  }
  PatternEdge edge;
  edge.bulge = at == drawn.vertex.back() ? 0 : bulge_before;
  drawn.add(edge, at);
}

/// Closes a polyline that says so or ends where it begins.
void end_dxf_polyline(DxfPiece::Polyline& polyline, bool says_closed, double last_bulge) {
  DrawnOutline& drawn = polyline.drawn;
  if (drawn.edges.empty()) return;
  Eigen::AlignedBox2d box;
  for (const Vector2d& point : drawn.vertex) box.extend(point);
  const double gap = (drawn.vertex.back() - drawn.vertex.front()).norm();
  polyline.is_closed = says_closed || gap <= kClosingShare * box.sizes().maxCoeff();
  if (!polyline.is_closed) return;
  if (gap > kClosingShare * box.sizes().maxCoeff())
    add_dxf_vertex(drawn, drawn.vertex.front(), last_bulge);
  drawn.close();
}

/// Reads a LWPOLYLINE, whose vertices are groups of its own.
void read_dxf_light_polyline(const DxfDrawing& drawing, const DxfEntity& entity,
                             DxfPiece::Polyline& polyline) {
  double bulge = 0;  // of the edge from the last vertex
  const DxfGroup* x = nullptr;
  for (const DxfGroup& group : entity.groups) {
    if (group.code == 10) x = &group;
    if (group.code == 42) bulge = drawing.number_of(group);
    if (group.code != 20 || x == nullptr) continue;
    add_dxf_vertex(polyline.drawn, {drawing.number_of(*x), drawing.number_of(group)}, bulge);
    x = nullptr;
    bulge = 0;
  }
  end_dxf_polyline(polyline, (drawing.flags_of(entity) & 1) != 0, bulge);
}

/// Reads a POLYLINE, whose vertices are entities; returns how many there are with its end.
size_t read_dxf_polyline(const DxfDrawing& drawing, std::span<const DxfEntity> entities,
                         DxfPiece::Polyline& polyline) {
  constexpr int kClosed = 1, kMesh = 16 | 64, kControlPoint = 16;
  double bulge = 0;
  size_t k = 1;
  const int flags = drawing.flags_of(entities[0]);
  const bool is_outline = (flags & kMesh) == 0;
  for (; k < entities.size() && entities[k].kind == "VERTEX"; ++k) {
    const DxfEntity& vertex = entities[k];
    if (!is_outline || (drawing.flags_of(vertex) & kControlPoint) != 0) continue;
    add_dxf_vertex(polyline.drawn, {drawing.number_of(vertex, 10), drawing.number_of(vertex, 20)},
                   bulge);
    bulge = vertex.find(42) ? drawing.number_of(*vertex.find(42)) : 0;
  }
  end_dxf_polyline(polyline, (flags & kClosed) != 0, bulge);
  return k < entities.size() && entities[k].kind == "SEQEND" ? k + 1 : k;
}

DxfPiece::Stroke dxf_stroke(const DxfDrawing& drawing, const DxfEntity& entity) {
  DxfPiece::Stroke stroke;
  stroke.layer = entity.layer();
  stroke.line = entity.line;
  const Vector2d at(drawing.number_of(entity, 10), drawing.number_of(entity, 20));
  if (entity.kind == "LINE") {
    stroke.from = at;
    stroke.to = {drawing.number_of(entity, 11), drawing.number_of(entity, 21)};
    return stroke;
  }
  const double degree = std::numbers::pi / 180, radius = drawing.number_of(entity, 40),
               begin = drawing.number_of(entity, 50), end = drawing.number_of(entity, 51);
  double angle = std::fmod(end - begin, 360);
  if (angle <= 0) angle += 360;
  stroke.from = at + radius * Vector2d(std::cos(degree * begin), std::sin(degree * begin));
  stroke.to = at + radius * Vector2d(std::cos(degree * end), std::sin(degree * end));
  stroke.edge.bulge = std::tan(0.25 * degree * angle);
  return stroke;
}

/// Refuses an entity that is seen from behind.
void check_dxf_extrusion(const DxfDrawing& drawing, const DxfEntity& entity) {
  const DxfGroup* const extrusion = entity.find(230);
  if (extrusion != nullptr && !(drawing.number_of(*extrusion) > 0.999))
    drawing.refuse(entity.line, fmt::format("{} lies in a plane of its own", entity.kind),
                   "pieces in the plane of x and y", "flatten the drawing before the export");
}

DxfPiece dxf_piece_of(const DxfDrawing& drawing, const std::string& name,
                      std::span<const DxfEntity> entities) {
  constexpr size_t kMostPoints = 20'000, kMostPolylines = 20'000;
  DxfPiece piece;
  for (size_t k = 0; k < entities.size();) {
    const DxfEntity& entity = entities[k];
    size_t used = 1;
    if (entity.kind == "POLYLINE" || entity.kind == "LWPOLYLINE") {
      check_dxf_extrusion(drawing, entity);
      DxfPiece::Polyline polyline;
      polyline.layer = entity.layer();
      polyline.drawn.file = drawing.file;
      polyline.drawn.line = entity.line;
      polyline.drawn.piece = name;
      if (entity.kind == "POLYLINE")
        used = read_dxf_polyline(drawing, entities.subspan(k), polyline);
      else
        read_dxf_light_polyline(drawing, entity, polyline);
      piece.polylines.push_back(std::move(polyline));
    } else if (entity.kind == "LINE" || entity.kind == "ARC") {
      check_dxf_extrusion(drawing, entity);
      piece.strokes.push_back(dxf_stroke(drawing, entity));
    } else if (entity.kind == "POINT" &&
               (entity.layer() == kDxfTurnLayer || entity.layer() == kDxfCurveLayer)) {
      (entity.layer() == kDxfTurnLayer ? piece.turn_points : piece.curve_points)
          .emplace_back(drawing.number_of(entity, 10), drawing.number_of(entity, 20));
    } else if (entity.kind == "SPLINE" || entity.kind == "ELLIPSE" || entity.kind == "CIRCLE" ||
               entity.kind == "INSERT") {
      piece.others.emplace(entity.kind);
    }
    if (piece.turn_points.size() + piece.curve_points.size() > kMostPoints ||
        piece.polylines.size() > kMostPolylines)
      drawing.refuse(entity.line, "too many points or polylines in one piece",
                     fmt::format("{} at most", kMostPoints));
    k += used;
  }
  return piece;
}

/// Joins lines and arcs end to end; all of them are needed.
DrawnOutline joined_dxf_strokes(const DxfDrawing& drawing, const std::string& name,
                                std::vector<DxfPiece::Stroke> strokes) {
  DrawnOutline drawn;
  drawn.file = drawing.file;
  drawn.line = strokes[0].line;
  drawn.piece = name;
  if (strokes.size() > kMostDrawnEdges)
    drawn.refuse(fmt::format("{} lines and arcs", strokes.size()),
                 fmt::format("{} at most", kMostDrawnEdges), "export it as a polyline");
  Eigen::AlignedBox2d box;
  for (const DxfPiece::Stroke& stroke : strokes) {
    box.extend(stroke.from);
    box.extend(stroke.to);
  }
  const double near = kClosingShare * box.sizes().maxCoeff();
  drawn.vertex = {strokes[0].from};
  drawn.add(strokes[0].edge, strokes[0].to);
  strokes.erase(strokes.begin());
  while (!strokes.empty()) {
    const Vector2d end = drawn.vertex.back();
    const auto gap = [&](const DxfPiece::Stroke& stroke) {
      return std::min((stroke.from - end).norm(), (stroke.to - end).norm());
    };
    const auto next = std::ranges::min_element(strokes, {}, gap);
    if (!(gap(*next) <= near))
      drawn.refuse(fmt::format("its lines and arcs do not join: none continues at ({:.6g}, {:.6g}),"
                               " the nearest one is {:.4g} away, in line {}",
                               end.x(), end.y(), gap(*next), next->line),
                   "lines and arcs that join into one loop",
                   "export the outline as a closed polyline on layer 1");
    if ((next->to - end).norm() < (next->from - end).norm()) {
      std::swap(next->from, next->to);
      next->edge.bulge = -next->edge.bulge;
    }
    drawn.add(next->edge, next->to);
    strokes.erase(next);
  }
  drawn.close();
  return drawn;
}

/// Returns the outline of a piece.
DrawnOutline dxf_boundary(const DxfDrawing& drawing, const std::string& name, DxfPiece piece) {
  const auto fail = [&](const std::string& problem, const std::string& remedy) {
    throw InputError(drawing.file, fmt::format("piece {}: {}", shown_text(name), problem),
                     "one closed outline, on layer 1 where there are other lines", remedy);
  };
  std::vector<DxfPiece::Polyline*> of_cut, of_all;
  const DxfPiece::Polyline* open = nullptr;
  for (DxfPiece::Polyline& polyline : piece.polylines) {
    const bool is_cut = polyline.layer == kDxfCutLayer;
    if (!polyline.is_closed && (open == nullptr || is_cut)) open = &polyline;
    if (polyline.is_closed) of_all.push_back(&polyline);
    if (polyline.is_closed && is_cut) of_cut.push_back(&polyline);
  }
  std::vector<DxfPiece::Stroke> strokes;
  std::ranges::copy_if(piece.strokes, std::back_inserter(strokes),
                       [](const auto& stroke) { return stroke.layer == kDxfCutLayer; });
  const bool has_open_cut = open != nullptr && open->layer == kDxfCutLayer;
  if (of_cut.empty() && strokes.empty() && !has_open_cut) {
    of_cut = of_all;
    if (of_all.empty()) strokes = piece.strokes;
  }
  if (of_cut.size() == 1) return std::move(of_cut[0]->drawn);
  if (of_cut.size() > 1)
    fail(fmt::format("{} closed polylines, in lines {} and {}", of_cut.size(),
                     of_cut[0]->drawn.line, of_cut[1]->drawn.line),
         "move all but the cut line to other layers");
  if (open != nullptr && strokes.empty()) {
    DrawnOutline drawn = open->drawn;
    if (!drawn.edges.empty()) drawn.close();  // which says how far it is from closed
    drawn.refuse("a polyline of one point", "a closed outline");
  }
  if (!strokes.empty()) return joined_dxf_strokes(drawing, name, std::move(strokes));
  std::string others;
  for (const std::string& kind : piece.others) others += (others.empty() ? "" : ", ") + kind;
  fail(others.empty() ? "no outline" : fmt::format("no outline, but {}", others),
       "export the outline as a closed polyline; `piece` names a block, `*` all outside blocks");
  return {};
}

/// Marks the vertices of which AAMA's points tell whether they are corners.
void mark_dxf_corners(const DxfPiece& piece, double unit_m, DrawnOutline& drawn) {
  if (piece.turn_points.empty() && piece.curve_points.empty()) return;
  const double near = kShortestDrawnEdge_m / unit_m;
  drawn.is_corner.resize(drawn.vertex.size());
  for (size_t k = 0; k < drawn.vertex.size(); ++k) {
    const auto is_here = [&](const Vector2d& point) {
      return (point - drawn.vertex[k]).norm() <= near;
    };
    if (std::ranges::any_of(piece.turn_points, is_here))
      drawn.is_corner[k] = true;
    else if (std::ranges::any_of(piece.curve_points, is_here))
      drawn.is_corner[k] = false;
  }
}

/// Finds the entities of a piece; lists the pieces there are where it is not among them.
std::span<const DxfEntity> dxf_entities_of(const DxfDrawing& drawing, const std::string& piece) {
  if (piece == "*") return drawing.entities;
  std::vector<std::string> names;
  for (const DxfBlock& block : drawing.blocks) {
    if (block.name == piece) return block.entities;
    if (!block.name.empty() && !block.name.starts_with("*")) names.push_back(block.name);
  }
  throw InputError(
      drawing.file, fmt::format("piece = {}", shown_text(piece)),
      names.empty() ? "`*`, for the drawing has no blocks" : known_pieces(piece, names),
      "`*` takes the outline outside all blocks");
}

PanelOutline parsed_dxf_outline(const std::filesystem::path& file, const std::string& piece,
                                std::optional<double> unit_m) {
  refuse_binary_dxf(file);
  DxfDrawing drawing;
  drawing.file = file.string();
  drawing.text = read_text(file, kMostDrawingBytes);
  read_dxf_groups(drawing);
  read_dxf_entities(drawing);
  const std::span<const DxfEntity> entities = dxf_entities_of(drawing, piece);
  const double scale_m = unit_m ? *unit_m : dxf_unit_m(drawing);
  const DxfPiece read = dxf_piece_of(drawing, piece, entities);
  DrawnOutline drawn = dxf_boundary(drawing, piece, read);
  mark_dxf_corners(read, scale_m, drawn);
  for (Vector2d& point : drawn.vertex) point *= scale_m;
  return panel_outline(std::move(drawn));
}

}  // namespace

PanelOutline read_dxf_outline(const std::filesystem::path& file, const std::string& piece,
                              std::optional<double> unit_m) {
  return reading(file, [&] { return parsed_dxf_outline(file, piece, unit_m); });
}

}  // namespace clothfit
