#include "data/svg_outline.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <pugixml.hpp>
#include <vector>

#include "data/file_limits.h"
#include "data/input_error.h"
#include "data/reading.h"
#include "data/shown_text.h"
#include "data/svg_path.h"
#include "data/text_file.h"

namespace clothfit {
namespace {

using Eigen::Affine2d, Eigen::Vector2d;

constexpr double kSvgPixel_m = 0.0254 / 96;

/// An SVG file with its text, from which lines are counted.
struct SvgDrawing {
  std::string file, text;
  pugi::xml_document document;

  int line_of(pugi::xml_node node) const {
    const std::ptrdiff_t offset = std::clamp<std::ptrdiff_t>(
        node.offset_debug(), 0, static_cast<std::ptrdiff_t>(text.size()));
    return 1 + static_cast<int>(std::count(text.begin(), text.begin() + offset, '\n'));
  }
  [[noreturn]] void refuse(pugi::xml_node node, const std::string& problem,
                           const std::string& expected, const std::string& remedy = "") const {
    throw InputError(file, line_of(node), problem, expected, remedy);
  }
};

/// Returns the name of an element without its namespace.
std::string_view svg_element(pugi::xml_node node) {
  const std::string_view name = node.name();
  const size_t colon = name.rfind(':');
  return colon == std::string_view::npos ? name : name.substr(colon + 1);
}

bool is_svg_piece(pugi::xml_node node) {
  const std::string_view name = svg_element(node);
  return name == "path" || name == "polygon" || name == "polyline" || name == "rect";
}

void parse_svg(SvgDrawing& drawing) {
  const pugi::xml_parse_result result = drawing.document.load_buffer(
      drawing.text.data(), drawing.text.size(), pugi::parse_default, pugi::encoding_utf8);
  if (result.status == pugi::status_out_of_memory) throw std::bad_alloc();
  if (!result) {
    const std::ptrdiff_t offset = std::clamp<std::ptrdiff_t>(
        result.offset, 0, static_cast<std::ptrdiff_t>(drawing.text.size()));
    const auto lines = std::count(drawing.text.begin(), drawing.text.begin() + offset, '\n');
    throw InputError(drawing.file, 1 + static_cast<int>(lines),
                     fmt::format("its XML is damaged: {}", result.description()), "an SVG drawing");
  }
  if (svg_element(drawing.document.document_element()) != "svg")
    throw InputError(drawing.file,
                     fmt::format("its first element is `{}`",
                                 shown_text(drawing.document.document_element().name())),
                     "an SVG drawing, whose first element is svg");
}

/// Finds the element of a piece; lists the pieces there are where it is not among them.
pugi::xml_node svg_piece_of(const SvgDrawing& drawing, const std::string& piece) {
  const pugi::xml_node found = drawing.document.find_node(
      [&](pugi::xml_node node) { return piece == node.attribute("id").value(); });
  if (found && is_svg_piece(found)) return found;
  if (found)
    drawing.refuse(
        found, fmt::format("piece {} is a <{}>", shown_text(piece), shown_text(svg_element(found))),
        "a path, polygon, polyline or rect", "draw it as a path");
  std::vector<std::string> pieces;
  drawing.document.find_node([&](pugi::xml_node node) {
    if (is_svg_piece(node) && node.attribute("id"))
      pieces.emplace_back(node.attribute("id").value());
    return false;
  });
  throw InputError(
      drawing.file, fmt::format("piece = {}", shown_text(piece)),
      pieces.empty() ? "a path, polygon, polyline or rect with an id" : known_pieces(piece, pieces),
      "give the outline that id in the program that drew it");
}

/// Returns a length (m), 1/96 inch where it names no unit; nothing for a share of the window.
std::optional<double> svg_length_m(const SvgDrawing& drawing, pugi::xml_node node,
                                   const char* attribute) {
  const std::string_view text = node.attribute(attribute).value();
  SvgScanner scanner(text);
  if (scanner.at_end()) return std::nullopt;
  const std::optional<double> number = scanner.number();
  std::string_view unit = scanner.rest();
  unit = unit.substr(0, unit.find_last_not_of(" \t\n") + 1);
  if (number && unit == "%") return std::nullopt;
  const std::vector<std::pair<std::string_view, double>> units{
      {"", kSvgPixel_m}, {"px", kSvgPixel_m}, {"pt", 0.0254 / 72}, {"pc", 0.0254 / 6},
      {"mm", 0.001},     {"cm", 0.01},        {"in", 0.0254},      {"Q", 0.00025}};
  const auto found = std::ranges::find(units, unit, [](const auto& known) { return known.first; });
  if (!number || found == units.end())
    drawing.refuse(node, fmt::format("{} = {}", attribute, shown_text(text)),
                   "a number, alone or with px, pt, pc, mm, cm, in or Q");
  return *number * found->second;
}

/// Returns the length of a user unit (m).
double svg_unit_m(const SvgDrawing& drawing) {
  const pugi::xml_node root = drawing.document.document_element();
  if (!root.attribute("viewBox")) return kSvgPixel_m;
  SvgScanner scanner(root.attribute("viewBox").value());
  std::array<double, 4> box{};
  for (double& number : box) {
    const std::optional<double> read = scanner.number();
    if (!read) drawing.refuse(root, "a viewBox without four numbers", "viewBox = x y width height");
    number = *read;
  }
  const std::optional<double> width_m = svg_length_m(drawing, root, "width"),
                              height_m = svg_length_m(drawing, root, "height");
  const double across_m = width_m.value_or(0) / box[2], up_m = height_m.value_or(0) / box[3];
  if ((width_m && !(across_m > 0 && std::isfinite(across_m))) ||
      (height_m && !(up_m > 0 && std::isfinite(up_m))))
    drawing.refuse(root, "a viewBox, width or height without extent", "sizes above 0");
  if (width_m && height_m && std::abs(across_m - up_m) > 1e-3 * across_m)
    drawing.refuse(root,
                   fmt::format("a user unit is {:.4g} mm by the width and {:.4g} mm by the height",
                               1e3 * across_m, 1e3 * up_m),
                   "a width and a height in the proportions of the viewBox",
                   "give the unit beside the piece: `unit: mm`");
  return width_m ? across_m : height_m ? up_m : kSvgPixel_m;
}

/// Returns one of the functions of an attribute `transform`; nothing where there is no such one.
std::optional<Affine2d> svg_transform_of(std::string_view name, const std::vector<double>& n) {
  Affine2d result = Affine2d::Identity();
  const double degree = std::numbers::pi / 180;
  const size_t count = n.size();
  if (name == "translate" && (count == 1 || count == 2)) {
    result.translate(Vector2d(n[0], count == 2 ? n[1] : 0));
  } else if (name == "scale" && (count == 1 || count == 2)) {
    result.scale(Vector2d(n[0], count == 2 ? n[1] : n[0]));
  } else if (name == "rotate" && (count == 1 || count == 3)) {
    const Vector2d about = count == 3 ? Vector2d(n[1], n[2]) : Vector2d(0, 0);
    result.translate(about).rotate(degree * n[0]).translate(-about);
  } else if (name == "skewX" && count == 1) {
    result.matrix()(0, 1) = std::tan(degree * n[0]);
  } else if (name == "skewY" && count == 1) {
    result.matrix()(1, 0) = std::tan(degree * n[0]);
  } else if (name == "matrix" && count == 6) {
    result.matrix().topRows<2>() << n[0], n[2], n[4], n[1], n[3], n[5];
  } else {
    return std::nullopt;
  }
  return result;
}

/// Says whether an attribute `style` declares a transform.
bool has_svg_style_transform(std::string_view style) {
  SvgScanner scanner(style);
  while (!scanner.at_end()) {
    SvgScanner declaration(scanner.up_to(';'));
    if (declaration.at_end()) continue;
    const std::string_view name = declaration.up_to(':');
    if (name.substr(0, name.find_last_not_of(" \t\n") + 1) == "transform") return true;
  }
  return false;
}

/// Returns the transform of one element.
Affine2d svg_own_transform(const SvgDrawing& drawing, pugi::xml_node node) {
  if (has_svg_style_transform(node.attribute("style").value()))
    drawing.refuse(node, "a transform in an attribute style", "an attribute transform",
                   "save it as plain SVG, without styles");
  const std::string_view text = node.attribute("transform").value();
  SvgScanner scanner(text);
  Affine2d whole = Affine2d::Identity();
  while (!scanner.at_end()) {
    std::string_view name = scanner.up_to('(');
    name = name.substr(0, name.find_last_not_of(" \t\n") + 1);
    SvgScanner inside(scanner.up_to(')'));
    std::vector<double> numbers;
    while (numbers.size() <= 6 && inside.at_number()) {
      const std::optional<double> number = inside.number();
      if (!number) break;
      numbers.push_back(*number);
    }
    const std::optional<Affine2d> next = svg_transform_of(name, numbers);
    if (!next || !inside.at_end())
      drawing.refuse(node, fmt::format("transform = {}", shown_text(text)),
                     "translate, scale, rotate, skewX, skewY or matrix with its numbers");
    whole = whole * *next;
  }
  return whole;
}

/// Returns the transform from an element's coordinates to the drawing's user units.
Affine2d svg_transform(const SvgDrawing& drawing, pugi::xml_node element) {
  Affine2d whole = Affine2d::Identity();
  for (pugi::xml_node node = element; node && node.type() == pugi::node_element;
       node = node.parent()) {
    if (svg_element(node) == "svg" && node != drawing.document.document_element())
      drawing.refuse(node, "a drawing within the drawing", "pieces of one svg element",
                     "ungroup it in the program that drew it");
    whole = svg_own_transform(drawing, node) * whole;
  }
  const double determinant = whole.linear().determinant();
  if (!whole.matrix().allFinite() ||
      !(std::abs(determinant) > 1e-12 * whole.linear().squaredNorm()))
    drawing.refuse(element, "its transform leaves no area", "a transform that can be undone");
  return whole;
}

/// Says whether a linear map takes circles to circles.
bool keeps_circles(const Eigen::Matrix2d& map) {
  const Eigen::Matrix2d square = map.transpose() * map;
  return (square - 0.5 * square.trace() * Eigen::Matrix2d::Identity()).norm() <
         1e-9 * square.trace();
}

void draw_svg_polygon(const SvgDrawing& drawing, pugi::xml_node node, DrawnOutline& drawn) {
  SvgScanner scanner(node.attribute("points").value());
  while (!scanner.at_end()) {
    const std::optional<double> x = scanner.number(), y = scanner.number();
    if (!x || !y)
      drawing.refuse(node, "points that are no pairs of numbers", "points = x,y x,y ...");
    if (drawn.vertex.empty())
      drawn.vertex.emplace_back(*x, *y);
    else
      drawn.add({}, {*x, *y});
  }
  if (drawn.vertex.empty()) drawing.refuse(node, "a piece without points", "points = x,y x,y ...");
  if (svg_element(node) == "polygon" && drawn.vertex.back() != drawn.vertex.front())
    drawn.add({}, drawn.vertex.front());
  drawn.close();
}

/// Draws a rectangle, its corners perhaps rounded, from its upper left corner to the right.
void draw_svg_rect(const SvgDrawing& drawing, pugi::xml_node node, bool keep_circles,
                   DrawnOutline& drawn) {
  const auto length = [&](const char* attribute) {
    const std::optional<double> length_m = svg_length_m(drawing, node, attribute);
    if (!length_m && node.attribute(attribute))
      drawing.refuse(node, fmt::format("{} as a share of the window", attribute), "a length");
    return length_m ? std::optional(*length_m / kSvgPixel_m) : std::nullopt;
  };
  const double x = length("x").value_or(0), y = length("y").value_or(0),
               width = length("width").value_or(0), height = length("height").value_or(0);
  if (!(width > 0 && height > 0))
    drawing.refuse(node, "a rect without area", "width and height > 0");
  const std::optional<double> rx = length("rx"), ry = length("ry");
  const double across = std::min(0.5 * width, std::max(0.0, rx ? *rx : ry.value_or(0))),
               up = std::min(0.5 * height, std::max(0.0, ry ? *ry : rx.value_or(0)));
  if (across == 0 || up == 0)
    return draw_svg_path(fmt::format("M{} {}h{}v{}h{}z", x, y, width, height, -width), keep_circles,
                         drawn);
  draw_svg_path(
      fmt::format("M{} {}h{}a{} {} 0 0 1 {} {}v{}a{} {} 0 0 1 {} {}h{}a{} {} 0 0 1 {} {}v{}"
                  "a{} {} 0 0 1 {} {}z",
                  x + across, y, width - 2 * across, across, up, across, up, height - 2 * up,
                  across, up, -across, up, 2 * across - width, across, up, -across, -up,
                  2 * up - height, across, up, across, -up),
      keep_circles, drawn);
}

PanelOutline parsed_svg_outline(const std::filesystem::path& file, const std::string& piece,
                                std::optional<double> unit_m) {
  SvgDrawing drawing{
      .file = file.string(), .text = read_text(file, kMostDrawingBytes), .document = {}};
  parse_svg(drawing);
  const pugi::xml_node element = svg_piece_of(drawing, piece);
  // Its y axis points down.
  const double scale_m = unit_m ? *unit_m : svg_unit_m(drawing);
  const Affine2d metres_from_element =
      Eigen::Scaling(scale_m, -scale_m) * svg_transform(drawing, element);
  const bool keep_circles = keeps_circles(metres_from_element.linear());
  DrawnOutline drawn;
  drawn.file = drawing.file;
  drawn.line = drawing.line_of(element);
  drawn.piece = piece;
  if (svg_element(element) == "path")
    draw_svg_path(element.attribute("d").value(), keep_circles, drawn);
  else if (svg_element(element) == "rect")
    draw_svg_rect(drawing, element, keep_circles, drawn);
  else
    draw_svg_polygon(drawing, element, drawn);
  const bool mirrors = metres_from_element.linear().determinant() < 0;
  for (Vector2d& point : drawn.vertex) point = metres_from_element * point;
  for (PatternEdge& edge : drawn.edges) {
    if (mirrors) edge.bulge = -edge.bulge;
    for (Vector2d& point : edge.control_m) point = metres_from_element * point;
  }
  return panel_outline(std::move(drawn));
}

}  // namespace

PanelOutline read_svg_outline(const std::filesystem::path& file, const std::string& piece,
                              std::optional<double> unit_m) {
  return reading(file, [&] { return parsed_svg_outline(file, piece, unit_m); });
}

}  // namespace clothfit
