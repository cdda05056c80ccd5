// Checks that a step's folder is a complete recording by itself. The steps' additions to it:
// program_end_to_end_test.cpp.
#include "apps/steps/recording_copy.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "data/camera_parameters.h"
#include "data/tracks.h"
#include "tests/apps/bundled_recordings.h"
#include "tests/apps/scratch_folder.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

TEST(CopyRecording, HoldsItsTablesAndReadsBack) {
  const test::ScratchFolder scratch("copy_recording");
  const Recording original = read_recording(kBundled / "swing_plain");

  const Recording copied = copy_recording(original, scratch.path());
  write_recording(copied, scratch.path());
  const Recording back = read_recording(scratch.path());

  EXPECT_EQ(back.markers.markers.size(), original.markers.markers.size());
  ASSERT_TRUE(back.tracks3d);
  EXPECT_EQ(back.tracks3d->parent_path(), fs::canonical(scratch.path()));
  EXPECT_EQ(read_tracks3d(*back.tracks3d, back.markers).size(),
            read_tracks3d(*original.tracks3d, original.markers).size());
  ASSERT_EQ(back.cameras.size(), 1U);
  EXPECT_EQ(read_camera(*back.cameras[0].file).focal_px,
            read_camera(*original.cameras[0].file).focal_px);
}

TEST(CopyRecording, NamesPicturesWhereTheyLie) {
  const test::ScratchFolder scratch("copy_pictures");
  const Recording original = read_recording(kBundled / "tags_onecam");

  write_recording(copy_recording(original, scratch.path()), scratch.path());
  const Recording back = read_recording(scratch.path());

  EXPECT_FALSE(fs::exists(scratch.path() / "frames"));
  ASSERT_TRUE(back.cameras[0].images);
  EXPECT_TRUE(fs::equivalent(*back.cameras[0].images, *original.cameras[0].images));
  EXPECT_EQ(back.reference.size(), original.reference.size());
}

TEST(CopyRecording, TakesItsObstacleAlong) {
  const test::ScratchFolder elsewhere("copy_obstacle_from"), scratch("copy_obstacle");
  std::ofstream(elsewhere.path() / "table.obj") << "v 0 0 0.7\nv 1 0 0.7\nv 1 1 0.7\nf 1 2 3\n";
  Recording original = read_recording(kBundled / "swing_plain");
  original.obstacle_file = elsewhere.path() / "table.obj";

  write_recording(copy_recording(original, scratch.path()), scratch.path());
  fs::remove(elsewhere.path() / "table.obj");
  const Recording back = read_recording(scratch.path());

  ASSERT_TRUE(back.obstacle);
  EXPECT_EQ(back.obstacle->vertex_m.col(2), Eigen::Vector3d(1, 1, 0.7));
}

TEST(CopyRecording, GivesCamerasThatShareAFileOneEach) {
  const test::ScratchFolder scratch("copy_shared_camera");
  Recording original = read_recording(kBundled / "swing_plain");
  original.cameras.push_back({.name = "side", .file = original.cameras[0].file});

  const Recording copied = copy_recording(original, scratch.path());

  EXPECT_EQ(*copied.cameras[0].file, scratch.path() / "cameras" / "front.yaml");
  EXPECT_EQ(*copied.cameras[1].file, scratch.path() / "cameras" / "side.yaml");
  EXPECT_EQ(read_camera(*copied.cameras[1].file).focal_px,
            read_camera(*original.cameras[0].file).focal_px);
}

}  // namespace
}  // namespace clothfit
