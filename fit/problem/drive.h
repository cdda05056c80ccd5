#pragma once

#include <memory>
#include <vector>

#include "data/recording.h"
#include "data/tracks.h"
#include "fit/observe/smoothing_spline.h"
#include "model/cloth/cloth.h"

namespace clothfit {

/// A held point that follows its marker's measured track.
struct TrackedPoint {
  int held = 0;                                 ///< index into Drive::held
  int marker = 0;                               ///< that lies at the point
  std::shared_ptr<const SmoothingSpline> path;  ///< through the marker's track
  std::vector<double> sigma;  ///< that the path's samples, its knots, were given; empty: all alike
};

/// The prescribed points of a recording's cloth on a mesh, with their motion.
struct Drive {
  std::vector<HeldVertexWeights> held;
  std::vector<int> driving_markers;  ///< markers whose own track drives a held point
  std::vector<TrackedPoint> tracked;
};

/// Adds a point or an edge that stays where the start shape has it or, where `path` is given,
/// follows that.
void hold(const HeldPoint& point, const HeldPath* path, const Mesh& mesh,
          std::vector<HeldVertexWeights>& held);

/// Held points with their motion: `fixed` ones stay where the start shape has them, `path` ones
/// follow their file, `tracked` ones a smoothing spline through their marker's track in space
/// (held-out frames included: the drive is an input, not a prediction). Throws InputError for a
/// tracked point without a marker or without such a track.
Drive make_drive(const Recording& recording, const Mesh& mesh, const Tracks3d& tracks,
                 const std::vector<double>& frame_time_s);

}  // namespace clothfit
