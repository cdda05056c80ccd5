// Checks the print at places of the flat sheet, and refusals. Its look in a picture is in
// render_cloth_test.cpp.

#include "vision/render/sheet_print.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "data/input_error.h"
#include "tests/vision/tag_sheet.h"
#include "vision/detect/tag_family.h"

namespace clothfit {
namespace {

const PrintOptions kBlackAndWhite{.paper = 1, .ink = 0};

void expect_refused(const std::string& part, const std::function<void()>& call) {
  SCOPED_TRACE(part);
  try {
    call();
    ADD_FAILURE() << "was accepted";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr(part));
  }
}

TEST(SheetPrint, LaysEachCellOfATagBetweenItsCorners) {
  const double width_m = 0.3;
  const MarkerSet markers = tag_markers(3, width_m);
  const SheetPrint print(markers, width_m, width_m, kBlackAndWhite);
  const TagFamily family = make_tag_family("tag36h11");

  for (const int tag : {0, 5}) {
    const TagPattern pattern = printed_tag(*family, tag);
    const Marker& bottom_right = markers.markers[static_cast<size_t>(4 * tag + 1)];
    const Marker& top_left = markers.markers[static_cast<size_t>(4 * tag + 3)];
    const double cell_m = (bottom_right.s_m - top_left.s_m) / pattern.border_cells;
    const int margin = (pattern.total_cells - pattern.border_cells) / 2;
    for (int row = 0; row < pattern.total_cells; ++row) {
      for (int column = 0; column < pattern.total_cells; ++column) {
        const double white = pattern.white[static_cast<size_t>(row * pattern.total_cells + column)];
        // The places are just inside two opposite corners of the cell.
        for (const double inside : {0.01, 0.99}) {
          EXPECT_EQ(print.reflectance({top_left.s_m + (column - margin + inside) * cell_m,
                                       top_left.t_m + (row - margin + inside) * cell_m}),
                    white)
              << "tag " << tag << ", row " << row << ", column " << column;
        }
      }
    }
  }
}

TEST(SheetPrint, TurnsATagWithItsCorners) {
  // The same tag is turned a quarter to the right: its top left corner now lies at the top right.
  const double width_m = 0.1;
  MarkerSet markers = tag_markers(1, width_m);
  const SheetPrint upright(markers, width_m, width_m, kBlackAndWhite);
  for (Marker& marker : markers.markers) {
    const double s_m = marker.s_m;
    marker.s_m = width_m - marker.t_m;
    marker.t_m = s_m;
  }
  const SheetPrint turned(markers, width_m, width_m, kBlackAndWhite);

  int black = 0;
  for (double t_m = 0.0013; t_m < width_m; t_m += 0.0031) {
    for (double s_m = 0.0017; s_m < width_m; s_m += 0.0029) {
      EXPECT_EQ(turned.reflectance({width_m - t_m, s_m}), upright.reflectance({s_m, t_m}));
      if (upright.reflectance({s_m, t_m}) == 0) ++black;
    }
  }
  EXPECT_GT(black, 100);
}

TEST(SheetPrint, FillsCirclesAroundDots) {
  const double width_m = 0.4, height_m = 0.2;
  MarkerSet markers{.kind = MarkerKind::dots, .family = "", .markers = {}, .index = {}};
  for (const double s_m : {0.05, 0.2, 0.35})
    markers.markers.push_back({.name = "m", .s_m = s_m, .t_m = 0.1});
  PrintOptions options = kBlackAndWhite;
  options.dot_radius_m = 0.01;
  const SheetPrint print(markers, width_m, height_m, options);

  const double step_m = 0.0005;
  double ink_m2 = 0;
  for (double t_m = step_m / 2; t_m < height_m; t_m += step_m)
    for (double s_m = step_m / 2; s_m < width_m; s_m += step_m)
      ink_m2 += (1 - print.reflectance({s_m, t_m})) * step_m * step_m;

  EXPECT_EQ(print.reflectance({0.2 + 0.0099, 0.1}), 0);
  EXPECT_EQ(print.reflectance({0.2 + 0.0101, 0.1}), 1);
  EXPECT_NEAR(ink_m2, 3 * M_PI * 0.01 * 0.01, 0.01 * 3 * M_PI * 0.01 * 0.01);  // counted in squares
}

TEST(SheetPrint, AveragesOverAFootprint) {
  // Rectangles along the tag's axes, from a part of a cell to more than two, are compared with the
  // mean of many places in them.
  const std::uint64_t seed = 1;
  SCOPED_TRACE(seed);
  const double width_m = 0.2;
  const MarkerSet markers = tag_markers(1, width_m);
  const SheetPrint print(markers, width_m, width_m, kBlackAndWhite);
  std::mt19937_64 rng(seed);
  std::uniform_real_distribution<double> unit(0, 1);

  for (const double side_m : {0.004, 0.015, 0.04}) {  // a cell is 18 mm
    for (int i = 0; i < 30; ++i) {
      const Eigen::Vector2d place_m(width_m * unit(rng), width_m * unit(rng));
      const Eigen::Matrix2d footprint_m = Eigen::Vector2d(side_m, 0.7 * side_m).asDiagonal();
      constexpr int kPlaces = 60;
      double mean = 0;
      for (int k = 0; k < kPlaces * kPlaces; ++k) {
        const Eigen::Vector2d share((k % kPlaces + 0.5) / kPlaces - 0.5,
                                    (k / kPlaces + 0.5) / kPlaces - 0.5);
        const Eigen::Vector2d there_m = place_m + footprint_m * share;
        mean += print.reflectance(there_m) / (kPlaces * kPlaces);
      }
      EXPECT_NEAR(print.reflectance(place_m, footprint_m), mean, 0.03);  // 1 / 60 an edge
    }
  }
}

TEST(SheetPrint, RefusesWhatCannotBePrinted) {
  const double width_m = 0.3;
  const MarkerSet good = tag_markers(3, width_m);
  const auto print = [&](const std::function<void(MarkerSet&)>& spoil) {
    return [&, spoil] {
      MarkerSet markers = good;
      spoil(markers);
      SheetPrint(markers, width_m, width_m);
    };
  };
  expect_refused("unknown tag family 'tag99'", print([](MarkerSet& m) { m.family = "tag99"; }));
  expect_refused("tag 4 has no marker at its corner 2",
                 print([](MarkerSet& m) { m.markers.erase(m.markers.begin() + 18); }));
  expect_refused("there is no tag 587 in tag36h11", print([](MarkerSet& m) {
                   for (size_t c = 0; c < 4; ++c) m.markers[c].tag = 587;
                 }));
  expect_refused("corners of tag 0 are not a rectangle's",
                 print([](MarkerSet& m) { m.markers[2].s_m += 0.01; }));
  expect_refused("corners of tag 0 are not a rectangle's", print([](MarkerSet& m) {
                   std::swap(m.markers[0].corner, m.markers[1].corner);  // a mirror image
                   std::swap(m.markers[2].corner, m.markers[3].corner);
                 }));
  MarkerSet textured = good;
  textured.kind = MarkerKind::texture;
  expect_refused("finest_m",
                 [&] { SheetPrint(textured, width_m, width_m, {.texture = {.finest_m = 0}}); });
  expect_refused("size = [0, 1]", [&] { SheetPrint(good, 0, 1); });
  expect_refused("paper", [&] { SheetPrint(good, width_m, width_m, {.paper = 1.5}); });
  expect_refused("dot_radius_m", [&] { SheetPrint(good, width_m, width_m, {.dot_radius_m = 0}); });
}

TEST(SheetPrint, CoversASheetWithASeededTextureOfTheStatedContrast) {
  const MarkerSet markers{.kind = MarkerKind::texture, .family = {}, .markers = {}, .index = {}};
  for (const TexturePattern pattern : {TexturePattern::noise, TexturePattern::weave}) {
    SCOPED_TRACE(static_cast<int>(pattern));
    const ClothTextureOptions texture{.pattern = pattern, .seed = 3, .contrast = 0.1};
    const SheetPrint print(markers, 0.2, 0.2, {.texture = texture});
    const SheetPrint again(markers, 0.2, 0.2, {.texture = texture});
    double sum = 0, squares = 0;
    constexpr int kAcross = 60;
    for (int i = 0; i < kAcross; ++i)
      for (int j = 0; j < kAcross; ++j) {
        const Eigen::Vector2d place_m = 0.2 / kAcross * Eigen::Vector2d(j + 0.3, i + 0.3);
        const double value = print.reflectance(place_m);
        EXPECT_EQ(value, again.reflectance(place_m));
        sum += value;
        squares += value * value;
      }
    const double mean = sum / (kAcross * kAcross);
    const double spread = std::sqrt(squares / (kAcross * kAcross) - mean * mean);
    EXPECT_NEAR(mean, texture.mean, 0.01);
    // A weave's checks add a quarter of the variance.
    EXPECT_NEAR(spread, texture.mean * texture.contrast, 0.2 * texture.mean * texture.contrast);
  }
}

TEST(SheetPrint, LaysTagsWithTheirMarginsOnATexture) {
  MarkerSet markers = tag_markers(2, 0.2);
  markers.kind = MarkerKind::texture;
  const SheetPrint print(markers, 0.2, 0.2);
  // The margin is a cell wide, an eighth of the border's 72 mm.
  EXPECT_DOUBLE_EQ(print.reflectance({0.05, 0.05 - 0.036 - 0.0045}), PrintOptions().paper);
  EXPECT_DOUBLE_EQ(print.reflectance({0.05, 0.05 - 0.036 + 0.0045}), PrintOptions().ink);
}

}  // namespace
}  // namespace clothfit
