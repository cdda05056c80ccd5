// Checks what is listed of footage that no recording describes.

#include "vision/look/look.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "data/input_error.h"
#include "tests/data/temporary_folder.h"
#include "tests/vision/synthetic_tag.h"
#include "vision/detect/board_search.h"

namespace clothfit {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// Draws three tags of a family, side by side and off by `shift_px`.
cv::Mat three_tags(const std::string& family, double shift_px) {
  std::mt19937_64 random(46);
  const SyntheticCamera view{.width = 320, .height = 120};
  cv::Mat picture;
  for (int id = 3; id < 6; ++id) {
    SyntheticTag tag = place_tag(view, 40, 0, 0, {100.0 * (id - 4) + shift_px, shift_px});
    tag.id = id;
    tag.family = family;
    const cv::Mat one = render(tag, view, random);
    picture = picture.empty() ? one : cv::Mat(cv::min(picture, one));
  }
  return picture;
}

/// Draws a chessboard of so many fields on grey, seen from the front.
cv::Mat board(int columns, int rows, double field_px, cv::Size size) {
  cv::Mat picture(size, CV_8UC1, cv::Scalar(220));
  const int left = static_cast<int>(0.2 * size.width), top = static_cast<int>(0.15 * size.height);
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c)
      if ((r + c) % 2 == 0)
        cv::rectangle(
            picture,
            cv::Rect(left + static_cast<int>(c * field_px), top + static_cast<int>(r * field_px),
                     static_cast<int>(field_px), static_cast<int>(field_px)),
            cv::Scalar(30), cv::FILLED);
  cv::GaussianBlur(picture, picture, {}, 0.8);
  return picture;
}

void write_pictures(const TemporaryFolder& folder, const std::vector<cv::Mat>& pictures) {
  for (size_t n = 0; n < pictures.size(); ++n)
    cv::imwrite((folder / (std::to_string(n) + ".png")).string(), pictures[n]);
}

TEST(Look, FindsTheFamilyAndTheTagsOfEveryPicture) {
  const TemporaryFolder folder;
  write_pictures(folder, {three_tags("tag25h9", 0), three_tags("tag25h9", 4),
                          three_tags("tag25h9", 8), three_tags("tag25h9", 12)});
  const LookResult result = look(folder.path(), {}, {});
  EXPECT_THAT(result.families, ElementsAre("tag25h9"));
  ASSERT_EQ(result.pictures.size(), 4U);
  for (const SeenPicture& picture : result.pictures) {
    ASSERT_EQ(picture.tags.size(), 3U) << picture.name;
    for (int t = 0; t < 3; ++t) {
      const SeenTag& seen = picture.tags[static_cast<size_t>(t)];
      EXPECT_EQ(seen.reading.tag.id, 3 + t);
      EXPECT_TRUE(seen.reading.good());
    }
  }
  EXPECT_EQ(result.overlays.size(), 3U) << "first, middle, last";
  EXPECT_EQ(result.turned, "");

  const LookResult every = look(folder.path(), {.families = {"tag25h9"}, .every = 3}, {});
  ASSERT_EQ(every.pictures.size(), 2U);
  EXPECT_EQ(every.pictures[1].frame, 3);
}

TEST(Look, SaysThatPicturesAreMirroredAndListsNothingOfThem) {
  const TemporaryFolder folder;
  cv::Mat picture;
  cv::flip(three_tags("tag36h11", 0), picture, 1);
  write_pictures(folder, {picture});
  const LookResult result = look(folder.path(), {}, {});
  EXPECT_THAT(result.families, IsEmpty());
  EXPECT_THAT(result.turned, HasSubstr("the mirrored picture shows tags 3 to 5"));
}

TEST(Look, FindsABoardWhoseSizeItWasNotTold) {
  const TemporaryFolder folder;
  write_pictures(folder, {board(8, 6, 30, {480, 320})});
  const LookResult result = look(folder.path(), {}, {});
  ASSERT_TRUE(result.pictures.at(0).board);
  EXPECT_EQ(result.pictures[0].board->columns, 7);
  EXPECT_EQ(result.pictures[0].board->rows, 5);
}

TEST(SearchBoard, PlacesCornersOfLargePicturesInTheirOwnPixels) {
  const auto seen = search_board(board(6, 9, 150, {1500, 1800}));
  ASSERT_TRUE(seen);
  EXPECT_EQ(seen->columns, 8);
  EXPECT_EQ(seen->rows, 5);
  // Fields begin at 0.2 and 0.15 of the picture; edges lie half a pixel before a pixel's centre.
  for (const Eigen::Vector2d& corner : seen->corner_px) {
    const double u = (corner.x() + 0.5 - 300) / 150, v = (corner.y() + 0.5 - 270) / 150;
    EXPECT_NEAR(u, std::round(u), 0.1 / 150);
    EXPECT_NEAR(v, std::round(v), 0.1 / 150);
  }
}

TEST(SearchBoard, FindsNoneWhereThereIsNone) {
  EXPECT_FALSE(search_board(cv::Mat(120, 160, CV_8UC1, cv::Scalar(128))));
  EXPECT_FALSE(search_board(three_tags("tag36h11", 0)));
}

TEST(Look, RefusesWhatItCannotLookAt) {
  const TemporaryFolder folder;
  EXPECT_THROW(look(folder.path(), {}, {}), InputError);
  write_pictures(folder, {three_tags("tag36h11", 0)});
  EXPECT_THROW(look(folder.path(), {.families = {"tag99"}}, {}), InputError);
  EXPECT_THROW(look(folder.path(), {.every = 0}, {}), InputError);
  EXPECT_EQ(look(folder / "0.png", {.families = {"tag36h11"}}, {}).pictures.size(), 1U);
}

}  // namespace
}  // namespace clothfit
