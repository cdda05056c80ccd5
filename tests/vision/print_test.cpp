// Checks that sheets are printed where their markers say, at true scale, and spread over pages.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <opencv2/imgproc.hpp>

#include "data/input_error.h"
#include "tests/data/file_bytes.h"
#include "tests/data/temporary_folder.h"
#include "vision/detect/board_search.h"
#include "vision/detect/tag_detector.h"
#include "vision/ingest/decode_picture.h"
#include "vision/print/draw_sheet.h"
#include "vision/track/dot_tracks.h"

namespace clothfit {
namespace {

using testing::HasSubstr;

constexpr double kDotsPerInch = 100;
constexpr double kPixelsPerMetre = kDotsPerInch / 0.0254;

cv::Mat printed(const PrintedSheet& sheet, bool mirrored = false) {
  const TemporaryFolder folder;
  write_sheet_png(sheet, {.mirrored = mirrored, .dots_per_inch = kDotsPerInch}, folder / "a.png");
  cv::Mat picture = decode_picture(folder / "a.png").grey;
  cv::GaussianBlur(picture, picture, {}, 1);  // as a lens does
  return picture;
}

/// Largest distance (px) of tags' corners in a picture from the places of their markers.
double worst_corner_px(const PrintedSheet& sheet, const cv::Mat& picture) {
  std::map<std::pair<int, int>, Eigen::Vector2d> found;
  for (const TagDetection& tag : TagDetector(sheet.markers.family, 0).detect(picture))
    for (int c = 0; c < 4; ++c) found[{tag.id, c}] = tag.corner_px[static_cast<size_t>(c)];
  double worst_px = 0;
  for (const Marker& marker : sheet.markers.markers) {
    const auto corner = found.find({*marker.tag, *marker.corner});
    if (corner == found.end()) return INFINITY;
    // The sheet's corner is the outer corner of the first pixel.
    const Eigen::Vector2d place_px =
        kPixelsPerMetre * Eigen::Vector2d(marker.s_m, marker.t_m) - Eigen::Vector2d(0.5, 0.5);
    worst_px = std::max(worst_px, (corner->second - place_px).norm());
  }
  return worst_px;
}

TEST(TagSheet, PrintsTagsWhereTheirMarkersAre) {
  for (const TagSheetOptions& options :
       {TagSheetOptions{.width_m = 0.2, .height_m = 0.15, .columns = 4, .rows = 3},
        TagSheetOptions{.width_m = 0.12,
        .height_m = 0.12,
        .columns = 2,
        .rows = 2,
        .family = "tag25h9",
        .first_id = 7,
        .tag_m = 0.03}}) {
    const PrintedSheet sheet = make_tag_sheet(options);
    EXPECT_EQ(sheet.markers.markers.size(),
              4U * static_cast<size_t>(options.columns * options.rows));
    EXPECT_LT(worst_corner_px(sheet, printed(sheet)), 0.1);
  }
}

TEST(TagSheet, IsMirroredForTransferPaper) {
  const PrintedSheet sheet =
      make_tag_sheet({.width_m = 0.1, .height_m = 0.1, .columns = 2, .rows = 2});
  cv::Mat back;
  cv::flip(printed(sheet, true), back, 1);
  EXPECT_TRUE(TagDetector("tag36h11", 0).detect(printed(sheet, true)).empty());
  EXPECT_LT(worst_corner_px(sheet, back), 1) << "a picture ends on a whole pixel";
}

TEST(TagSheet, RefusesWhatDoesNotFit) {
  EXPECT_THROW(make_tag_sheet({.family = "tag99"}), InputError);
  EXPECT_THROW(make_tag_sheet({.columns = 30, .rows = 30}), InputError);
  EXPECT_THROW(make_tag_sheet({.tag_m = 0.045}), InputError);
  EXPECT_THROW(make_tag_sheet({.width_m = -1}), InputError);
  EXPECT_THROW(make_tag_sheet({.tag_m = -0.03}), InputError);
  EXPECT_THROW(make_tag_sheet({.width_m = 400, .height_m = 400}), InputError) << "millimetres";
  EXPECT_THROW(make_tag_sheet({.first_id = 580}), InputError);
  EXPECT_THROW(make_tag_sheet({.columns = 0}), InputError);
}

/// Largest distance (px) of dots that a tracker names in a picture from the places of their
/// markers.
double worst_dot_px(const PrintedSheet& sheet, const cv::Mat& picture) {
  const DotFrame frame = DotTracker(sheet.markers, "markers.csv").next(picture);
  if (frame.dots.size() < sheet.markers.markers.size()) return INFINITY;
  double worst_px = 0;
  for (const DotRow& dot : frame.dots) {
    const Marker& marker = sheet.markers.markers[static_cast<size_t>(dot.marker)];
    const Eigen::Vector2d place_px =
        kPixelsPerMetre * Eigen::Vector2d(marker.s_m, marker.t_m) - Eigen::Vector2d(0.5, 0.5);
    worst_px = std::max(worst_px, (dot.pixel_px - place_px).norm());
  }
  return worst_px;
}

TEST(DotSheet, PrintsDotsWhereATrackerFindsTheirMarkers) {
  for (const DotSheetOptions& options :
       {DotSheetOptions{.width_m = 0.16, .height_m = 0.12, .columns = 8, .rows = 6},
        DotSheetOptions{.width_m = 0.11, .height_m = 0.15, .columns = 5, .rows = 7}}) {
    const PrintedSheet sheet = make_dot_sheet(options);
    ASSERT_EQ(sheet.markers.markers.size(), static_cast<size_t>(options.columns * options.rows));
    EXPECT_LT(worst_dot_px(sheet, printed(sheet)), 0.1);
  }
}

TEST(DotSheet, LiesInTheMiddleOfTheClothWithTheSameSpacingBothWays) {
  const PrintedSheet sheet =
      make_dot_sheet({.width_m = 0.11, .height_m = 0.15, .columns = 5, .rows = 7});
  const double spacing_m = 0.15 / 7;
  EXPECT_NEAR(sheet.markers.markers[1].s_m - sheet.markers.markers[0].s_m, spacing_m, 1e-12);
  EXPECT_NEAR(sheet.markers.markers[5].t_m - sheet.markers.markers[0].t_m, spacing_m, 1e-12);
  EXPECT_NEAR(sheet.markers.markers[0].s_m + sheet.markers.markers[4].s_m, 0.11, 1e-12);
  EXPECT_EQ(usual_dot_grid(0.4, 0.3), std::pair(16, 12));
  EXPECT_EQ(usual_dot_grid(0.4, 0.4), std::pair(16, 16));
}

TEST(DotSheet, RefusesWhatCannotBePrintedOrNamed) {
  EXPECT_THROW(make_dot_sheet({.columns = 2, .rows = 2}), InputError);
  EXPECT_THROW(make_dot_sheet({.columns = 65, .rows = 65}), InputError);
  EXPECT_THROW(make_dot_sheet({.width_m = 0.04, .height_m = 0.04}), InputError) << "0.7 mm wide";
  EXPECT_THROW(make_dot_sheet({.width_m = 0.4, .height_m = 0.2}), InputError) << "16 x 8 fit";
  EXPECT_THROW(make_dot_sheet({.width_m = 40, .height_m = 40}), InputError);
}

TEST(BoardSheet, PrintsABoardOfThatSize) {
  const PrintedSheet sheet = make_board_sheet({.columns = 9, .rows = 6, .square_m = 0.02});
  const auto seen = search_board(printed(sheet));
  ASSERT_TRUE(seen);
  EXPECT_EQ(seen->columns, 9);
  EXPECT_EQ(seen->rows, 6);
  EXPECT_NEAR((seen->corner_px[8] - seen->corner_px[0]).norm(), 8 * 0.02 * kPixelsPerMetre, 0.1);
  EXPECT_EQ(page_count(sheet, "a4"), 1);
  EXPECT_EQ(page_count(sheet, "letter"), 1);
  EXPECT_THROW(make_board_sheet({.columns = 3, .rows = 6, .square_m = 0.02}), InputError);
  EXPECT_THROW(make_board_sheet({.columns = 9, .rows = 6, .square_m = 20}), InputError);
}

TEST(PageSpans, ShowEveryPartAndCutNoShare) {
  constexpr double kMargin = 12, kRoom = 190;
  for (const double share : {17.0, 50.0, 133.0, 160.0})
    for (const int shares : {1, 2, 3, 5, 8, 13}) {
      const double length = shares * share + 2 * kMargin;
      const std::vector<PageSpan> spans = page_spans(length, kMargin, share, kRoom);
      EXPECT_EQ(spans.front().begin_mm, 0);
      EXPECT_EQ(spans.back().end_mm, length);
      for (size_t i = 0; i < spans.size(); ++i) {
        EXPECT_LE(spans[i].end_mm - spans[i].begin_mm, kRoom + 1e-6);
        if (i == 0) continue;
        EXPECT_NEAR(spans[i - 1].end_mm - spans[i].begin_mm, 2 * kPageOverlap_mm, 1e-9);
        const double cut = (spans[i].begin_mm + kPageOverlap_mm - kMargin) / share;
        EXPECT_NEAR(cut, std::round(cut), 1e-9) << share << " " << shares;
      }
    }
  EXPECT_EQ(page_spans(700, kMargin, 400, kRoom).size(), 4U) << "a share larger than a page is cut";
  EXPECT_EQ(page_spans(190, kMargin, 50, kRoom).size(), 1U);
}

TEST(DrawSheet, WritesPagesOfPaperAndAnSvgInMillimetres) {
  const TemporaryFolder folder;
  const PrintedSheet sheet = make_tag_sheet({});
  write_sheet_pdf(sheet, {}, folder / "a.pdf");
  const std::string pdf = file_bytes(folder / "a.pdf");
  EXPECT_TRUE(pdf.starts_with("%PDF"));
  int pages = 0;
  for (size_t at = 0; (at = pdf.find("/Type /Page ", at)) != std::string::npos; ++at) ++pages;
  for (size_t at = 0; (at = pdf.find("/Type /Page\n", at)) != std::string::npos; ++at) ++pages;
  EXPECT_EQ(pages, page_count(sheet, "a4"));
  EXPECT_THAT(pdf, HasSubstr("595.27"));  // 210 mm in points
  write_sheet_svg(sheet, {}, folder / "a.svg");
  EXPECT_THAT(file_bytes(folder / "a.svg"), HasSubstr("width=\"424mm\""));
  EXPECT_THROW(write_sheet_pdf(sheet, {.paper = "b7"}, folder / "b.pdf"), InputError);
  EXPECT_THROW(write_sheet_png(sheet, {.dots_per_inch = 5}, folder / "b.png"), InputError);
  EXPECT_THROW(write_sheet_pdf(sheet, {}, folder / "none" / "b.pdf"), InputError);
}

TEST(DrawSheet, GivesALargeSheetFewerDotsPerInch) {
  EXPECT_EQ(png_dots_per_inch(make_tag_sheet({}), {}), 300);
  EXPECT_NEAR(png_dots_per_inch(make_tag_sheet({.width_m = 3, .height_m = 2}), {}),
              12'000 / (3 / 0.0254), 1e-9);
}

}  // namespace
}  // namespace clothfit
