#pragma once

#include "fit/preflight/check_list.h"
#include "fit/preflight/recorded_motion.h"

namespace clothfit {

/// The checks of a recording, each in a file of its own. A check that cannot be made of a recording
/// adds nothing.

/// Says whether something else than held points may carry the cloth: an obstacle, a contact.
bool is_carried(const RecordedMotion& motion);

/// Says whether an effect of motion is declared, which may push as hard as the weight.
bool moves_by_effects(const Recording& recording);

/// Mass per area, gravity's size, frame times, the mesh's cells, parameters of declared effects.
void check_declarations(const Recording& recording, CheckList& list);
/// Distances between markers in space against those on the cloth; cameras' distances.
void check_units(const RecordedMotion& motion, CheckList& list);
/// A flat sheet's width and height, and its size to a few per cent, once markers are in order.
void check_proportions(const RecordedMotion& motion, CheckList& list);
/// The flat sheet in frame 0: markers and tags in the order that is declared, cameras that agree.
void check_first_sheet(const RecordedMotion& motion, CheckList& list);
/// Frames that are missing, repeated or out of step.
void check_timing(const RecordedMotion& motion, CheckList& list);
/// Cloth that hangs below what holds it, along gravity.
void check_hanging(const RecordedMotion& motion, CheckList& list);
/// The moment of release, and the fall from there by gravity and frame times.
void check_release(const RecordedMotion& motion, CheckList& list);
/// Whether held points rest, and nothing else does.
void check_held_points(const RecordedMotion& motion, CheckList& list);
/// Tracks that are exchanged, frozen, or those of another marker.
void check_marker_tracks(const RecordedMotion& motion, CheckList& list);
/// An obstacle inside out, around the cloth's start, or never met.
void check_obstacle(const RecordedMotion& motion, CheckList& list);

}  // namespace clothfit
