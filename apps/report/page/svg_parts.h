#pragma once

#include <string>

namespace clothfit {

// The figures of a report are made of these parts.

inline constexpr const char* kInk = "#1c1e21";
inline constexpr const char* kSoft = "#5b616b";
inline constexpr const char* kGrid = "#e4e7eb";

/// The look of a line; told apart by dashes as well as by colour.
struct LineStyle {
  std::string colour;
  std::string dashes;  ///< SVG stroke-dasharray; empty for a solid line
  double width_px = 1.6;
};

/// Places values on the page, linearly or by their logarithm.
struct Axis {
  double low = 0;
  double high = 1;
  double from_px = 0;  ///< where `low` stands
  double to_px = 1;    ///< where `high` stands
  bool logarithmic = false;

  double operator()(double value) const;
  bool shows(double value) const;  ///< says whether the value has a place
};

/// Writes the opening tag of a figure, with text for readers who do not see it.
std::string open_svg(double width, double height, const std::string& title,
                     const std::string& description);

std::string text_at(double x, double y, const std::string& text, const char* anchor = "start",
                    const char* colour = kInk);

/// Writes a text to be read from below upwards.
std::string upward_text_at(double x, double y, const std::string& text, const char* colour = kInk);

std::string line_at(double x1, double y1, double x2, double y2, const LineStyle& style);

/// Writes the number at a tick of an axis, with a true minus sign.
std::string tick_text(double value);

}  // namespace clothfit
