#pragma once

namespace clothfit {

/// Thresholds of the checks that hold a recording against its own data. Beside each stand what it
/// decides, and what raising it costs. "Share" is of the root of the cloth's area. All were set
/// with their check. Afterwards they were held against the bundled and foreign recordings and the
/// robot's (docs/log.md), none of which may be warned of without a reason. A recording is refused
/// only for what no sound one can show.
struct PreflightCriteria {
  // Declarations (declarations.cpp)
  /// kg/m2 of cloth, from silk gauze to coated canvas. Wider: grams pass for kilograms of a large
  /// sheet.
  double least_areal_density = 0.01, most_areal_density = 3;
  /// m/s2 on the ground, anywhere on earth, and what is refused. Wider: other units pass.
  double least_on_ground = 9.7, most_on_ground = 9.9, most_gravity = 30;
  /// s between frames. Wider: milliseconds and numbers of frames pass for seconds.
  double longest_interval = 2, shortest_interval = 1e-5;
  /// The same that is warned of. Raised: numbers of frames pass for seconds.
  double slow_interval = 0.3;
  /// Ratio of the sides of a cell. Raised: columns and rows may be exchanged.
  double cells_alike = 2.5;

  // Units (units.cpp)
  /// Ratio of distances in space and on the cloth that is refused. Raised: feet pass for metres of
  /// a crumpled sheet.
  double scale_refused = 1.5;
  /// The same below 1, of a shape at rest and of an unknown one. Raised: folded cloth is refused.
  double folded = 0.5, crumpled = 0.25;
  /// Ratio of the scales along s and t of a flat sheet. Raised: nearly square cloth may lie on its
  /// side.
  double sides_alike = 1.2;
  /// The same of a flat sheet, beyond 1, that is warned of. Raised: errors of the print's scale
  /// pass that change stiffness by as much.
  double scale_warned = 0.05;
  /// Ratio of a camera's distances from reference and cloth. Raised: decimetres pass.
  double reference_distance = 8;

  // The first sheet (first_sheet.cpp)
  /// Median of what markers lie beside the place between their neighbours, as a share of the
  /// distance to the nearest. Up to the first they are in order, beyond the second they are not,
  /// whatever order would be better. Raised: exchanged corners of small tags pass.
  double ordered = 0.1, disordered = 0.5;
  /// The same where the start is not flat. Raised: other orders of folded cloth pass.
  double disordered_folded = 1.5;
  /// Another order must leave this share of that.
  double better_order = 0.4;
  /// Share by which nine of ten markers may lie beside a flat sheet, beyond the noise. Raised:
  /// starts are taken for flat that are not, and stiffness makes up for it.
  double sheet_warned = 0.015, sheet_refused = 0.08;
  /// Times what nine of ten lie beside it from which a marker strays. Raised: wrong s and t pass.
  double stray = 5;
  /// Share by which cameras may see the sheet apart, and the same of the farthest camera's
  /// distance, which a small sheet tells no better. Raised: their poses may be off. Beyond the
  /// last, of that distance, they are refused.
  double cameras_apart = 0.05, cameras_apart_far = 0.03, cameras_refused = 0.5;
  /// rad by which the poses of several cameras may be off. Raised: small sheets far away may be
  /// bent.
  double pose_off = 3e-3;

  // What hangs (hanging.cpp)
  /// Share that held markers reach along gravity, beyond which cloth is held at its side. Raised:
  /// flags are taken for hanging.
  double held_at_side = 0.3;
  /// Share by which the middle must lie above or below what holds the cloth. Raised: gravity that
  /// is turned round passes of stiff cloth.
  double above_held = 0.15;

  // Gravity and the release (release.cpp)
  /// Share from held points beyond which cloth falls freely at first. Raised: small sheets are not
  /// looked at.
  double free_of_held = 0.3;
  /// Share up to which a sheet that falls is nearly flat. Raised: its springs have slowed it.
  double nearly_flat = 0.05;
  /// Share from which a sheet has begun to move. Raised: the moment of release is less certain.
  double begun = 0.01;
  /// Ratio of an acceleration's standard deviation to itself up to which it is judged, and how many
  /// of them are taken off what it differs by. Raised, lowered: stiff sheets, which soon turn
  /// round, are judged.
  double release_uncertain = 0.3, release_sigmas = 3;
  /// Share of the mean square that a fall with the square of the time leaves; a creep leaves 0.06.
  /// Raised: damped sheets are judged.
  double no_parabola = 0.03;
  /// Share that a cloth at rest may move in so many seconds, before a person sets it in motion.
  double rests = 0.02, rest_s = 0.2;
  /// m/s2 of gravity across the sheet that are needed to see it. Lowered: noise decides.
  double in_view = 1.5;
  /// Frames that a sheet may stand still before its release. Raised: damping makes up for them.
  double still_frames = 1.5;
  /// m/s of a sheet in frame 0. Raised: sheets in motion pass for released ones.
  double moving_speed = 0.15;
  /// Ratio of the acceleration to the expected one, or its inverse, that is warned of and refused.
  /// A wind of a tenth of the weight is to be diagnosed and passes. Raised: frame rates pass that
  /// are wrong by the root of it.
  double gravity_warned = 2, gravity_refused = 3;

  // Time (timing.cpp)
  /// Ratio of all markers' velocities in one interval to those about it. Lowered: a kick is taken
  /// for a missing frame. Raised: one missing frame is 2.
  double jump = 1.7;
  /// Cosine between the velocities in a jump and about it. Lowered: a kick is taken for one.
  double jump_agrees = 0.9;
  /// What a jump may differ from a whole number of steps, by the root of that, to be refused.
  /// Raised: kicks are.
  double whole_steps = 0.1;
  /// Ratio of the way of all markers in a frame that repeats the last to the shorter of the ways
  /// before and after, and the cosine between those two. Raised, lowered: a halt is taken for a
  /// copy.
  double repeat = 0.12, repeats_way = 0.85;
  /// Share of the frames that are copies, beyond which the recording was made at a lower rate.
  double every_second = 0.2;
  /// Ratio of what velocities there are off by to the median of all intervals. Lowered: rough
  /// motion and uncertain clocks are taken for missing frames.
  double out_of_step = 3;
  /// Likeness of the velocities before and after. Raised: frames missing in quick motion pass.
  double alike_intervals = 0.6;
  /// Share of the cloth by which markers must move in an interval, in the mean. Raised: slow motion
  /// is not looked at.
  double moves = 0.003;

  // Held points (held_points.cpp)
  /// Sigmas by which a marker at a fixed point may stray, and share of the cloth. Raised: clips
  /// that slip pass, and are left to the diagnosis.
  double held_sigmas = 5, held_share = 0.01;
  /// Share from which the point is not held at all. Lowered: a clip that slips is refused.
  double held_refused = 0.15;
  /// Sigmas within which a marker rests. Raised: hardly moving ones are taken for held.
  double still_sigmas = 3;
  /// Share within which markers tell of a held point. Raised: what swings there is taken for it.
  double near_held = 0.3;
  /// Share from which a marker is not beside what is held. Raised: other clips pass.
  double beside_held = 0.15;
  /// Share of the markers that may rest at clips where nothing is held. Raised: cloth that lies on
  /// something is refused.
  double clips = 0.2;

  // Tracks of markers (marker_tracks.cpp)
  /// Shares of the distance to the nearest marker. Beyond the first one lies astray, within the
  /// second it lies in another's place. Raised, lowered: exchanged neighbours pass.
  double out_of_place = 0.6, in_place = 0.35;
  /// Frames in which two must be exchanged. Raised: short exchanges pass.
  int exchanged_frames = 3;
  /// Share of the markers of a frame that may be. Raised: folds are taken for exchanges.
  double most_exchanged = 0.1;
  /// Share of the frames that show two in which they must lie in one place, to be one.
  double twice_share = 0.3;
  /// Share of the cloth's area on which markers must lie. Raised: recordings of a part are warned
  /// of.
  double covered = 0.25;
  /// Frames in which a track must repeat itself, or that of another marker.
  int frozen_frames = 10;

  // Obstacles (obstacle_checks.cpp)
  /// Share by which cloth may lie in an obstacle that it touches. Raised: thin ones are not felt.
  double touches = 0.02;
  /// Share from which cloth does not come near it. Raised: obstacles that are never met pass.
  double near_obstacle = 0.25;
  /// Share of the markers that must be inside at the start. Raised: a cloth that starts inside
  /// passes.
  double inside_share = 0.5;
  /// Share of the start's vertices that must lie behind an open surface. Lowered: cloth that hangs
  /// over its rim is warned of.
  double behind_share = 0.1;
};

/// The one set that the product uses.
inline constexpr PreflightCriteria kPreflight{};

}  // namespace clothfit
