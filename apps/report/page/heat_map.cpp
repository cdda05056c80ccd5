#include "apps/report/page/heat_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "apps/report/page/colour_map.h"
#include "apps/report/page/html.h"
#include "apps/report/page/svg.h"
#include "apps/report/page/svg_parts.h"

namespace clothfit {
namespace {

constexpr double kTop = 44, kHeight = 250, kBottom = kTop + kHeight;

bool shows(double value) {
  return std::isfinite(value) && value > 0;
}

/// Returns borders of the cells of `places`: halfway to neighbours, and as far beyond the ends.
std::vector<double> borders(const std::vector<double>& places, bool logarithmic) {
  const auto at = [&](size_t n) { return logarithmic ? std::log(places[n]) : places[n]; };
  const size_t count = places.size();
  const double step = count > 1 ? (at(count - 1) - at(0)) / static_cast<double>(count - 1) : 1;
  std::vector<double> edges;
  for (size_t n = 0; n <= count; ++n) {
    const double edge = at(0) + step * (static_cast<double>(n) - 0.5);
    edges.push_back(logarithmic ? std::exp(edge) : edge);
  }
  return edges;
}

std::string mark_at(double x, double y, bool filled, const std::string& label) {
  return fmt::format(
      "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{}\" fill=\"{}\" stroke=\"#fff\" "
      "stroke-width=\"2\"><title>{}</title></circle>\n",
      x, y, filled ? 4 : 7, filled ? "#d1495b" : "none", escape_xml(label));
}

std::string colour_bar(double left, const Axis& bar) {
  constexpr int kSteps = 48;
  std::string svg;
  for (int step = 0; step < kSteps; ++step)
    svg += fmt::format(
        "<rect x=\"{:.1f}\" y=\"{:.2f}\" width=\"12\" height=\"{:.2f}\" fill=\"{}\"/>\n", left,
        kBottom - kHeight * (step + 1.0) / kSteps, kHeight / kSteps + 0.4,
        viridis((step + 0.5) / kSteps));
  std::vector<double> ticks = log_ticks(bar.low, bar.high);
  const size_t stride = ticks.size() / 7 + 1;
  for (size_t n = 0; n < ticks.size(); n += stride) {
    svg += line_at(left + 12, bar(ticks[n]), left + 16, bar(ticks[n]), {kInk, "", 1});
    svg += text_at(left + 19, bar(ticks[n]) + 4, fmt::format("{:.0e}", ticks[n]), "start", kSoft);
  }
  return svg;
}

std::string panel(const HeatMaps& maps, const HeatMap& map, double left, double right) {
  double low = std::numeric_limits<double>::infinity();
  double high = 0;
  for (const double value : map.value.reshaped()) {
    if (!shows(value)) continue;
    low = std::min(low, std::max(value, maps.smallest));
    high = std::max(high, value);
  }
  if (!(high > low)) low = high > 0 ? high / 10 : 0.1, high = 10 * low;

  const std::vector<double> x_edges = borders(map.x, maps.log_x);
  const std::vector<double> y_edges = borders(map.y, maps.log_y);
  const Axis x_axis{x_edges.front(), x_edges.back(), left, right, maps.log_x};
  const Axis y_axis{y_edges.front(), y_edges.back(), kBottom, kTop, maps.log_y};
  std::string svg = text_at(left, kTop - 24, map.title);
  svg += text_at(right + 46, kTop - 8, maps.value_label, "end", kSoft);
  svg += "<g shape-rendering=\"crispEdges\">\n";
  for (size_t i = 0; i < map.x.size(); ++i)
    for (size_t j = 0; j < map.y.size(); ++j) {
      const double value = map.value(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
      if (!shows(value)) continue;
      const double fraction = std::log(std::max(value, low) / low) / std::log(high / low);
      svg += fmt::format(
          "<rect x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" fill=\"{}\"/>\n",
          x_axis(x_edges[i]), y_axis(y_edges[j + 1]), x_axis(x_edges[i + 1]) - x_axis(x_edges[i]),
          y_axis(y_edges[j]) - y_axis(y_edges[j + 1]), viridis(fraction));
    }
  svg += "</g>\n";
  const auto ticks = [](const Axis& axis, int wanted) {
    return axis.logarithmic ? log_ticks(axis.low, axis.high)
                            : nice_ticks(axis.low, axis.high, wanted);
  };
  for (const double tick : ticks(x_axis, 5)) {
    svg += line_at(x_axis(tick), kBottom, x_axis(tick), kBottom + 5, {kInk, "", 1});
    svg += text_at(x_axis(tick), kBottom + 18, tick_text(tick), "middle", kSoft);
  }
  for (const double tick : ticks(y_axis, 5)) {
    svg += line_at(left - 5, y_axis(tick), left, y_axis(tick), {kInk, "", 1});
    svg += text_at(left - 8, y_axis(tick) + 4, tick_text(tick), "end", kSoft);
  }
  for (const HeatMark& mark : map.marks)
    svg += mark_at(x_axis(mark.x), y_axis(mark.y), mark.filled, mark.label);
  svg += text_at(0.5 * (left + right), kBottom + 36, maps.x_label, "middle");
  return svg + colour_bar(right + 10, {low, high, kBottom, kTop, true});
}

}  // namespace

std::string heat_maps(const HeatMaps& maps) {
  constexpr double kWidth = 800, kLeft = 52, kBarRoom = 62, kGap = 42;
  const double panels = std::max<double>(1, static_cast<double>(maps.maps.size()));
  const double width = (kWidth - kLeft - kGap * (panels - 1)) / panels - kBarRoom;
  std::string body = upward_text_at(13, 0.5 * (kTop + kBottom), maps.y_label);
  double left = kLeft;
  for (const HeatMap& map : maps.maps) {
    body += panel(maps, map, left, left + width);
    left += width + kBarRoom + kGap;
  }
  return open_svg(kWidth, kBottom + 44, maps.title, maps.description) + body + "</svg>\n";
}

}  // namespace clothfit
