// Checks what is listed of footage that no recording describes.

#include "vision/look/look.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "data/input_error.h"
#include "tests/data/temporary_folder.h"
#include "tests/vision/synthetic_tag.h"
#include "vision/detect/board_search.h"
#include "vision/encode/encode_picture.h"
#include "vision/ingest/decode_picture.h"
#include "vision/look/sheet_match.h"
#include "vision/print/draw_sheet.h"

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
    write_png(pictures[n], folder / (std::to_string(n) + ".png"));
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

/// Draws a sheet of dots of so many pixels a metre, turned by quarter turns.
cv::Mat drawn_dots(const PrintedSheet& sheet, double pixels_per_metre, int quarter_turns) {
  const TemporaryFolder folder;
  write_sheet_png(sheet, {.dots_per_inch = pixels_per_metre * 0.0254}, folder / "a.png");
  cv::Mat picture = decode_picture(folder / "a.png").grey;
  cv::copyMakeBorder(picture, picture, 30, 30, 30, 30, cv::BORDER_CONSTANT, cv::Scalar(255));
  for (int turn = 0; turn < quarter_turns; ++turn)
    cv::rotate(picture, picture, cv::ROTATE_90_CLOCKWISE);
  return picture;
}

TEST(Look, NamesDotsByAPatternWhoseSizeItWasNotTold) {
  const PrintedSheet sheet =
      make_dot_sheet({.width_m = 0.16, .height_m = 0.12, .columns = 8, .rows = 6});
  const TemporaryFolder folder;
  const cv::Mat upright = drawn_dots(sheet, 2500, 0);
  cv::Mat part = upright.clone();
  part.colRange(0, 180).setTo(255);  // the first column and more
  write_pictures(folder, {upright, part});
  const LookResult result = look(folder.path(), {}, {});
  ASSERT_TRUE(result.pattern);
  EXPECT_EQ(result.pattern->columns, 8);
  EXPECT_EQ(result.pattern->rows, 6);
  ASSERT_EQ(result.pictures.size(), 2U);
  ASSERT_EQ(result.pictures[0].dots.size(), 48U);
  ASSERT_EQ(result.pictures[1].dots.size(), 30U) << "three columns are covered";
  for (const SeenPicture& picture : result.pictures)
    for (const SeenDot& dot : picture.dots) {
      ASSERT_TRUE(dot.named());
      const Marker& marker =
          sheet.markers.markers.at(static_cast<size_t>(dot.row * 8 + dot.column));
      const Eigen::Vector2d place_px =
          2500 * Eigen::Vector2d(marker.s_m, marker.t_m) + Eigen::Vector2d(29.5, 29.5);
      EXPECT_LT((dot.pixel_px - place_px).norm(), 0.1);
    }

  const TemporaryFolder turned;
  write_pictures(turned, {drawn_dots(sheet, 2500, 1)});
  const LookResult lying = look(turned.path(), {}, {});
  ASSERT_TRUE(lying.pattern);
  EXPECT_EQ(lying.pattern->columns, 8);
}

TEST(Look, ListsNoDotsWhereThereAreTagsOrTexture) {
  const TemporaryFolder folder;
  cv::Mat noise(240, 320, CV_8UC1);
  cv::RNG random(7);
  random.fill(noise, cv::RNG::UNIFORM, 0, 255);
  cv::GaussianBlur(noise, noise, {}, 2);
  write_pictures(folder, {noise});
  EXPECT_THAT(look(folder.path(), {}, {}).pictures.at(0).dots, IsEmpty());
  const TemporaryFolder tags;
  write_pictures(tags, {three_tags("tag36h11", 0)});
  EXPECT_THAT(look(tags.path(), {}, {}).pictures.at(0).dots, IsEmpty());
}

TEST(Look, ListsNoIdsThatNoPictureShowsWell) {
  const TemporaryFolder folder;
  cv::Mat noise(480, 640, CV_8UC1);
  cv::RNG random(3);
  random.fill(noise, cv::RNG::UNIFORM, 0, 255);
  cv::GaussianBlur(noise, noise, {}, 4);
  cv::normalize(noise, noise, 0, 255, cv::NORM_MINMAX);
  write_pictures(folder, {noise});
  const LookResult result = look(folder.path(), {.families = {"tag16h5"}}, {});
  EXPECT_THAT(result.pictures.at(0).tags, IsEmpty());
}

/// Returns what a picture of a printed sheet shows, tags or dots of it.
LookResult looked_at(const PrintedSheet& filmed, const MarkerSet& sheet) {
  const TemporaryFolder folder;
  cv::Mat picture = drawn_dots(filmed, 2500, 0);
  cv::GaussianBlur(picture, picture, {}, 1);
  write_pictures(folder, {picture});
  LookOptions options{.boards = false, .dots = false};
  if (!sheet.family.empty()) options.families = {sheet.family};
  if (sheet.kind == MarkerKind::dots) options.sheet = &sheet;
  return look(folder.path(), options, {});
}

TEST(SheetMatch, TellsAnotherSheetByWhereItsTagsLie) {
  const PrintedSheet four =
      make_tag_sheet({.width_m = 0.2, .height_m = 0.2, .columns = 4, .rows = 4});
  const PrintedSheet eight =
      make_tag_sheet({.width_m = 0.2, .height_m = 0.05, .columns = 8, .rows = 2});
  const SheetMatch right = match_sheet(looked_at(four, four.markers), four.markers);
  EXPECT_EQ(right.shown, 16);
  EXPECT_GT(right.pairs, 40);
  EXPECT_EQ(right.misplaced, 0);
  EXPECT_FALSE(right.is_another());
  const SheetMatch wrong = match_sheet(looked_at(four, eight.markers), eight.markers);
  EXPECT_EQ(wrong.shown, 16) << "the ids are the same";
  EXPECT_TRUE(wrong.is_another());
}

TEST(SheetMatch, CountsTagsThatTheSheetDoesNotList) {
  const PrintedSheet filmed =
      make_tag_sheet({.width_m = 0.2, .height_m = 0.2, .columns = 4, .rows = 4});
  const PrintedSheet sheet = make_tag_sheet({.columns = 4, .rows = 4, .first_id = 12});
  const SheetMatch match = match_sheet(looked_at(filmed, sheet.markers), sheet.markers);
  EXPECT_EQ(match.listed, 16);
  EXPECT_EQ(match.shown, 4);
  EXPECT_EQ(match.others.size(), 12U);
  EXPECT_TRUE(match.is_another());
}

TEST(SheetMatch, NamesTheDotsOfItsOwnSheetAlone) {
  const PrintedSheet sheet =
      make_dot_sheet({.width_m = 0.16, .height_m = 0.12, .columns = 8, .rows = 6});
  const PrintedSheet other =
      make_dot_sheet({.width_m = 0.18, .height_m = 0.12, .columns = 9, .rows = 6});
  EXPECT_EQ(match_sheet(looked_at(sheet, sheet.markers), sheet.markers).shown, 48);
  EXPECT_EQ(match_sheet(looked_at(sheet, other.markers), other.markers).shown, 0);
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

TEST(SearchBoard, TakesNoGridOfTagsOrMarkersForABoard) {
  cv::Mat marked = board(8, 6, 60, {800, 560});
  ASSERT_TRUE(search_board(marked));
  // Each bright field carries a mark, as on a ChArUco board.
  for (int r = 0; r < 6; ++r)
    for (int c = 0; c < 8; ++c)
      if ((r + c) % 2 == 1)
        cv::rectangle(marked, cv::Rect(160 + c * 60 + 14, 84 + r * 60 + 14, 32, 32), cv::Scalar(30),
                      cv::FILLED);
  EXPECT_FALSE(search_board(marked));
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
