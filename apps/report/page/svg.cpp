#include "apps/report/page/svg.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "apps/report/page/colour_map.h"
#include "apps/report/page/html.h"
#include "apps/report/page/svg_parts.h"
#include "apps/terminal/number_text.h"

namespace clothfit {
namespace {

struct Extent {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  bool empty() const { return low > high; }
};

std::string polylines(const Series& series, const Axis& x_axis, const Axis& y_axis) {
  std::string svg;
  std::string points;
  int count = 0;
  const std::string dashes = series.style.dashes.empty()
                                 ? ""
                                 : fmt::format(" stroke-dasharray=\"{}\"", series.style.dashes);
  const auto finish = [&] {
    if (count > 1) {
      svg += fmt::format(
          "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\" "
          "stroke-linejoin=\"round\"{}/>\n",
          points, series.style.colour, series.style.width_px, dashes);
    } else if (count == 1) {
      const size_t comma = points.find(',');
      svg += fmt::format("<circle cx=\"{}\" cy=\"{}\" r=\"{}\" fill=\"{}\"/>\n",
                         points.substr(0, comma), points.substr(comma + 1), series.style.width_px,
                         series.style.colour);
    }
    points.clear();
    count = 0;
  };
  for (size_t i = 0; i < std::min(series.x.size(), series.y.size()); ++i) {
    if (!x_axis.shows(series.x[i]) || !y_axis.shows(series.y[i])) {
      finish();
      continue;
    }
    points += fmt::format("{}{:.1f},{:.1f}", count == 0 ? "" : " ", x_axis(series.x[i]),
                          y_axis(series.y[i]));
    ++count;
  }
  finish();
  return svg;
}

/// Estimates the room that a text takes, well enough to lay out a legend.
double text_width(const std::string& text) {
  return 6.4 * static_cast<double>(text.size());
}

/// Writes names of the lines in rows below a plot and sets `height` to the room taken.
std::string legend(const std::vector<Series>& series, double left, double right, double top,
                   double& height) {
  std::string svg;
  double x = left;
  double y = top;
  for (const Series& one : series) {
    const double width = 34 + text_width(one.label) + 18;
    if (x > left && x + width > right) {
      x = left;
      y += 18;
    }
    svg += line_at(x, y - 4, x + 28, y - 4, one.style);
    svg += text_at(x + 34, y, one.label);
    x += width;
  }
  height = y - top + 18;
  return svg;
}

/// Returns the median distance from a value's place to its nearest neighbour; infinite for fewer
/// than two.
double usual_spacing(const std::vector<ClothValue>& values) {
  std::vector<double> nearest(values.size(), std::numeric_limits<double>::infinity());
  for (size_t i = 0; i < values.size(); ++i) {
    for (size_t j = 0; j < values.size(); ++j) {
      if (i == j) continue;
      const double distance = std::hypot(values[i].s - values[j].s, values[i].t - values[j].t);
      nearest[i] = std::min(nearest[i], distance);
    }
  }
  if (nearest.empty()) return std::numeric_limits<double>::infinity();
  const auto middle = nearest.begin() + static_cast<std::ptrdiff_t>(nearest.size() / 2);
  std::nth_element(nearest.begin(), middle, nearest.end());
  return *middle;
}

}  // namespace

std::vector<double> nice_ticks(double low, double high, int wanted) {
  if (!(high > low) || wanted < 1) return {low};
  const double rough = (high - low) / wanted;
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  const double fraction = rough / power;
  const double step = power * (fraction <= 1.5   ? 1
                               : fraction <= 3.5 ? 2
                               : fraction <= 7.5 ? 5
                                                 : 10);
  std::vector<double> ticks;
  const double first = std::ceil(low / step - 1e-9);
  for (double k = first; k * step <= high + 1e-9 * step; ++k)
    ticks.push_back(k == 0 ? 0 : k * step);
  return ticks;
}

std::vector<double> log_ticks(double low, double high) {
  const auto inside = [&](const std::vector<double>& factors) {
    std::vector<double> ticks;
    for (double power = std::pow(10.0, std::floor(std::log10(low))); power <= high; power *= 10) {
      for (const double factor : factors) {
        const double tick = power * factor;
        if (tick >= low * (1 - 1e-9) && tick <= high * (1 + 1e-9)) ticks.push_back(tick);
      }
    }
    return ticks;
  };
  const std::vector<double> decades = inside({1});
  return decades.size() >= 3 ? decades : inside({1, 2, 5});
}

std::string line_plot(const LinePlot& plot) {
  constexpr double kWidth = 800, kPlotHeight = 300, kLeft = 64, kRight = 786, kTop = 22;
  constexpr double kBottom = kTop + kPlotHeight;

  Extent x_extent;
  Extent y_extent;
  const Axis any{.logarithmic = plot.log_y};
  for (const Series& series : plot.series) {
    for (size_t i = 0; i < std::min(series.x.size(), series.y.size()); ++i) {
      if (!std::isfinite(series.x[i]) || !any.shows(series.y[i])) continue;
      x_extent.add(series.x[i]);
      y_extent.add(series.y[i]);
    }
  }
  if (plot.level && any.shows(plot.level->value)) y_extent.add(plot.level->value);
  if (x_extent.empty()) x_extent = {0, 1};
  if (y_extent.empty()) y_extent = {plot.log_y ? 0.1 : 0, 1};
  if (x_extent.high == x_extent.low) x_extent.high += 1;
  if (plot.log_y) {
    y_extent = {y_extent.low / 1.3, y_extent.high * 1.3};
  } else {
    y_extent.low = std::min(0.0, y_extent.low);
    y_extent.high += y_extent.high > y_extent.low ? 0.05 * (y_extent.high - y_extent.low) : 1.0;
  }
  const Axis x_axis{x_extent.low, x_extent.high, kLeft, kRight, false};
  const Axis y_axis{y_extent.low, y_extent.high, kBottom, kTop, plot.log_y};

  std::string body;
  if (plot.band) {
    const double from = x_axis(std::max(plot.band->from, x_extent.low));
    const double to = x_axis(std::min(plot.band->to, x_extent.high));
    if (to > from) {
      body += fmt::format(
          "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"#f0f2f5\"/>\n",
          from, kTop, to - from, kPlotHeight);
      body += line_at(from, kTop, from, kBottom, {kSoft, "2 3", 1});
      body += text_at(0.5 * (from + to), kTop - 7, plot.band->label, "middle", kSoft);
    }
  }
  for (const double tick : plot.log_y ? log_ticks(y_extent.low, y_extent.high)
                                      : nice_ticks(y_extent.low, y_extent.high, 6)) {
    body += line_at(kLeft, y_axis(tick), kRight, y_axis(tick), {kGrid, "", 1});
    body += text_at(kLeft - 8, y_axis(tick) + 4, tick_text(tick), "end", kSoft);
  }
  for (const double tick : nice_ticks(x_extent.low, x_extent.high, 8)) {
    body += line_at(x_axis(tick), kBottom, x_axis(tick), kBottom + 5, {kInk, "", 1});
    body += text_at(x_axis(tick), kBottom + 19, tick_text(tick), "middle", kSoft);
  }
  body += line_at(kLeft, kBottom, kRight, kBottom, {kInk, "", 1});
  if (plot.level && y_axis.shows(plot.level->value)) {
    const double y = y_axis(plot.level->value);
    body += line_at(kLeft, y, kRight, y, {kSoft, "1 3", 1.4});
    body += text_at(kLeft + 6, y - 5, plot.level->label, "start", kSoft);
  }
  // The plot is about the first series, which is drawn last, on top.
  for (auto series = plot.series.rbegin(); series != plot.series.rend(); ++series)
    body += polylines(*series, x_axis, y_axis);
  body += text_at(0.5 * (kLeft + kRight), kBottom + 38, plot.x_label, "middle");
  body += fmt::format(
      "<text transform=\"translate(14 {:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
      0.5 * (kTop + kBottom), escape_xml(plot.y_label));

  double height = kBottom + 46;
  if (plot.series.size() > 1) {
    double legend_height = 0;
    body += legend(plot.series, kLeft, kRight, height + 16, legend_height);
    height += legend_height + 4;
  }
  return open_svg(kWidth, height, plot.title, plot.description) + body + "</svg>\n";
}

std::string cloth_maps(const ClothMaps& maps) {
  constexpr double kWidth = 800, kTop = 48, kMargin = 40, kGap = 56, kBarRoom = 100;
  const double panels = std::max<double>(1, static_cast<double>(maps.maps.size()));
  const double room = (kWidth - kMargin - kBarRoom - kGap * (panels - 1)) / panels;
  // Panels keep the cloth's proportions inside room x 300.
  const double scale = std::min(room / maps.width_m, 300 / maps.height_m);
  const double panel_width = scale * maps.width_m;
  const double panel_height = scale * maps.height_m;

  double highest = maps.largest;
  double spacing_m = std::numeric_limits<double>::infinity();
  for (const ClothMap& map : maps.maps) {
    spacing_m = std::min(spacing_m, usual_spacing(map.values));
    for (const ClothValue& value : map.values)
      if (std::isfinite(value.value) && maps.largest == 0) highest = std::max(highest, value.value);
  }
  if (highest == 0) highest = 1;
  // Dots are as large as neighbours allow without touching.
  const double radius = std::clamp(0.47 * scale * spacing_m, 1.5, 12.0);

  std::string body;
  double left = kMargin;
  for (const ClothMap& map : maps.maps) {
    body += text_at(left, kTop - 26, map.title);
    body += fmt::format(
        "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"none\" "
        "stroke=\"{}\"/>\n",
        left, kTop, panel_width, panel_height, kSoft);
    for (const ClothValue& value : map.values) {
      if (!std::isfinite(value.value)) continue;
      body += fmt::format(
          "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\" fill=\"{}\"><title>{}</title></circle>"
          "\n",
          left + scale * value.s, kTop + scale * value.t, radius, viridis(value.value / highest),
          escape_xml(value.label));
    }
    left += panel_width + kGap;
  }
  body += text_at(kMargin, kTop + panel_height + 28, "s, to the right →", "start", kSoft);
  body += fmt::format(
      "<text transform=\"translate({:.1f} {:.1f}) rotate(-90)\" text-anchor=\"end\" "
      "fill=\"{}\">← t, down</text>\n",
      kMargin - 22, kTop, kSoft);

  // The colour bar has 0 at the bottom.
  const double bar_left = left - kGap + 28;
  constexpr int kSteps = 48;
  for (int step = 0; step < kSteps; ++step) {
    const double fraction = (step + 0.5) / kSteps;
    body += fmt::format(
        "<rect x=\"{:.1f}\" y=\"{:.2f}\" width=\"14\" height=\"{:.2f}\" fill=\"{}\"/>\n", bar_left,
        kTop + panel_height * (1 - (step + 1.0) / kSteps), panel_height / kSteps + 0.4,
        viridis(fraction));
  }
  const Axis bar{0, highest, kTop + panel_height, kTop, false};
  for (const double tick : nice_ticks(0, highest, 5)) {
    body += line_at(bar_left + 14, bar(tick), bar_left + 18, bar(tick), {kInk, "", 1});
    body += text_at(bar_left + 22, bar(tick) + 4, tick_text(tick), "start", kSoft);
  }
  const double width = std::min(kWidth, bar_left + 66);
  body += text_at(width, kTop - 26, maps.value_label, "end");
  return open_svg(width, kTop + panel_height + 38, maps.title, maps.description) + body +
         "</svg>\n";
}

std::string point_overlay(const PointOverlay& overlay) {
  constexpr double kWidth = 800;
  const double scale = kWidth / overlay.width;
  const double height = scale * overlay.height;
  const auto x_px = [&](double x) { return scale * (x - overlay.left); };
  const auto y_px = [&](double y) { return scale * (y - overlay.top); };
  const auto path = [](const std::string& data, const char* colour, double width) {
    return fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\"/>\n", data,
                       colour, width);
  };
  const auto ring = [](double x, double y) {
    return fmt::format("M{:.1f} {:.1f}a3.6 3.6 0 1 0 7.2 0a3.6 3.6 0 1 0 -7.2 0", x - 3.6, y);
  };
  const auto cross = [](double x, double y) {
    return fmt::format("M{:.1f} {:.1f}h5m-2.5 -2.5v5", x - 2.5, y);
  };

  std::string rings;
  std::string crosses;
  std::string lines;
  std::string names;
  for (const PointPair& point : overlay.points) {
    const double ox = x_px(point.observed_x);
    const double oy = y_px(point.observed_y);
    const double px = x_px(point.predicted_x);
    const double py = y_px(point.predicted_y);
    if (!std::isfinite(ox + oy + px + py)) continue;
    rings += ring(ox, oy);
    crosses += cross(px, py);
    lines += fmt::format("M{:.1f} {:.1f}l{:.1f} {:.1f}", ox, oy, overlay.magnification * (px - ox),
                         overlay.magnification * (py - oy));
    names += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"6\"><title>{}</title></circle>\n",
                         ox, oy, escape_xml(point.label));
  }

  // The inner <svg> cuts off all that lies outside the rectangle.
  std::string body = fmt::format("<svg width=\"{:.1f}\" height=\"{:.1f}\">\n", kWidth, height);
  const bool on_picture = !overlay.picture_uri.empty();
  if (on_picture) {
    body += fmt::format(
        "<image href=\"{}\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\"/>\n",
        overlay.picture_uri, x_px(overlay.picture_left), y_px(overlay.picture_top),
        scale * overlay.picture_width, scale * overlay.picture_height);
    // A dark edge keeps the marks visible on the light parts of the picture.
    for (const std::string* marks : {&rings, &lines, &crosses}) body += path(*marks, "#000", 2.8);
    body +=
        path(rings, "#37e0ee", 1.3) + path(lines, "#ffd23f", 1.3) + path(crosses, "#ff7a59", 1.3);
  } else {
    body +=
        fmt::format("<rect width=\"{:.1f}\" height=\"{:.1f}\" fill=\"#fafbfc\" stroke=\"{}\"/>\n",
                    kWidth, height, kGrid);
    body += path(rings, "#1f4e79", 1.3) + path(lines, kSoft, 1.2) + path(crosses, "#b8431b", 1.3);
  }
  body += fmt::format("<g fill=\"none\" pointer-events=\"all\">\n{}</g>\n</svg>\n", names);

  // The key is below the picture.
  const double y = height + 20;
  body +=
      path(ring(10, y - 4), on_picture ? "#0094a0" : "#1f4e79", 1.4) + text_at(22, y, "observed");
  body += path(cross(106, y - 4), "#b8431b", 1.4) + text_at(116, y, "predicted");
  body += path(fmt::format("M196 {:.1f}h24", y - 4), on_picture ? "#a07a00" : kSoft, 1.4);
  body += text_at(
      228, y,
      fmt::format("from observed towards predicted, {:g} times as long", overlay.magnification));
  return open_svg(kWidth, height + 30, overlay.title, overlay.description) + body + "</svg>\n";
}

}  // namespace clothfit
