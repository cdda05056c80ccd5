#pragma once

#include <Eigen/Core>
#include <vector>

#include "data/camera_parameters.h"
#include "data/markers.h"
#include "data/progress.h"
#include "data/tracks.h"
#include "model/topology/mesh.h"

namespace clothfit {

/// A sheet whose shape in frame 0 is known.
struct TemplateSheet {
  Mesh mesh;
  Eigen::Matrix3Xd position_m;  ///< 3 x vertices, world
  std::vector<int> fixed;       ///< vertices that stay where they are
};

/// Bends the sheet, frame by frame from frame 0 on, until one camera sees what was tracked. Each
/// frame starts from the one before and minimises
///
///   sum over tracks (|projection - pixel| / 1 px)^2
///   + sum over structural springs ((l - l0) / (0.005 l0))^2, of shear springs over (0.05 l0)^2
///   + sum over flexion springs (|x_a - 2 x_between + x_b| / 2 mm)^2
///
/// with the lengths l0 of frame 0: cloth shears and bends, and hardly stretches. A marker lies on
/// the sheet where its pixel of frame 0 shows it. Rejected rows are left out. `camera` has a pose.
/// Returns positions for each frame that `tracks` reach, 3 x vertices, world. Throws NoResult where
/// a shape does not work out, Cancelled.
std::vector<Eigen::Matrix3Xd> follow_template(const TemplateSheet& sheet, const Tracks2d& tracks,
                                              const CameraParameters& camera,
                                              const MarkerSet& markers,
                                              const ProgressCallback& progress);

}  // namespace clothfit
