// Checks the places of tracked held points from pixels alone.
#include "fit/observe/held_tracks.h"

#include <gtest/gtest.h>

#include <cmath>

#include "data/input_error.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

/// Moves half a swing towards the camera by 3 cm, and 1 cm aside.
Eigen::Vector3d way_m(double time_s) {
  return std::sin(M_PI * time_s) * Eigen::Vector3d(0.01, -0.03, 0);
}

/// Makes the synthetic cloth carried along a way, with both upper corners said to be tracked.
FitInput carried_cloth() {
  SyntheticCloth cloth;
  cloth.seen = [](const SyntheticMotion& motion, double time_s, const Eigen::Vector2d& place_m) {
    return Eigen::Vector3d(motion(time_s, place_m) + way_m(time_s));
  };
  FitInput input = synthetic_input(cloth);
  for (HeldPoint& held : input.recording.held) held.motion = HeldMotion::tracked;
  input.tracks3d.clear();
  return input;
}

Eigen::Vector3d held_place_m(const FitInput& input, int marker, double time_s) {
  return input.recording.markers.markers[static_cast<size_t>(marker)].s_m *
             Eigen::Vector3d::UnitX() +
         way_m(time_s);
}

TEST(HeldTracks, FollowTheShapeOfTheClothAndThenTheirOwnPixels) {
  const FitInput input = carried_cloth();
  const CameraPose pose = *input.cameras.front().camera_from_world;
  const Eigen::Vector3d camera_m = -(pose.rotation.conjugate() * pose.translation_m);

  const Tracks3d tracks = held_tracks_from_pixels(input);

  ASSERT_EQ(tracks.size(), 2u * 36);
  double across_square = 0, along_square = 0;
  for (const Position3d& row : tracks) {
    const Eigen::Vector3d truth_m = held_place_m(input, row.marker, row.frame / 60.0);
    const Eigen::Vector3d ray = (truth_m - camera_m).normalized();
    const Eigen::Vector3d error_m = row.position_m - truth_m;
    const double along_m = error_m.dot(ray);
    along_square += along_m * along_m;
    across_square += (error_m - along_m * ray).squaredNorm();
  }
  const auto count = static_cast<double>(tracks.size());
  // A metre away a pixel is about a millimetre; the size of the picture tells the distance.
  EXPECT_LT(std::sqrt(across_square / count), 0.6e-3);
  EXPECT_LT(std::sqrt(along_square / count), 10e-3);
}

TEST(HeldTracks, AreWhereTheRaysOfTwoCamerasMeet) {
  FitInput input = carried_cloth();
  // A second camera stands a third of a circle around the cloth's upper edge.
  CameraParameters side = input.cameras.front();
  side.name = "side";
  const Eigen::AngleAxisd turn(M_PI / 3, Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d about_m(0.2, 0, 0);
  const CameraPose front = *side.camera_from_world;
  side.camera_from_world->rotation = front.rotation * turn.inverse();
  side.camera_from_world->translation_m =
      front.translation_m + front.rotation * (about_m - turn.inverse() * about_m);
  input.cameras.push_back(side);
  input.recording.held_out_from_frame = 1;
  ObservationSet view{.kind = "side", .unit = "px", .dimension = 2, .camera = side, .rows = {}};
  for (int f = 0; f < 36; ++f)
    for (const int marker : driving_markers(input.recording))
      input.tracks2d["side"].push_back(
          {.frame = f,
           .marker = marker,
           .position_px = view.predict(held_place_m(input, marker, f / 60.0))->head<2>(),
           .sigma_px = 0.3,
           .rejected = {}});

  const Tracks3d tracks = held_tracks_from_pixels(input);

  double square = 0;
  for (const Position3d& row : tracks)
    if (row.frame >= 1)
      square += (row.position_m - held_place_m(input, row.marker, row.frame / 60.0)).squaredNorm();
  EXPECT_LT(std::sqrt(square / static_cast<double>(tracks.size() - 2)), 1e-3);
}

TEST(HeldTracks, AreRefusedWhereTheMarkersDoNotShowTheCloth) {
  FitInput input = carried_cloth();
  Tracks2d& tracks = input.tracks2d.begin()->second;
  std::erase_if(tracks, [](const Position2d& row) { return row.frame == 7 && row.marker > 10; });
  EXPECT_THROW(held_tracks_from_pixels(input), InputError);
}

}  // namespace
}  // namespace clothfit
