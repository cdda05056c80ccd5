#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "calib/camera/rigid3.h"
#include "fit/observe/observations.h"

namespace clothfit {

/// Shapes of a sheet in the first frames of a recording. They follow from its markers in one camera
/// or several, given that warp and weft hardly stretch.
struct ShapesFromPixels {
  int nodes = 0;  ///< a side
  /// Places of the nodes (fit/observe/node_weights.h) in each frame, 3 x nodes^2.
  std::vector<Eigen::Matrix3Xd> node_m;
  double rms_residual = 0;  ///< for the pixels, over the larger of their sigma and a pixel
};

/// Finds for each frame the smooth shape that minimises
///
///   sum over observations |projection - pixel|^2 / sigma^2
///   + sum over structural springs ((l - l0) / (0.01 l0))^2 + shear springs ((l - l0) / (0.1 l0))^2
///
/// over a lattice of its own on a cloth of width_m x height_m. A perspective camera makes it unique
/// up to folds that it sees edge on. Frame 0 starts from the flat sheet that `world_from` places,
/// each of the others from the one before. Sigma counts as a pixel at least: the weights are to
/// find the basin, not the optimum. Returns nothing where a frame has fewer than half of the
/// markers or a shape does not work out.
std::optional<ShapesFromPixels> shapes_from_pixels(const std::vector<ObservationSet>& sets,
                                                   const Eigen::Matrix2Xd& marker_m, double width_m,
                                                   double height_m, const Rigid3& world_from_sheet,
                                                   int nodes, int frames);

}  // namespace clothfit
