#pragma once

#include <memory>
#include <string>
#include <vector>

#include "data/recording.h"
#include "data/tracks.h"
#include "fit/observe/smoothing_spline.h"
#include "model/cloth/cloth.h"

namespace clothfit {

/// A held point that follows its marker's measured track.
struct TrackedPoint {
  int held = 0;                                 ///< index into Drive::held
  int marker = 0;                               ///< the marker at the point
  std::shared_ptr<const SmoothingSpline> path;  ///< through the marker's track
  std::vector<double> sigma;  ///< given to the path's samples, its knots; empty: all alike
};

/// The prescribed points of a recording's cloth on a mesh, with their motion.
struct Drive {
  std::vector<HeldVertexWeights> held;
  std::vector<int> driving_markers;  ///< markers whose own track drives a held point
  std::vector<TrackedPoint> tracked;
};

/// Adds a point or an edge. It follows `path` where that is given, else stays where the start shape
/// has it. Throws InputError at `where` beyond kMostHeldPoints (fit/problem/memory_limits.h).
void hold(const HeldPoint& point, const HeldPath* path, const Mesh& mesh, const std::string& where,
          std::vector<HeldVertexWeights>& held);

/// Makes the held points with their motion. `fixed` ones stay where the start shape has them,
/// `path` ones follow their file. `tracked` ones follow a smoothing spline through their marker's
/// track in space. Held-out frames are included, because the drive is an input and no prediction.
/// Throws InputError for a tracked point without a marker or without such a track.
Drive make_drive(const Recording& recording, const Mesh& mesh, const Tracks3d& tracks,
                 const std::vector<double>& frame_time_s);

}  // namespace clothfit
