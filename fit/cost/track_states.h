#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "fit/cost/state_objective.h"
#include "fit/problem/problem.h"

namespace clothfit {

struct TrackStatesOptions {
  /// A marker that is hidden for longer is missing in the frames between. 1 or more.
  int longest_gap_frames = 3;
  double least_share = 0.75;  ///< share of the markers that a frame needs; else it is left out
  int end_frames = 3;         ///< left out at either end of a track, where a spline knows no slope
};

/// States of a cloth that was seen, not simulated.
struct TrackStates {
  RecordedStates states;
  std::vector<int> frame;  ///< the frame of each state
  int left_out = 0;        ///< fitted frames without a state
  /// Sigma of a position: rms of the splines' own, over markers and knots. 0 where there was too
  /// little to estimate it from.
  double position_sigma_m = 0;
};

/// Returns positions and velocities of the mesh's vertices in the fitted frames, from 3D tracks.
/// Each marker's track goes through a smoothing spline (fit/observe/smoothing_spline.h). The
/// smoothest bicubic surface through a frame's markers then spreads them over the cloth; it has as
/// many nodes as markers a side. Held points that move are markers too, whose place is known.
///
/// A marker that is hidden for a few frames is taken from its spline. One that is hidden longer, or
/// at an end of its track, is missing, and the surface runs on without it. A frame in which too
/// many are missing has no state: the transition over it is as long as the gap.
///
/// A smoothing spline takes from fast motion what it takes from noise, so that velocities are too
/// low where the frame rate does not resolve the motion (docs/theory/identification.md).
///
/// Returns nothing for a problem without 3D tracks, or where fewer than two frames have a state.
std::optional<TrackStates> find_states_of_tracks(const FitProblem& problem,
                                                 const TrackStatesOptions& options = {});

/// Does the same, but throws InputError where there is nothing.
TrackStates recorded_states_of_tracks(const FitProblem& problem,
                                      const TrackStatesOptions& options = {});

/// Makes the founding paper's cost over these states, `full` or `small`
/// (fit/cost/state_objective.h), in units of their sigma. Frames are cut into at least ten time
/// steps, however long a step is stable. The scheme's velocities are those of half a step before,
/// and a smoothed track's are not.
std::unique_ptr<StateObjective> state_objective_of_tracks(const FitProblem& problem,
                                                          const TrackStates& tracks, bool full,
                                                          const TimeSteps& steps);

}  // namespace clothfit
