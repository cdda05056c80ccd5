// Checks where textured markers are taken to lie in frame 0, and what is refused.

#include "vision/texture/first_places.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "calib/camera/projection.h"
#include "data/input_error.h"
#include "tests/data/temporary_folder.h"
#include "tests/vision/tag_sheet.h"
#include "vision/render/render_cloth.h"
#include "vision/render/true_markers.h"

namespace clothfit {
namespace {

constexpr double kWidth_m = 0.24;

/// A flat textured sheet before a camera with a lens, seen from aside.
class FirstPlaces : public ::testing::Test {
 protected:
  FirstPlaces() : camera_(camera_before(0.9, 700, 320, 310)) {
    camera_.model = CameraModel::brown_conrady;
    camera_.distortion = {-0.2, 0.05, 5e-4, -3e-4};
    recording_.folder = folder_.path();
    recording_.markers = tag_markers(4, kWidth_m);
    recording_.markers.kind = MarkerKind::texture;
    recording_.markers_file = folder_ / "markers.csv";
    recording_.cloth.width_m = recording_.cloth.height_m = kWidth_m;
    recording_.start = StartKind::released_flat;
    // Tags 0, 3, 12 and 15 stay as anchors.
    for (Marker& marker : recording_.markers.markers)
      if (*marker.tag != 0 && *marker.tag != 3 && *marker.tag != 12 && *marker.tag != 15)
        marker.tag = marker.corner = std::nullopt;
    write_camera(camera_, folder_ / "front.yaml");
    entry_ = {.name = "front", .file = folder_ / "front.yaml", .images = {}, .calibration = {}};
    print_.emplace(recording_.markers, kWidth_m, kWidth_m);
    sheet_ = place_sheet(*print_, 2, [](double s, double t) {
      return Eigen::Vector3d(s - 0.5 * kWidth_m, 0.4 * t + 0.2 * s, 0.5 * kWidth_m - t);
    });
    truth_ = true_markers(camera_, std::vector<PlacedSheet>{sheet_}, 0, recording_.markers.markers);
  }
  cv::Mat picture() const {
    const std::vector<std::vector<PlacedSheet>> instants = {{sheet_}};
    return render_cloth(CameraRays(camera_), instants, {.noise_levels = 1}, 3);
  }
  /// Gives some markers rows of frame 0 where they truly are.
  void write_rows(const std::vector<size_t>& markers, double off_px = 0) {
    std::ofstream file(folder_ / "front.csv");
    file << "frame,marker,u,v\n";
    for (const size_t m : markers)
      file << "0," << recording_.markers.markers[m].name << ',' << truth_[m].pixel_px.x() + off_px
           << ',' << truth_[m].pixel_px.y() << '\n';
    recording_.tracks2d["front"] = folder_ / "front.csv";
  }
  void without_tags() {
    for (Marker& marker : recording_.markers.markers) marker.tag = marker.corner = std::nullopt;
  }
  void expect_refused(const std::string& text) {
    try {
      find_first_places(recording_, entry_, cv::Mat::zeros(310, 320, CV_8UC1));
      ADD_FAILURE() << "was accepted, not refused with " << text;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), ::testing::HasSubstr(text));
    }
  }

  TemporaryFolder folder_;
  CameraParameters camera_;
  Recording recording_;
  CameraEntry entry_;
  std::optional<SheetPrint> print_;
  PlacedSheet sheet_;
  std::vector<TrueMarker> truth_;
};

TEST_F(FirstPlaces, FollowFromAnchorTagsOnAFlatSheet) {
  const std::vector<FirstPlace> places = find_first_places(recording_, entry_, picture());
  double scaled = 0;
  for (size_t m = 0; m < places.size(); ++m) {
    const double off_px = (places[m].pixel_px - truth_[m].pixel_px).norm();
    EXPECT_LT(off_px, 0.15);
    scaled += off_px * off_px / (2 * places[m].sigma_px * places[m].sigma_px);
  }
  // Eight numbers of the homography place most of the markers, so that this varies by a half.
  EXPECT_LT(std::sqrt(scaled / static_cast<double>(places.size())), 2);
}

TEST_F(FirstPlaces, FollowFromRowsOfFrame0AndTheLens) {
  without_tags();
  write_rows({0, 14, 50, 61, 33});
  const std::vector<FirstPlace> places =
      find_first_places(recording_, entry_, cv::Mat::zeros(310, 320, CV_8UC1));
  for (size_t m = 0; m < places.size(); ++m)
    EXPECT_LT((places[m].pixel_px - truth_[m].pixel_px).norm(), 0.01);
  EXPECT_EQ(places[14].sigma_px, 0);
  EXPECT_GT(places[15].sigma_px, 0);
}

TEST_F(FirstPlaces, OfABentSheetNeedARowForEveryMarker) {
  without_tags();
  recording_.start = StartKind::unknown;
  std::vector<size_t> all;
  for (size_t m = 0; m < truth_.size(); ++m) all.push_back(m);
  write_rows(all);
  EXPECT_EQ(find_first_places(recording_, entry_, cv::Mat::zeros(310, 320, CV_8UC1)).size(),
            truth_.size());
  all.pop_back();
  write_rows(all);
  expect_refused("nothing says where marker 't15_3' lies in frame 0");
}

TEST_F(FirstPlaces, AreRefusedWhereTheyAreTooFewOrContradictAFlatSheet) {
  without_tags();
  expect_refused("0 markers have a place in frame 0, and 't0_0' has none");
  write_rows({0, 14, 50});
  expect_refused("3 markers have a place in frame 0");
  write_rows({0, 1, 4, 5, 8, 9});  // all on the lower line of the first row of tags
  expect_refused("four known markers that are not on a line");
  write_rows({0, 14, 50, 61, 33, 20, 40});
  recording_.markers.markers[33].s_m += 0.02;
  expect_refused("px from where the other 6 known markers of frame 0 place it");
  write_rows({0, 14, 50, 61, 33}, 400);
  expect_refused("lies outside the picture");
}

TEST_F(FirstPlaces, OfTagsNeedTheirFamily) {
  recording_.markers.family.clear();
  expect_refused("markers carry tags of no family");
}

}  // namespace
}  // namespace clothfit
