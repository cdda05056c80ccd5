#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/report/page/svg_parts.h"

namespace clothfit {

/// Returns round numbers inside [low, high], about `wanted` of them. Steps are 1, 2 or 5 times a
/// power of ten.
std::vector<double> nice_ticks(double low, double high, int wanted);

/// Returns powers of ten inside [low, high], with 2 and 5 times them where there are fewer than
/// three.
std::vector<double> log_ticks(double low, double high);

/// A line through (x, y). Points that are not finite (or not positive on a log axis) leave a gap.
struct Series {
  std::string label;
  std::vector<double> x;
  std::vector<double> y;
  LineStyle style;
};

/// A shaded range of x, with its name.
struct Band {
  double from = 0;
  double to = 0;
  std::string label;
};

/// A horizontal line, with its name.
struct Level {
  double value = 0;
  std::string label;
};

struct LinePlot {
  std::string title;        ///< for readers who do not see the picture
  std::string description;  ///< content of the picture, for the same
  std::string x_label;
  std::string y_label;
  bool log_y = false;
  std::vector<Series> series;
  std::optional<Band> band;
  std::optional<Level> level;
};

/// Draws the plot as one <svg> element with axes, grid and legend.
std::string line_plot(const LinePlot& plot);

/// A value somewhere on the flat cloth; s to the right, t down.
struct ClothValue {
  double s = 0;
  double t = 0;
  double value = 0;
  std::string label;  ///< shown when pointed at, read to those who do not see
};

struct ClothMap {
  std::string title;  ///< above the panel
  std::vector<ClothValue> values;
};

/// Maps of one quantity over the cloth, side by side. They share one colour scale from 0 and a
/// labelled bar.
struct ClothMaps {
  std::string title;
  std::string description;
  double width_m = 0;
  double height_m = 0;
  std::string value_label;  ///< "rms residual (px)"
  double largest = 0;       ///< where the colours end; 0: at the largest value
  std::vector<ClothMap> maps;
};
std::string cloth_maps(const ClothMaps& maps);

/// Observed and predicted points in one plane, y down, over a picture where there is one.
struct PointPair {
  double observed_x = 0, observed_y = 0;
  double predicted_x = 0, predicted_y = 0;
  std::string label;
};

struct PointOverlay {
  std::string title;
  std::string description;
  double left = 0, top = 0, width = 0, height = 0;  ///< the shown rectangle, in the points' unit
  std::string picture_uri;                          ///< may be empty
  double picture_left = 0, picture_top = 0, picture_width = 0, picture_height = 0;
  double magnification = 1;  ///< for the lines from observed towards predicted places
  std::vector<PointPair> points;
};
std::string point_overlay(const PointOverlay& overlay);

}  // namespace clothfit
