// Checks that every recording at hand reads, with everything it names. These are the repository's
// and, with CLOTHFIT_DATA set, all below that folder. The meaning of the numbers is for tests/fit/.

#include <algorithm>
#include <cstdlib>
#include <set>

#include "data/body_path.h"
#include "data/camera_parameters.h"
#include "data/recording.h"
#include "data/tracks.h"
#include "tests/data/expect_refused.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> recordings_below(const fs::path& folder) {
  std::vector<fs::path> recordings;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.path().filename() == "recording.yaml")
      recordings.push_back(entry.path().parent_path());
  std::sort(recordings.begin(), recordings.end());
  return recordings;
}

/// Reads a recording and all that it names; checks the rules of every recording.
void read_all(const fs::path& folder) {
  SCOPED_TRACE(folder);
  const Recording recording = read_recording(folder);
  EXPECT_FALSE(recording.name.empty());
  int last_frame = 0;
  if (recording.tracks3d) {
    const Tracks3d tracks = read_tracks3d(*recording.tracks3d, recording.markers);
    ASSERT_FALSE(tracks.empty());
    last_frame = std::max(last_frame, tracks.back().frame);
  }
  for (const auto& [camera, file] : recording.tracks2d) {
    const Tracks2d tracks = read_tracks2d(file, recording.markers);
    ASSERT_FALSE(tracks.empty());
    last_frame = std::max(last_frame, tracks.back().frame);
  }
  EXPECT_GT(last_frame == 0 ? 1 : recording.frame_time_s(last_frame), 0);
  for (const CameraEntry& camera : recording.cameras)
    if (camera.file) {
      EXPECT_EQ(read_camera(*camera.file).name, camera.name);
    }
  for (const RigidBody& body : recording.bodies)
    EXPECT_GT(read_body_path(body.file).time_s.size(), 1u);
  for (const HeldPoint& held : recording.held)
    if (held.file) {
      EXPECT_FALSE(read_held_path(*held.file).time_s.empty());
    }
}

TEST(BundledRecordings, AllRead) {
  const fs::path folder = fs::path(CLOTHFIT_SOURCE_DIR) / "data/recordings";
  std::set<std::string> names;
  for (const fs::path& recording : recordings_below(folder)) {
    read_all(recording);
    names.insert(recording.filename().string());
  }
  EXPECT_THAT(names,
              testing::IsSupersetOf({"tags_onecam", "swing_plain", "swing_breeze", "swing_hem"}));
}

TEST(BundledRecordings, AreCompleteAndReadAlikePlainAndCompressed) {
  const fs::path folder = fs::path(CLOTHFIT_SOURCE_DIR) / "data/recordings/swing_plain";
  const TemporaryFolder plain;
  const Recording recording = read_recording(folder);
  const Tracks3d packed = read_tracks3d(*recording.tracks3d, recording.markers);

  const Tracks3d unpacked =
      read_tracks3d(plain.write("tracks3d.csv", read_text(*recording.tracks3d)), recording.markers);

  EXPECT_EQ(recording.markers.markers.size(), 17u * 17u);
  EXPECT_EQ(packed.back().frame, 71);
  ASSERT_EQ(packed.size(), unpacked.size());
  for (size_t i = 0; i < packed.size(); ++i) {
    ASSERT_EQ(packed[i].frame, unpacked[i].frame);
    ASSERT_EQ(packed[i].marker, unpacked[i].marker);
    ASSERT_EQ(packed[i].position_m, unpacked[i].position_m);
    ASSERT_EQ(packed[i].sigma_m, unpacked[i].sigma_m);
  }
}

TEST(BundledRecordings, StayTheSameWhenWrittenAgain) {
  for (const fs::path& folder :
       recordings_below(fs::path(CLOTHFIT_SOURCE_DIR) / "data/recordings")) {
    SCOPED_TRACE(folder);
    const TemporaryFolder once;
    const TemporaryFolder twice;

    write_recording(read_recording(folder), once.path());
    write_recording(read_recording(once.path(), OutsideFiles::allowed), twice.path());

    // Both lie side by side, so that even the relative paths agree.
    EXPECT_EQ(read_text(once / "recording.yaml"), read_text(twice / "recording.yaml"));
  }
}

TEST(RecordingsOutsideTheRepository, AllRead) {
  const char* const data = std::getenv("CLOTHFIT_DATA");
  if (data == nullptr || !fs::is_directory(data)) {
    GTEST_SKIP() << "CLOTHFIT_DATA names no folder with further recordings";
  }
  // Inputs that have to be refused lie beside these two.
  std::vector<fs::path> recordings;
  for (const char* folder : {"recordings", "real"})
    if (fs::is_directory(fs::path(data) / folder))
      for (const fs::path& recording : recordings_below(fs::path(data) / folder))
        recordings.push_back(recording);
  for (const fs::path& recording : recordings) read_all(recording);
  RecordProperty("recordings", static_cast<int>(recordings.size()));
  EXPECT_FALSE(recordings.empty());
}

}  // namespace
}  // namespace clothfit
