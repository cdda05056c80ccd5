#include "model/cloth/wording.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace clothfit {
namespace {

/// Nearer to a corner or an edge than this share of the cloth's size is on it.
constexpr double kOnEdge = 1e-3;

/// Names a held point's place.
std::string held_place(const Mesh& mesh, const Eigen::Vector2d& at_m) {
  const double s = at_m.x() / mesh.width_m, t = at_m.y() / mesh.height_m;
  const bool left = s<kOnEdge, right = s> 1 - kOnEdge;
  const bool top = t<kOnEdge, bottom = t> 1 - kOnEdge;
  const std::string row = top ? "top" : bottom ? "bottom" : "";
  const std::string column = left ? "left" : right ? "right" : "";
  if (!row.empty() && !column.empty()) return row + " " + column + " corner";
  if (!row.empty()) return row + " edge, " + millimetres(at_m.x()) + " from the left";
  if (!column.empty()) return column + " edge, " + millimetres(at_m.y()) + " from the top";
  return place_on_cloth(at_m);
}

/// Writes a vector with so many decimals. What rounds to nothing has no sign.
std::string in_brackets(const Eigen::Vector3d& v, int decimals) {
  const double smallest = 0.5 * std::pow(10, -decimals);
  const auto cell = [&](double x) {
    return fmt::format("{:.{}f}", std::abs(x) < smallest ? 0.0 : x, decimals);
  };
  return "(" + cell(v.x()) + ", " + cell(v.y()) + ", " + cell(v.z()) + ")";
}

}  // namespace

std::string rounded(double value) {
  constexpr int kDigits = 3, kMostDecimals = 9;
  if (value == 0) return "0";
  const std::string text = fmt::format("{:.{}e}", value, kDigits - 1);
  const int exponent = std::stoi(text.substr(text.find('e') + 1));
  return fmt::format("{:.{}f}", value, std::clamp(kDigits - 1 - exponent, 0, kMostDecimals));
}

std::string millimetres(double length_m) {
  return rounded(1e3 * length_m) + " mm";
}

std::string percent(double share, const char* more, const char* less) {
  return rounded(100 * std::abs(share)) + " % " + (share < 0 ? less : more);
}

std::string unit_vector(const Eigen::Vector3d& v) {
  return in_brackets(v.normalized(), 2);
}

std::string world_place(const Eigen::Vector3d& place_m) {
  return in_brackets(place_m, 3) + " m";
}

double turn_degrees(const Eigen::Vector3d& turn_rad) {
  return 2 * std::atan(0.5 * turn_rad.norm()) * 180 / std::numbers::pi;
}

std::string way_over_cloth(const Eigen::Vector2d& way_m) {
  constexpr double kSmall = 0.01;
  const double across_m = std::abs(way_m.x()), down_m = std::abs(way_m.y());
  std::string text;
  if (across_m > kSmall * down_m)
    text = millimetres(across_m) + (way_m.x() > 0 ? " to the right" : " to the left");
  if (down_m > kSmall * across_m)
    text += (text.empty() ? "" : " and ") + millimetres(down_m) + (way_m.y() > 0 ? " down" : " up");
  return text;
}

std::string place_on_cloth(const Eigen::Vector2d& at_m) {
  return millimetres(at_m.x()) + " from the left, " + millimetres(at_m.y()) + " from the top";
}

std::string at_held_point(const FittedEffect& found, double number) {
  const auto n = static_cast<size_t>(std::max(0L, std::lround(number)));
  if (n == 0) return "at every held point";
  const std::string point = "at held point " + std::to_string(n);
  if (n > found.held.size()) return point;
  return point + " (" + held_place(found.mesh, found.held[n - 1].at_m) + ")";
}

std::string listed(const std::vector<std::string>& texts) {
  std::string all;
  for (const std::string& text : texts)
    if (!text.empty()) all += (all.empty() ? "" : ", ") + text;
  return all;
}

}  // namespace clothfit
