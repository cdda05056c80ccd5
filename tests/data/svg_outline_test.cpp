// Checks outlines from SVG drawings: units, transforms, curves, corners and refusals, and what a
// pattern makes of them. That outlines do not cross themselves, pattern_outline_test checks.

#include "data/svg_outline.h"

#include <gtest/gtest.h>

#include <numbers>

#include "data/pattern_file.h"
#include "tests/data/expect_refused.h"
#include "tests/data/outline_measures.h"

namespace clothfit {
namespace {

constexpr double kPi = std::numbers::pi;
const std::string kMillimetres = R"(<svg width="200mm" height="100mm" viewBox="0 0 200 100">)";

class SvgOutline : public testing::Test {
 protected:
  PanelOutline read(const std::string& head, const std::string& body,
                    std::optional<double> unit_m = std::nullopt) {
    return read_svg_outline(folder_.write("a.svg", head + "\n" + body + "\n</svg>"), "p", unit_m);
  }
  PanelOutline read_path(const std::string& data, const std::string& more = "") {
    return read(kMillimetres, "<path id='p' d='" + data + "' " + more + "/>");
  }
  void expect_refusal(const std::string& beginning, const std::string& body,
                      const std::string& head = kMillimetres) {
    expect_refused(folder_, beginning, [&] { read(head, body); });
  }

  TemporaryFolder folder_;
};

TEST_F(SvgOutline, TakesMillimetresFromWidthAndViewBox) {
  const PanelOutline outline =
      read(kMillimetres, "<rect id='p' x='10' y='20' width='80' height='30'/>");
  Eigen::Matrix2Xd expected(2, 4);  // from the upper left corner counterclockwise, y upwards
  expected << -0.04, -0.04, 0.04, 0.04, 0.015, -0.015, -0.015, 0.015;
  EXPECT_LT((outline.corner_m - expected).norm(), 1e-15);
  EXPECT_EQ(outline.begin_at_corner, (std::vector{0, 1, 2, 3}));
  EXPECT_NEAR(outline_area_m2(outline), 0.08 * 0.03, 1e-15);
}

TEST_F(SvgOutline, TakesUnitsWhereTheyAreGiven) {
  const std::string rect = "<rect id='p' width='96' height='48'/>";
  const auto width_m = [&](const std::string& head, std::optional<double> unit_m = std::nullopt) {
    const PanelOutline outline = read(head, rect, unit_m);
    return outline.corner_m.row(0).maxCoeff() - outline.corner_m.row(0).minCoeff();
  };
  EXPECT_NEAR(width_m("<svg>"), 0.0254, 1e-15);
  EXPECT_NEAR(width_m("<svg width='5cm' height='5cm'>"), 0.0254, 1e-15);
  EXPECT_NEAR(width_m("<svg viewBox='0 0 5 5' width='100%'>"), 0.0254, 1e-15);
  EXPECT_NEAR(width_m("<svg viewBox='0,0,100,50' height='50pt'>"), 96 * 0.0254 / 72, 1e-15);
  EXPECT_NEAR(width_m("<svg viewBox='0 0 100 50' width='200'>"), 2 * 0.0254, 1e-15);
  EXPECT_NEAR(width_m("<svg viewBox='0 0 100 50' width='100cm' height='50cm'>"), 0.96, 1e-15);
  EXPECT_NEAR(width_m(kMillimetres, 0.01), 0.96, 1e-15);
}

TEST_F(SvgOutline, MakesCirclesOfArcs) {
  const PanelOutline two = read_path("M30 50 A20 20 0 0 1 70 50 A20 20 0 0 1 30 50 Z");
  ASSERT_EQ(two.edges.size(), 2U);
  EXPECT_NEAR(two.edges[0].bulge, 1, 1e-12);
  EXPECT_NEAR(outline_length_m(two), 2 * kPi * 0.02, 1e-9);
  EXPECT_EQ(two.begin_at_corner, std::vector{0});
  // One arc that is almost a circle, its flags without separators, and radii that do not reach.
  const PanelOutline one = read_path("m30 50a20 20 0 11.0001 0z");
  EXPECT_NEAR(outline_length_m(one), 2 * kPi * 0.02, 1e-6);
  const PanelOutline enlarged = read_path("M30 50A5 5 0 0 1 70 50A5 5 0 0 1 30 50");
  EXPECT_NEAR(outline_length_m(enlarged), 2 * kPi * 0.02, 1e-9);
}

TEST_F(SvgOutline, MakesCurvesOfSkewedArcsAndEllipses) {
  const std::string circle = "M30 50A20 20 0 0 1 70 50A20 20 0 0 1 30 50";
  const PanelOutline wide = read_path(circle, "transform='scale(2, 1)'");
  EXPECT_EQ(wide.edges[0].control_m.size(), 2U);
  EXPECT_NEAR(outline_area_m2(wide), kPi * 0.02 * 0.04, 2e-2 * kPi * 0.02 * 0.04);
  const PanelOutline tilted = read_path("M20 50A30 15 90 0 1 50 50A30 15 90 0 1 20 50");
  const Eigen::Vector2d size =
      tilted.corner_m.rowwise().maxCoeff() - tilted.corner_m.rowwise().minCoeff();
  EXPECT_NEAR(size.x(), 0.03, 1e-12);
  EXPECT_NEAR(size.y(), 0.06, 1e-12);
  // Both ways to draw a circle agree within the error of the curves.
  const PanelOutline curves = read_path(circle, "transform='scale(1, 1.000001)'");
  EXPECT_EQ(curves.edges.size(), 4U);
  EXPECT_NEAR(outline_length_m(curves) / (2 * kPi * 0.02), 1, 1e-3);
  EXPECT_EQ(curves.begin_at_corner, std::vector{0});
}

TEST_F(SvgOutline, KeepsArcsUnderTransformsThatMirrorAndTurn) {
  const std::string half = "M0 0A10 10 0 0 0 20 0Z";  // hangs below its chord
  const PanelOutline plain = read_path(half);
  const PanelOutline turned =
      read(kMillimetres,
           "<g transform='translate(3) rotate(90, 4, 5)'><g transform='scale(2)'>"
           "<path id='p' d='" +
               half + "'/></g></g>");
  EXPECT_NEAR(outline_length_m(turned), 2 * outline_length_m(plain), 1e-12);
  EXPECT_NEAR(outline_length_m(plain), 0.02 + kPi * 0.01, 1e-12);
  const PanelOutline mirrored = read_path(half, "transform='matrix(1 0 0 -1 0 0)'");
  EXPECT_NEAR(outline_length_m(mirrored), 0.02 + kPi * 0.01, 1e-12);
  EXPECT_NEAR(outline_area_m2(mirrored), outline_area_m2(plain), 1e-15);
  EXPECT_GT(outline_area_m2(plain), 0);
  // As drawn: the arc bulges down, and mirrored up.
  const auto bulge_of = [](const PanelOutline& outline) {
    const size_t arc = outline.edges[0].bulge != 0 ? 0 : 1;
    const auto from = static_cast<Eigen::Index>(arc);
    return edge_point_m(outline.corner_m.col(from), outline.edges[arc],
                        outline.corner_m.col(1 - from), 0.5)
        .y();
  };
  EXPECT_NEAR(bulge_of(plain), -0.005, 1e-4);
  EXPECT_NEAR(bulge_of(mirrored), 0.005, 1e-4);
}

TEST_F(SvgOutline, ReadsEveryCommand) {
  const PanelOutline absolute = read_path(
      "M10 10H30V20L30 40C30 50 20 50 20 40S10 30 10 40Q5 35 10 30T10 20A5 5 0 0 1 10 10Z");
  const PanelOutline relative =
      read_path("m10,10h20v10l0 20c0 10-10 10-10 0s-10-10-10 0q-5-5 0-10t0-10a5 5 0 01 0-10z");
  ASSERT_EQ(absolute.edges.size(), 8U);
  EXPECT_LT(distance_m(absolute, relative), 1e-15);
  for (size_t k = 0; k < 8; ++k) {
    ASSERT_EQ(absolute.edges[k].control_m.size(), relative.edges[k].control_m.size());
    for (size_t n = 0; n < absolute.edges[k].control_m.size(); ++n)
      EXPECT_LT((absolute.edges[k].control_m[n] - relative.edges[k].control_m[n]).norm(), 1e-15);
    EXPECT_NEAR(absolute.edges[k].bulge, relative.edges[k].bulge, 1e-15);
  }
}

TEST_F(SvgOutline, IsTheSameClockwiseAndCounterclockwise) {
  const PanelOutline one = read_path("M10 10C10 20 20 30 30 30L50 30L50 10Z"),
                     other = read_path("M10 10L50 10L50 30L30 30C20 30 10 20 10 10Z");
  EXPECT_LT(distance_m(one, other), 1e-15);
  EXPECT_EQ(one.begin_at_corner, other.begin_at_corner);
  // The joint at (30, 30) is smooth, so that curve and line are one edge.
  EXPECT_EQ(one.begin_at_corner, (std::vector{0, 2, 3}));
  EXPECT_EQ(one.edges[0].control_m.size(), 2U);
  EXPECT_LT((one.edges[0].control_m[0] - other.edges[0].control_m[0]).norm(), 1e-15);
}

TEST_F(SvgOutline, JoinsShortLinesBetweenCorners) {
  // A half disc, its arc of 30 lines, begun in the middle of it.
  std::string points;
  for (int k = 0; k <= 30; ++k) {
    const double angle = kPi * ((k + 15) % 31) / 30;
    points += std::to_string(50 + 40 * std::cos(angle)) + "," +
              std::to_string(50 - 40 * std::sin(angle)) + " ";
  }
  const PanelOutline outline = read(kMillimetres, "<polygon id='p' points='" + points + "'/>");
  EXPECT_EQ(outline.edges.size(), 31U);
  EXPECT_EQ(outline.begin_at_corner, (std::vector{0, 1}));
  EXPECT_NEAR(outline_length_m(outline), 0.08 + 60 * 0.04 * std::sin(kPi / 60), 1e-7);
}

TEST_F(SvgOutline, DividesALoneCurveAndRoundsRects) {
  const PanelOutline drop = read_path("M50 90C0 0 100 0 50 90Z");
  ASSERT_EQ(drop.edges.size(), 2U);
  EXPECT_EQ(drop.begin_at_corner, std::vector{0});
  EXPECT_GT(outline_area_m2(drop), 0);
  const PanelOutline round =
      read(kMillimetres, "<rect id='p' x='5' y='5' width='40' height='30' rx='5'/>");
  EXPECT_EQ(round.edges.size(), 8U);
  EXPECT_EQ(round.begin_at_corner, std::vector{0});
  EXPECT_NEAR(outline_length_m(round), 2 * (0.03 + 0.02) + 2 * kPi * 0.005, 1e-12);
}

TEST_F(SvgOutline, RefusesWhatIsNoClosedOutline) {
  expect_refusal("a.svg:2: piece p: its outline is not closed",
                 "<path id='p' d='M0 0L10 0L10 10'/>");
  expect_refusal("a.svg:2: piece p: its outline is not closed",
                 "<polyline id='p' points='0,0 10,0 10,10'/>");
  expect_refusal("a.svg:2: piece p: its path has several subpaths",
                 "<path id='p' d='M0 0H9V9ZM20 0H29V9Z'/>");
  expect_refusal("a.svg:2: piece p: `x 5` in the data of its path", "<path id='p' d='M0 0 x 5'/>");
  expect_refusal("a.svg:2: piece p: `` in the data of its path", "<path id='p' d='M0 0L5'/>");
  expect_refusal("a.svg:2: piece p: `L5 5` in the data", "<path id='p' d='L5 5'/>");
  expect_refusal("a.svg:2: piece p: `2 0 9 9z` in the data",
                 "<path id='p' d='M0 0A5 5 0 2 0 9 9z'/>");
  expect_refusal("a.svg:2: piece p: a path without data", "<path id='p'/>");
  expect_refusal("a.svg:2: piece p: its outline is a point or a line",
                 "<path id='p' d='M0 0h.01v.01z'/>");
  expect_refusal("a.svg:2: piece p: its outline is 1e+05 m wide", "<path id='p' d='M0 0h1e8v1z'/>");
  expect_refusal("a.svg:2: a rect without area", "<rect id='p' width='5'/>");
  expect_refusal("a.svg:2: points that are no pairs", "<polygon id='p' points='1,2 3'/>");
  expect_refusal("a.svg:2: piece p is a <circle>", "<circle id='p' r='5'/>");
}

TEST_F(SvgOutline, RefusesDrawingsItCannotRead) {
  expect_refusal("a.svg: piece = p; did you mean `q`? known are `q`, `front`",
                 "<path id='q'/><g><rect id='front'/></g><g id='layer'/>");
  expect_refusal("a.svg: piece = p; a path", "<g/>");
  expect_refusal("a.svg:2: transform = turn(5)", "<rect id='p' transform='turn(5)'/>");
  expect_refusal("a.svg:2: transform = rotate(1 2)", "<rect id='p' transform='rotate(1 2)'/>");
  expect_refusal("a.svg:2: its transform leaves no area", "<rect id='p' transform='scale(1 0)'/>");
  expect_refusal("a.svg:2: a transform in an attribute style",
                 "<g style='fill:none; transform: scale(2)'><rect id='p'/></g>");
  expect_refusal("a.svg:2: a drawing within", "<svg><rect id='p' width='5' height='5'/></svg>");
  expect_refusal("a.svg:1: a user unit is 1 mm by the width and 2 mm by the height",
                 "<rect id='p' width='5' height='5'/>",
                 "<svg width='10mm' height='20mm' viewBox='0 0 10 10'>");
  expect_refusal("a.svg:1: width = 10em", "<rect id='p'/>",
                 "<svg width='10em' viewBox='0 0 10 10'>");
  expect_refusal("a.svg:1: a viewBox without four numbers", "<rect id='p'/>",
                 "<svg viewBox='0 0 10'>");
  expect_refusal("a.svg:1: a viewBox, width or height without extent", "<rect id='p'/>",
                 "<svg width='10mm' viewBox='0 0 0 10'>");
  expect_refusal("a.svg:3: its XML is damaged", "<g>");
  expect_refusal("a.svg:3: its XML is damaged", "", "<html>");
  expect_refused(folder_, "a.svg: its first element is `html`",
                 [&] { read_svg_outline(folder_.write("a.svg", "<html/>"), "p", std::nullopt); });
  expect_refused(folder_, "b.svg",
                 [&] { read_svg_outline(folder_.path() / "b.svg", "p", std::nullopt); });
}

TEST_F(SvgOutline, IsThePanelOfAPattern) {
  folder_.write("a.svg", kMillimetres + "<path id='p' d='M10 10C10 20 20 30 30 30L50 30L50 10Z'/>" +
                             "</svg>");
  const auto pattern = [&](const std::string& outline, const std::string& rest) {
    return read_pattern(folder_.write(
        "bag.yaml",
        "format: clothfit-pattern/1\nname: bag\npanels:\n  a: {at: [0, 0, 0], turn: [0, 0, 0], "
        "outline: {file: a.svg, piece: p" +
            outline + "}" + rest));
  };
  const Pattern numbered = pattern("", "}\nseams: [[a.1, a.3]]\n");
  EXPECT_EQ(numbered.seams[0].sides[0].edges, (std::vector{0, 1}));
  EXPECT_EQ(numbered.seams[0].sides[1].edges, std::vector{3});
  EXPECT_NEAR(numbered.panels[0].corner_m(0, 0), -0.02, 1e-15);
  const Pattern named = pattern(", edges: [bow, side, top], unit: cm",
                                ", darts: [{edge: top, at: 0.5, width: 0.01, depth: 0.05}]}\n"
                                "seams: [[a.top, a.bow]]\n");
  EXPECT_NEAR(named.panels[0].corner_m(0, 0), -0.2, 1e-15);
  EXPECT_EQ(named.seams[0].sides[0].edges, (std::vector{3, 6}));
  EXPECT_EQ(named.seams[0].sides[1].edges, (std::vector{0, 1}));
  const auto refuse = [&](const std::string& beginning, const std::string& outline,
                          const std::string& rest) {
    expect_refused(folder_, beginning, [&] { pattern(outline, rest); });
  };
  refuse("bag.yaml:5: edge 0 of panel a; did you mean `1`? known are `1`, `2`, `3`", "",
         "}\nseams: [[a.0, a.2]]\n");
  refuse("bag.yaml:4: 2 names for 3 edges", ", edges: [bow, side]", "}\n");
  refuse("bag.yaml:4: a second edge bow", ", edges: [bow, bow, top]", "}\n");
  refuse("bag.yaml:4: edge = 5", ", edges: [5, bow, top]", "}\n");
  refuse("bag.yaml:4: panels.a.outline.unit = ell", ", unit: ell", "}\n");
  refuse("bag.yaml:4: a dart in edge 1, which has several parts", "",
         ", darts: [{edge: 1, at: 0.5, width: 0.01, depth: 0.05}]}\n");
  expect_refused(folder_, "bag.yaml:4: file = a.pdf", [&] {
    read_pattern(folder_.write("bag.yaml",
                               "format: clothfit-pattern/1\nname: bag\npanels:\n  a: {at: [0, 0, "
                               "0], turn: [0, 0, 0], outline: {file: a.pdf, piece: p}}\n"));
  });
}

}  // namespace
}  // namespace clothfit
