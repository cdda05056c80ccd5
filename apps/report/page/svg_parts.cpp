#include "apps/report/page/svg_parts.h"

#include <fmt/format.h>

#include <cmath>

#include "apps/report/page/html.h"

namespace clothfit {

double Axis::operator()(double value) const {
  const double fraction =
      logarithmic ? std::log(value / low) / std::log(high / low) : (value - low) / (high - low);
  return from_px + fraction * (to_px - from_px);
}

bool Axis::shows(double value) const {
  return std::isfinite(value) && (!logarithmic || value > 0);
}

std::string open_svg(double width, double height, const std::string& title,
                     const std::string& description) {
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" viewBox=\"0 0 {:.0f} {:.0f}\" "
      "font-family=\"Helvetica Neue, Arial, Liberation Sans, DejaVu Sans, sans-serif\" "
      "font-size=\"12\" fill=\"{}\">\n<title>{}</title>\n<desc>{}</desc>\n",
      width, height, kInk, escape_xml(title), escape_xml(description));
}

std::string text_at(double x, double y, const std::string& text, const char* anchor,
                    const char* colour) {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\" fill=\"{}\">{}</text>\n",
                     x, y, anchor, colour, escape_xml(text));
}

std::string upward_text_at(double x, double y, const std::string& text, const char* colour) {
  return fmt::format(
      "<text transform=\"translate({:.1f} {:.1f}) rotate(-90)\" text-anchor=\"middle\" "
      "fill=\"{}\">{}</text>\n",
      x, y, colour, escape_xml(text));
}

std::string line_at(double x1, double y1, double x2, double y2, const LineStyle& style) {
  const std::string dashes =
      style.dashes.empty() ? "" : fmt::format(" stroke-dasharray=\"{}\"", style.dashes);
  return fmt::format(
      "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\" "
      "stroke-width=\"{}\"{}/>\n",
      x1, y1, x2, y2, style.colour, style.width_px, dashes);
}

std::string tick_text(double value) {
  std::string text = fmt::format("{:.6g}", value);
  return text.starts_with('-') ? "−" + text.substr(1) : text;
}

}  // namespace clothfit
