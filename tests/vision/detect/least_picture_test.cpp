// Checks that every detector takes the smallest pictures that are read, and the narrowest strips.
// What it finds there is little, and is checked elsewhere with pictures of usual size.

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>
#include <string>

#include "tests/data/temporary_folder.h"
#include "tests/vision/dot_sheet.h"
#include "vision/detect/board_search.h"
#include "vision/detect/chessboard.h"
#include "vision/detect/dot_detector.h"
#include "vision/detect/tag_detector.h"
#include "vision/encode/encode_picture.h"
#include "vision/ingest/footage_watch.h"
#include "vision/ingest/picture_limits.h"
#include "vision/look/look.h"
#include "vision/texture/texture_tracker.h"

namespace clothfit {
namespace {

enum class Content { plain, noise, squares };

/// Fills a picture with what detectors look for.
cv::Mat filled(cv::Size size, Content content, int seed) {
  cv::Mat grey(size, CV_8UC1, cv::Scalar(120));
  if (content == Content::noise) {
    cv::RNG random(static_cast<std::uint64_t>(seed) + 1);
    random.fill(grey, cv::RNG::UNIFORM, 0, 256);
    cv::GaussianBlur(grey, grey, {}, 1);
  }
  constexpr int kSquare_px = 6;
  if (content == Content::squares)
    for (int y = 0; y < grey.rows; ++y)
      for (int x = 0; x < grey.cols; ++x)
        grey.at<std::uint8_t>(y, x) =
            ((y + seed) / kSquare_px + x / kSquare_px) % 2 == 0 ? 30 : 220;
  return grey;
}

/// Follows nine markers of a sheet that fills the picture.
void follow_texture(const cv::Mat& first, const cv::Mat& second) {
  std::vector<Marker> markers;
  std::vector<FirstPlace> places;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) {
      const double s = 0.1 + 0.4 * column, t = 0.1 + 0.4 * row;
      markers.push_back(
          {.name = std::to_string(markers.size()), .s_m = s, .t_m = t, .tag = {}, .corner = {}});
      places.push_back({.pixel_px = {s * first.cols, t * first.rows}, .sigma_px = 0});
    }
  TextureTracker tracker(TextureLayout(markers, places, 1, 1), first);
  tracker.next(second);
}

/// A size that is printed without blanks, which would cut the test's name in ctest's list of times.
struct PictureSize : cv::Size {
  using cv::Size::Size;
};

void PrintTo(const PictureSize& size, std::ostream* out) {
  *out << size.width << "x" << size.height;
}

class LeastPicture : public testing::TestWithParam<PictureSize> {};

TEST_P(LeastPicture, IsSearchedForAllThatIsPrinted) {
  for (const Content content : {Content::plain, Content::noise, Content::squares}) {
    SCOPED_TRACE(static_cast<int>(content));
    const cv::Mat grey = filled(GetParam(), content, 0);
    EXPECT_NO_THROW({
      find_chessboard(grey, {.columns = 9, .rows = 6, .square_m = 0.02});
      search_board(grey);
      find_dots(grey);
      find_dots(grey, {.bright = true});
      TagDetector("tag36h11").detect(grey);
      TagDetector("tag16h5").detect(grey);
      follow_texture(grey, filled(GetParam(), content, 1));
      FootageWatch watch;
      for (int frame = 0; frame < 3; ++frame) watch.see(filled(GetParam(), content, frame), frame);
    });
  }
}

class LeastFootage : public testing::TestWithParam<PictureSize> {};

TEST_P(LeastFootage, IsLookedAtForWhatItShows) {
  const TemporaryFolder folder;
  write_png(filled(GetParam(), Content::noise, 0), folder / "0.png");
  write_png(filled(GetParam(), Content::plain, 0), folder / "1.png");
  EXPECT_EQ(look(folder.path(), {}, {}).count, 2);
  const MarkerSet sheet = dot_markers(3, 3, 0.02, 0.02);
  LookOptions options;
  options.sheet = &sheet;
  EXPECT_EQ(look(folder.path(), options, {}).count, 2);
}

INSTANTIATE_TEST_SUITE_P(Sizes, LeastPicture,
                         testing::Values(PictureSize(kLeastSide_px, kLeastSide_px),
                                         PictureSize(kLeastSide_px, 4000),
                                         PictureSize(4000, kLeastSide_px), PictureSize(33, 47)));
INSTANTIATE_TEST_SUITE_P(Sizes, LeastFootage,
                         testing::Values(PictureSize(kLeastSide_px, kLeastSide_px),
                                         PictureSize(kLeastSide_px, 1000), PictureSize(33, 47)));

}  // namespace
}  // namespace clothfit
