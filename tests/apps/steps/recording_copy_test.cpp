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

TEST(CopyRecording, GivesEveryFileAPlaceOfItsOwn) {
  const test::ScratchFolder elsewhere("copy_names_from"), first("copy_names"), second("copy_again");
  Recording original = read_recording(kBundled / "swing_plain");
  const auto write = [&](const std::string& name, const std::string& text) {
    fs::create_directories((elsewhere.path() / name).parent_path());
    std::ofstream(elsewhere.path() / name) << text;
    return elsewhere.path() / name;
  };
  // All but the markers are called t.csv, and one has the name of what the steps write.
  original.frame_rate_hz.reset();
  original.times_file = write("times/t.csv", "frame,time\n0,0\n1,0.5\n");
  original.reference_file = write("reference/t.csv", "point,x,y,z\nnail,1,2,3\n");
  original.held.push_back({.at_m = {0.1, 0.1},
                           .motion = HeldMotion::path,
                           .file = write("held/t.csv", "time,x,y,z\n0,4,5,6\n")});
  original.tracks2d["front"] = write("tracks/front.csv", "frame,marker,u,v\n");
  original.folder = elsewhere.path();
  original.obstacle_file = write("calibration.json", "v 0 0 0.7\nv 1 0 0.7\nv 1 1 0.7\nf 1 2 3\n");

  write_recording(copy_recording(original, first.path()), first.path());
  const Recording once = read_recording(first.path());
  write_recording(copy_recording(once, second.path()), second.path());
  const Recording twice = read_recording(second.path());

  for (const Recording* copy : {&once, &twice}) {
    EXPECT_EQ(copy->times_s, (std::vector<double>{0, 0.5}));
    ASSERT_EQ(copy->reference.size(), 1u);
    EXPECT_EQ(copy->reference[0].name, "nail");
    EXPECT_EQ(read_held_path(*copy->held.back().file).position_m[0], Eigen::Vector3d(4, 5, 6));
    EXPECT_EQ(copy->markers.markers.size(), original.markers.markers.size());
    EXPECT_EQ(copy->obstacle->vertex_m.cols(), 3);
    EXPECT_NE(copy->obstacle_file->filename(), "calibration.json");
  }
}

TEST(CopyRecording, CopiesAFileThatTwoPartsNameForEach) {
  const test::ScratchFolder scratch("copy_shared_table");
  Recording original = read_recording(kBundled / "swing_plain");
  original.tracks2d["front"] = original.markers_file;

  const Recording copied = copy_recording(original, scratch.path());

  EXPECT_NE(copied.tracks2d.at("front"), copied.markers_file);
  fs::remove(copied.tracks2d.at("front"));  // as tracking it again does
  EXPECT_TRUE(fs::exists(copied.markers_file));
}

}  // namespace
}  // namespace clothfit
