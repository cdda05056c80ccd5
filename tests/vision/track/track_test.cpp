// Checks tracking: identity, rejection, reference points, refusals, and the bundled recording
// against its truth. Single detections are in tag_detector_test.cpp, files and videos in
// image_source_test.cpp.

#include "vision/track/track.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <random>
#include <set>

#include "calib/camera/projection.h"
#include "data/camera_parameters.h"
#include "data/csv_reader.h"
#include "data/input_error.h"
#include "tests/data/temporary_folder.h"
#include "tests/vision/synthetic_tag.h"
#include "vision/encode/encode_picture.h"
#include "vision/track/rejection.h"

namespace clothfit {
namespace {

const std::filesystem::path kSource = CLOTHFIT_SOURCE_DIR;
const std::filesystem::path kTruth = kSource / "tests/fixtures/truth/tags_onecam";

/// The bundled recording with some of its frames only.
class BundledFrames {
 public:
  explicit BundledFrames(const std::vector<int>& frames)
      : recording_(read_recording(kSource / "data/recordings/tags_onecam")) {
    const std::filesystem::path all = *recording_.cameras.at(0).images;
    for (const int frame : frames) {
      const std::string name = fmt_frame(frame);
      std::filesystem::create_symlink(all / name, folder_ / name);
    }
    recording_.cameras[0].images = folder_.path();
  }
  const Recording& recording() const { return recording_; }
  const CameraEntry& camera() const { return recording_.cameras[0]; }

 private:
  static std::string fmt_frame(int frame) {
    const std::string number = std::to_string(frame);
    return std::string(6 - number.size(), '0') + number + ".jpg";
  }
  TemporaryFolder folder_;
  Recording recording_;
};

struct TruePixel {
  Eigen::Vector2d pixel_px;
  bool visible = false;
};

std::map<std::pair<int, std::string>, TruePixel> true_pixels() {
  CsvReader table(kTruth / "truth_tracks2d_front.csv.gz",
                  {{"frame"}, {"marker"}, {"u"}, {"v"}, {"visible"}});
  std::map<std::pair<int, std::string>, TruePixel> truth;
  while (table.next()) {
    truth[{table.whole_number(0, 0), table.name(1)}] = {{table.number(2), table.number(3)},
                                                        table.whole_number(4, 0) == 1};
  }
  return truth;
}

/// A recording of one tag (id 7, its four corners as markers) in pictures drawn by the test.
class DrawnRecording {
 public:
  DrawnRecording() {
    recording_.folder = folder_.path();
    recording_.markers_file = folder_ / "markers.csv";
    recording_.markers.kind = MarkerKind::apriltag;
    recording_.markers.family = "tag36h11";
    recording_.frame_rate_hz = 60;
    for (int corner = 0; corner < 4; ++corner)
      recording_.markers.markers.push_back(
          {.name = "t7_" + std::to_string(corner), .s_m = 0, .t_m = 0, .tag = 7, .corner = corner});
    std::filesystem::create_directory(folder_ / "frames");
    recording_.cameras.push_back(
        {.name = "front", .file = {}, .images = folder_ / "frames", .calibration = {}});
  }
  Recording& recording() { return recording_; }

  void add(const cv::Mat& picture) {
    write_png(picture, folder_ / ("frames/" + std::to_string(100 + count_++) + ".png"));
  }
  /// Draws a 40 px tag off the middle by `shift_px`.
  cv::Mat draw(double shift_u_px, double shift_v_px, int id = 7,
               const std::string& family = "tag36h11") {
    SyntheticTag tag = place_tag(view_, 40, 0, 0, {shift_u_px, shift_v_px});
    tag.id = id;
    tag.family = family;
    return render(tag, view_, rng_);
  }
  TrackResult track_it(const TrackOptions& options = {}) {
    return track(recording_, recording_.cameras[0], options, {});
  }

 private:
  TemporaryFolder folder_;
  Recording recording_;
  SyntheticCamera view_{.width = 320, .height = 120};
  std::mt19937_64 rng_{11};
  int count_ = 0;
};

void expect_error(const std::string& part, const std::function<void()>& call) {
  SCOPED_TRACE(part);
  try {
    call();
    ADD_FAILURE() << "was accepted";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr(part));
  }
}

TEST(Track, FindsTheBundledClothNearlyAsPlacedAndKnowsHowNearly) {
  const std::vector<int> frames = {0, 12, 24, 36, 48, 60};
  const BundledFrames bundled(frames);
  const auto truth = true_pixels();

  const TrackResult result = track(bundled.recording(), bundled.camera(), {}, {});

  ASSERT_TRUE(result.usable) << result.message;
  EXPECT_EQ(result.frames, 6);
  EXPECT_EQ(result.image_width, 960);
  std::vector<double> errors;
  double chi2 = 0;
  for (const Position2d& row : result.tracks) {
    if (!row.rejected.empty()) continue;
    const std::string& name =
        bundled.recording().markers.markers[static_cast<size_t>(row.marker)].name;
    const TruePixel& place = truth.at({frames[static_cast<size_t>(row.frame)], name});
    const double error = (row.position_px - place.pixel_px).norm();
    chi2 += error * error / (2 * row.sigma_px * row.sigma_px);
    if (place.visible) errors.push_back(error);
  }
  int visible = 0;
  for (const auto& [key, place] : truth)
    if (key.second.starts_with("t") && place.visible &&
        std::find(frames.begin(), frames.end(), key.first) != frames.end())
      ++visible;
  std::sort(errors.begin(), errors.end());
  const double count = static_cast<double>(errors.size());
  RecordProperty("chi2", std::to_string(chi2 / count));
  // docs/results.md states plain AprilTag's share.
  EXPECT_GE(count, 0.9982 * visible);
  EXPECT_LT(errors[errors.size() / 2], 0.107);
  EXPECT_LT(errors[errors.size() * 95 / 100], 0.32);
  EXPECT_GT(chi2 / count, 0.5);
  EXPECT_LT(chi2 / count, 2);
}

TEST(Track, PlacesReferencePointsAndSaysHowWell) {
  const BundledFrames bundled({0, 20, 40, 60});
  const CameraParameters camera = read_camera(kTruth / "truth_camera_front.yaml");
  const std::vector<ReferencePoint> truth = read_reference_points(kTruth / "truth_reference.csv");

  const TrackResult result = track(bundled.recording(), bundled.camera(), {}, {});

  ASSERT_EQ(result.reference.size(), 20U);
  double chi2 = 0;
  for (const ReferencePixel& found : result.reference) {
    const ReferencePoint& point = truth.at(static_cast<size_t>(found.point));
    const Eigen::Vector3d world(point.x_m, point.y_m, point.z_m);
    const Eigen::Vector2d expected = *project(camera, camera_from_world(camera) * world);
    EXPECT_LT((found.pixel_px - expected).norm(), 0.25) << point.name;
    EXPECT_EQ(found.frames, 4);
    chi2 += (found.pixel_px - expected).squaredNorm() / (2 * found.sigma_px * found.sigma_px);
  }
  EXPECT_LT(chi2 / 20, 3);
}

TEST(Track, GivesTheSameTwice) {
  const BundledFrames bundled({3, 4, 5});  // in any order of threads

  const TrackResult once = track(bundled.recording(), bundled.camera(), {}, {});
  const TrackResult again = track(bundled.recording(), bundled.camera(), {}, {});

  ASSERT_EQ(once.tracks.size(), again.tracks.size());
  for (size_t i = 0; i < once.tracks.size(); ++i) {
    EXPECT_EQ(once.tracks[i].frame, again.tracks[i].frame);
    EXPECT_EQ(once.tracks[i].marker, again.tracks[i].marker);
    EXPECT_EQ(once.tracks[i].position_px, again.tracks[i].position_px);
    EXPECT_EQ(once.tracks[i].sigma_px, again.tracks[i].sigma_px);
  }
  EXPECT_TRUE(std::is_sorted(once.tracks.begin(), once.tracks.end(),
                             [](const Position2d& a, const Position2d& b) {
                               return std::pair(a.frame, a.marker) < std::pair(b.frame, b.marker);
                             }));
  EXPECT_EQ(once.overlay_frame, 1);
  EXPECT_EQ(once.overlay.size(), cv::Size(960, 720));
}

TEST(Track, ReportsEveryPictureInOrderAndStopsWhenTold) {
  const BundledFrames bundled({0, 1, 2, 3, 4, 5, 6, 7});
  std::vector<double> done;

  const TrackResult result =
      track(bundled.recording(), bundled.camera(), {}, [&](const Progress& progress) {
        EXPECT_EQ(progress.total, 8);
        done.push_back(progress.done);
        return done.size() < 3;
      });

  EXPECT_THAT(done, testing::ElementsAre(1, 2, 3));
  EXPECT_TRUE(result.cancelled);
  EXPECT_FALSE(result.usable);
}

TEST(Track, RejectsAJumpButNotSteadyMotion) {
  // The tag moves 25 px a frame to the right, except in frame 3, where it is 150 px ahead.
  DrawnRecording drawn;
  for (int frame = 0; frame < 6; ++frame)
    drawn.add(drawn.draw(frame == 3 ? 125 : -100 + 25 * frame, 0));

  const TrackResult result = drawn.track_it();

  EXPECT_EQ(result.rejected, (std::map<std::string, int>{{"jump", 4}}));
  for (const Position2d& row : result.tracks)
    EXPECT_EQ(row.rejected, row.frame == 3 ? "jump" : "") << "frame " << row.frame;
}

TEST(Track, RejectsATagThatIsReadTwice) {
  DrawnRecording drawn;
  cv::Mat twice;
  cv::min(drawn.draw(-80, 0), drawn.draw(80, 0), twice);
  drawn.add(twice);
  drawn.add(drawn.draw(-80, 0));

  const TrackResult result = drawn.track_it();

  EXPECT_EQ(result.tracks.size(), 8U) << "one row for a marker in a frame";
  EXPECT_EQ(result.rejected, (std::map<std::string, int>{{"duplicate_id", 4}}));
}

TEST(Track, TakesFaintReadingsByTheirOwnContrast) {
  // White is 14 grey levels above black; the margin of 20 is of a full contrast.
  DrawnRecording drawn;
  cv::Mat faint;
  drawn.draw(0, 0).convertTo(faint, CV_8UC1, 0.08, 100);
  drawn.add(faint);

  EXPECT_TRUE(drawn.track_it().rejected.empty());
}

TEST(Track, RejectsReadingsWeakerThanAskedFor) {
  DrawnRecording drawn;
  drawn.add(drawn.draw(0, 0));

  const TrackResult result = drawn.track_it({.min_decision_margin = 170});

  EXPECT_EQ(result.rejected, (std::map<std::string, int>{{"low_margin", 4}}));
}

TEST(Track, RejectsCornersAtTheBorderOfThePicture) {
  // The tag's left edge lies one pixel inside the picture.
  DrawnRecording drawn;
  const cv::Mat whole = drawn.draw(0, 0);
  drawn.add(whole.colRange(139, 320).clone());

  const TrackResult result = drawn.track_it();

  ASSERT_EQ(result.tracks.size(), 4U);
  for (const Position2d& row : result.tracks) {
    const bool left = row.marker == 0 || row.marker == 3;
    EXPECT_EQ(row.rejected, left ? "touching_border" : "") << "corner " << row.marker;
  }
}

TEST(Track, RejectsWhatIsPlacedWorseThanAskedFor) {
  DrawnRecording drawn;
  drawn.add(drawn.draw(0, 0));

  EXPECT_EQ(drawn.track_it({.max_sigma_px = 0.001}).rejected,
            (std::map<std::string, int>{{"uncertain", 4}}));
  EXPECT_EQ(drawn.track_it({.min_explained = 0.999}).rejected,
            (std::map<std::string, int>{{"pattern_mismatch", 4}}));
  EXPECT_FALSE(drawn.track_it({.min_explained = 0.999}).usable);
}

TEST(Track, RejectsACodeWithMoreWrongBitsThanAskedFor) {
  // One white cell of the code is painted black.
  DrawnRecording drawn;
  cv::Mat picture = drawn.draw(0, 0);
  const cv::Point2d middle(0.5 * (picture.cols - 1), 0.5 * (picture.rows - 1));
  constexpr double kCell = 5;  // px; 40 px over 8 cells
  bool painted = false;
  for (int row = -3; row < 3 && !painted; ++row) {
    for (int column = -3; column < 3 && !painted; ++column) {
      const cv::Rect cell(static_cast<int>(std::lround(middle.x + column * kCell)),
                          static_cast<int>(std::lround(middle.y + row * kCell)), 5, 5);
      if (cv::mean(picture(cell))[0] < 180) continue;
      picture(cell).setTo(40);
      painted = true;
    }
  }
  ASSERT_TRUE(painted);
  drawn.add(picture);

  EXPECT_TRUE(drawn.track_it().usable);
  const TrackResult strict = drawn.track_it({.max_corrected_bits = 0});
  EXPECT_EQ(strict.rejected, (std::map<std::string, int>{{"corrected_bits", 4}}));
}

TEST(Track, ListsEveryReasonOnceWithItsMeaning) {
  std::set<std::string> codes;
  for (const RejectionReason& reason : rejection_reasons()) {
    EXPECT_TRUE(codes.insert(reason.code).second) << reason.code;
    EXPECT_FALSE(reason.meaning.empty());
    EXPECT_EQ(reason.code.find_first_of(" ,:"), std::string::npos);
  }
}

TEST(Track, SaysWhatItLookedForAndWhatIsThereInstead) {
  DrawnRecording other_ids;
  other_ids.add(other_ids.draw(0, 0, 12));
  expect_error("tags 7 of tag36h11; tags 12 of that family do appear",
               [&] { other_ids.track_it(); });

  DrawnRecording other_family;
  cv::Mat three = other_family.draw(-100, 0, 1, "tag25h9");
  for (const int id : {2, 3})
    cv::min(three, other_family.draw(id == 2 ? 0 : 100, 0, id, "tag25h9"), three);
  other_family.add(three);
  expect_error("the first picture shows tags 1 to 3 of tag25h9", [&] { other_family.track_it(); });

  DrawnRecording nothing;
  nothing.add(cv::Mat(120, 320, CV_8UC1, cv::Scalar(200)));
  expect_error("no tag of the cloth appears in 1 pictures", [&] { nothing.track_it(); });
}

TEST(Track, SaysThatThePicturesAreMirroredOrInverted) {
  DrawnRecording mirrored;
  cv::Mat picture;
  cv::flip(mirrored.draw(0, 0), picture, 1);
  mirrored.add(picture);
  expect_error("the mirrored picture shows tags 7: switch mirroring off",
               [&] { mirrored.track_it(); });
  DrawnRecording inverted;
  inverted.add(255 - inverted.draw(0, 0));
  expect_error("with black and white exchanged the picture shows tags 7",
               [&] { inverted.track_it(); });
}

TEST(Track, LeavesOutDamagedPicturesAndKeepsTheTimesOfTheOthers) {
  DrawnRecording drawn;
  for (int n = 0; n < 5; ++n) drawn.add(drawn.draw(3 * n, 0));
  const std::filesystem::path frames = *drawn.recording().cameras[0].images;
  std::filesystem::resize_file(frames / "102.png", 200);
  std::filesystem::remove(frames / "103.png");

  const TrackResult result = drawn.track_it();

  std::set<int> seen;
  for (const Position2d& row : result.tracks) seen.insert(row.frame);
  EXPECT_EQ(seen, (std::set<int>{0, 1, 4}));
  EXPECT_EQ(result.frames, 5);
  std::string said;
  for (const Finding& finding : result.footage) said += finding.found + "\n";
  EXPECT_THAT(said, testing::HasSubstr("1 of 4 pictures are damaged and left out: frames 2"));
  EXPECT_THAT(said, testing::HasSubstr("1 of 5 frames have no picture: 3"));
}

TEST(Track, CountsMarkersThatItDidNotFindByReason) {
  DrawnRecording drawn;
  // Frame 3 hides the tag, 4 is nearly black, 5 has no picture, 6 is damaged. The tag, 40 px wide,
  // is cut by the picture's border in 10 and 11, and out of the picture from 12 on.
  for (int n = 0; n < 14; ++n) {
    cv::Mat picture = drawn.draw(20 * n - 60, 0);
    if (n == 3) picture.setTo(200);
    if (n == 4) picture *= 0.01;
    drawn.add(picture);
  }
  const std::filesystem::path frames = *drawn.recording().cameras[0].images;
  std::filesystem::remove(frames / "105.png");
  std::filesystem::resize_file(frames / "106.png", 200);

  const TrackResult result = drawn.track_it({.max_speed_px = 1000});

  const auto count = [&](const char* reason) {
    const auto found = result.missing.find(reason);
    return found == result.missing.end() ? 0 : found->second;
  };
  EXPECT_EQ(count("unread"), 4);
  EXPECT_EQ(count("dark"), 4);
  EXPECT_EQ(count("no_picture"), 4);
  EXPECT_EQ(count("damaged_picture"), 4);
  EXPECT_EQ(count("outside"), 8);
  int missing = 0;
  for (const auto& [reason, markers] : result.missing) missing += markers;
  EXPECT_EQ(missing + static_cast<int>(result.tracks.size()), 4 * result.frames);
}

TEST(Track, RefusesWhatItCannotTrack) {
  DrawnRecording drawn;
  expect_error("holds no picture", [&] { drawn.track_it(); });
  drawn.add(drawn.draw(0, 0));
  expect_error("max_speed_px", [&] { drawn.track_it({.max_speed_px = 0}); });
  expect_error("min_explained", [&] { drawn.track_it({.min_explained = 2}); });
  expect_error("max_corrected_bits", [&] { drawn.track_it({.max_corrected_bits = 3}); });

  drawn.recording().markers.family = "tag99";
  expect_error("unknown tag family 'tag99'", [&] { drawn.track_it(); });
  drawn.recording().markers.family = "tag16h5";  // has 30
  for (Marker& marker : drawn.recording().markers.markers) *marker.tag += 30;
  expect_error("there is no tag 37 in tag16h5", [&] { drawn.track_it(); });
  for (Marker& marker : drawn.recording().markers.markers) *marker.tag -= 30;
  drawn.recording().markers.family = "tag36h11";
  drawn.recording().markers.markers[1].corner = 0;
  expect_error("are the same corner 0 of tag 7", [&] { drawn.track_it(); });
  for (Marker& marker : drawn.recording().markers.markers) marker.tag.reset();
  expect_error("no marker is a corner of a tag", [&] { drawn.track_it(); });
  drawn.recording().cameras[0].images.reset();
  expect_error("camera 'front' has no images", [&] { drawn.track_it(); });
}

}  // namespace
}  // namespace clothfit
