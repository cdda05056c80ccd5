#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace clothfit {

/// A cloth of columns x rows vertices, row by row, as a net of threads (3 x vertices, z up).
struct Wireframe {
  std::string title;  ///< above the panel
  std::string note;   ///< below it
  int columns = 0;
  int rows = 0;
  Eigen::Matrix3Xd position_m;
};

/// The direction from which cloths are seen: from far away, so that lengths compare.
struct Viewpoint {
  double azimuth_rad = 0.6;    ///< from the -y axis towards +x
  double elevation_rad = 0.3;  ///< above the horizontal
};

/// Cloths in panels, `columns` a row, all at one scale and about one place, so that they compare.
/// Nearer parts hide parts behind them.
struct Wireframes {
  std::string title;        ///< for readers who do not see the picture
  std::string description;  ///< content of the picture, for the same
  int columns = 3;
  Viewpoint viewpoint;
  std::vector<Wireframe> cloths;
};
std::string wireframes(const Wireframes& figure);

}  // namespace clothfit
