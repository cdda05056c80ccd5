#include "data/svg_path.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numbers>

#include "data/number_text.h"
#include "data/shown_text.h"

namespace clothfit {
namespace {

using Eigen::Vector2d;

bool is_svg_digit(char c) {
  return c >= '0' && c <= '9';
}

/// Returns how many characters of a text are a number; 0: none are.
size_t svg_number_size(std::string_view text) {
  const auto digits_from = [&](size_t at) {
    size_t end = at;
    while (end < text.size() && is_svg_digit(text[end])) ++end;
    return end - at;
  };
  size_t end = !text.empty() && (text[0] == '+' || text[0] == '-') ? 1 : 0;
  size_t digits = digits_from(end);
  end += digits;
  if (end < text.size() && text[end] == '.') {
    const size_t decimals = digits_from(end + 1);
    digits += decimals;
    if (digits > 0) end += 1 + decimals;
  }
  if (digits == 0) return 0;
  if (end < text.size() && (text[end] == 'e' || text[end] == 'E')) {
    size_t exponent = end + 1;
    if (exponent < text.size() && (text[exponent] == '+' || text[exponent] == '-')) ++exponent;
    if (const size_t count = digits_from(exponent); count > 0) end = exponent + count;
  }
  return end;
}

/// An arc of an ellipse by its middle.
struct EllipseArc {
  Vector2d centre, radius;
  Eigen::Rotation2Dd turn{0};
  double begin_rad = 0, sweep_rad = 0;

  Vector2d at(double angle_rad) const {
    return centre +
           turn * Vector2d(radius.x() * std::cos(angle_rad), radius.y() * std::sin(angle_rad));
  }
  Vector2d derivative(double angle_rad) const {
    return turn * Vector2d(-radius.x() * std::sin(angle_rad), radius.y() * std::cos(angle_rad));
  }
};

/// Finds the middle of an arc by its ends. Radii that do not reach both are enlarged.
///
/// Source: SVG 2, section B.2.4.
EllipseArc ellipse_arc(const Vector2d& from, const Vector2d& to, Vector2d radius, double turn_deg,
                       bool is_large, bool is_positive) {
  EllipseArc arc;
  arc.turn = Eigen::Rotation2Dd(turn_deg * std::numbers::pi / 180);
  const Vector2d half = (arc.turn.inverse() * (0.5 * (from - to)).eval()).cwiseQuotient(radius);
  const double square = half.squaredNorm();
  if (square > 1) radius *= std::sqrt(square);
  Vector2d centre = Vector2d::Zero();  // on the unit circle's plane
  if (square < 1) {
    centre = std::sqrt((1 - square) / square) * Vector2d(half.y(), -half.x());
    if (is_large == is_positive) centre = -centre;
  }
  const double shrink = square > 1 ? 1 / std::sqrt(square) : 1;
  const Vector2d begin = shrink * half - centre, end = -shrink * half - centre;
  arc.radius = radius;
  arc.centre = 0.5 * (from + to) + arc.turn * centre.cwiseProduct(radius);
  arc.begin_rad = std::atan2(begin.y(), begin.x());
  arc.sweep_rad = std::atan2(begin.x() * end.y() - begin.y() * end.x(), begin.dot(end));
  if (is_positive && arc.sweep_rad < 0) arc.sweep_rad += 2 * std::numbers::pi;
  if (!is_positive && arc.sweep_rad > 0) arc.sweep_rad -= 2 * std::numbers::pi;
  return arc;
}

/// Draws path data; coordinates are absolute as soon as they are read.
class SvgPathPen {
 public:
  SvgPathPen(std::string_view data, bool keep_circles, DrawnOutline& drawn)
      : scanner_(data), keep_circles_(keep_circles), drawn_(drawn) {}

  void draw() {
    while (!scanner_.at_end()) {
      const std::string_view rest = scanner_.rest();
      const char letter = scanner_.letter();
      if (std::string_view("MmLlHhVvCcSsQqTtAaZz").find(letter) == std::string_view::npos)
        refuse(rest, "one of the commands M L H V C S Q T A Z");
      if (drawn_.vertex.empty() && letter != 'M' && letter != 'm')
        refuse(rest, "M, which begins a path");
      draw_command(letter);
    }
    if (drawn_.vertex.empty())
      drawn_.refuse("a path without data", "a closed outline in the attribute d");
    drawn_.close();
  }

 private:
  [[noreturn]] void refuse(std::string_view rest, const std::string& expected) const {
    drawn_.refuse(fmt::format("`{}` in the data of its path", shown_text(rest.substr(0, 20))),
                  expected);
  }

  double number() {
    const std::optional<double> number = scanner_.number();
    if (!number) refuse(scanner_.rest(), "a number");
    return *number;
  }

  bool flag() {
    const std::optional<bool> flag = scanner_.flag();
    if (!flag) refuse(scanner_.rest(), "a flag of an arc, 0 or 1");
    return *flag;
  }

  Vector2d point(bool relative) {
    const double x = number(), y = number();
    return relative ? Vector2d(at_ + Vector2d(x, y)) : Vector2d(x, y);
  }

  void draw_command(char letter) {
    const bool relative = std::islower(static_cast<unsigned char>(letter)) != 0;
    char command = static_cast<char>(std::toupper(static_cast<unsigned char>(letter)));
    if (command == 'Z') {
      if (drawn_.vertex.back() != drawn_.vertex.front()) add({}, drawn_.vertex.front());
      at_ = drawn_.vertex.front();
      is_closed_ = true;
      last_command_ = 'Z';
      return;
    }
    do {
      if (command == 'M') {
        move(point(relative));
        command = 'L';  // what follows the first pair
      } else {
        draw_segment(command, relative);
      }
    } while (scanner_.at_number());
  }

  void move(const Vector2d& to) {
    at_ = to;
    if (drawn_.edges.empty())
      drawn_.vertex = {to};
    else
      is_closed_ = true;  // only a lone M may follow
    last_command_ = 'M';
  }

  void add(const PatternEdge& edge, Vector2d to) {
    if (is_closed_)
      drawn_.refuse("its path has several subpaths", "one closed outline",
                    "divide it into paths with ids of their own");
    drawn_.add(edge, to);
    at_ = to;
  }

  void draw_segment(char command, bool relative) {
    const Vector2d begin = at_;
    PatternEdge edge;
    // The control point from which S and T continue is mirrored.
    const bool continues = (command == 'S' && (last_command_ == 'C' || last_command_ == 'S')) ||
                           (command == 'T' && (last_command_ == 'Q' || last_command_ == 'T'));
    const Vector2d mirrored = continues ? Vector2d(2 * begin - last_control_) : begin;
    switch (command) {
      case 'H':
        add(edge, {number() + (relative ? begin.x() : 0), begin.y()});
        break;
      case 'V':
        add(edge, {begin.x(), number() + (relative ? begin.y() : 0)});
        break;
      case 'A':
        draw_arc(relative);
        break;
      default: {
        if (command == 'S' || command == 'T') edge.control_m.push_back(mirrored);
        if (command == 'C') edge.control_m.push_back(point(relative));
        if (command != 'L' && command != 'T') edge.control_m.push_back(point(relative));
        if (!edge.control_m.empty()) last_control_ = edge.control_m.back();
        add(edge, point(relative));
      }
    }
    last_command_ = command;
  }

  void draw_arc(bool relative) {
    Vector2d radius;
    radius.x() = std::abs(number());
    radius.y() = std::abs(number());
    const double turn_deg = number();
    const bool is_large = flag(), is_positive = flag();
    const Vector2d begin = at_, end = point(relative);
    if (begin == end) return;
    if (radius.minCoeff() == 0) return add({}, end);
    const EllipseArc arc = ellipse_arc(begin, end, radius, turn_deg, is_large, is_positive);
    if (!std::isfinite(arc.sweep_rad)) drawn_.refuse("an arc without a middle", "radii in reason");
    PatternEdge edge;
    if (keep_circles_ && std::abs(radius.x() - radius.y()) <= 1e-9 * radius.x()) {
      edge.bulge = std::tan(0.25 * arc.sweep_rad);
      return add(edge, end);
    }
    const int parts =
        std::max(1, static_cast<int>(std::ceil(std::abs(arc.sweep_rad) / (0.5 * kPi) - 1e-9)));
    const double part_rad = arc.sweep_rad / parts, reach = 4.0 / 3 * std::tan(0.25 * part_rad);
    for (int k = 0; k < parts; ++k) {
      const double from_rad = arc.begin_rad + k * part_rad, to_rad = from_rad + part_rad;
      const Vector2d from = at_, to = k + 1 == parts ? end : arc.at(to_rad);
      edge.control_m = {from + reach * arc.derivative(from_rad),
                        to - reach * arc.derivative(to_rad)};
      add(edge, to);
    }
  }

  static constexpr double kPi = std::numbers::pi;

  SvgScanner scanner_;
  bool keep_circles_;
  DrawnOutline& drawn_;
  Vector2d at_ = Vector2d::Zero(), last_control_ = Vector2d::Zero();
  char last_command_ = 0;
  bool is_closed_ = false;
};

}  // namespace

void SvgScanner::skip_separators() {
  const size_t begin = text_.find_first_not_of(" \t\n\r\f,");
  text_.remove_prefix(std::min(begin, text_.size()));
}

bool SvgScanner::at_end() {
  skip_separators();
  return text_.empty();
}

char SvgScanner::letter() {
  if (at_end()) return 0;
  const char letter = text_[0];
  text_.remove_prefix(1);
  return letter;
}

bool SvgScanner::at_number() {
  skip_separators();
  return svg_number_size(text_) > 0;
}

std::optional<double> SvgScanner::number() {
  skip_separators();
  const size_t size = svg_number_size(text_);
  if (size == 0) return std::nullopt;
  const std::optional<double> number = parse_number(text_.substr(0, size));
  if (number) text_.remove_prefix(size);
  return number;
}

std::optional<bool> SvgScanner::flag() {
  skip_separators();
  if (text_.empty() || (text_[0] != '0' && text_[0] != '1')) return std::nullopt;
  return letter() == '1';
}

std::string_view SvgScanner::up_to(char end) {
  const size_t at = std::min(text_.find(end), text_.size());
  const std::string_view before = text_.substr(0, at);
  text_.remove_prefix(std::min(at + 1, text_.size()));
  return before;
}

void draw_svg_path(std::string_view data, bool keep_circles, DrawnOutline& drawn) {
  SvgPathPen(data, keep_circles, drawn).draw();
}

}  // namespace clothfit
