#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace clothfit {

/// A marked place of a heat map.
struct HeatMark {
  double x = 0;
  double y = 0;
  bool filled = false;  ///< a dot; else a ring
  std::string label;
};

/// Values over a rectangle of places, coloured by their logarithm, dark where they are small.
struct HeatMap {
  std::string title;         ///< above the panel
  std::vector<double> x, y;  ///< rising; spaced evenly, or evenly in the logarithm
  Eigen::MatrixXd value;     ///< x places by y places; values not finite or not above 0 stay white
  std::vector<HeatMark> marks;
};

/// Heat maps side by side, with the key of the marks below. Each has its colours from its own
/// smallest to its largest value.
struct HeatMaps {
  std::string title;        ///< for readers who do not see the picture
  std::string description;  ///< content of the picture, for the same
  std::string x_label, y_label, value_label;
  bool log_x = false;
  bool log_y = false;
  double smallest = 0;  ///< values below it take its colour; 0: the map's own smallest
  std::vector<HeatMap> maps;
};
std::string heat_maps(const HeatMaps& maps);

}  // namespace clothfit
