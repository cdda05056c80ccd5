// Checks outlines from DXF drawings: blocks, polylines, lines and arcs, units, AAMA's corners and
// refusals. What a pattern makes of an outline, svg_outline_test checks.

#include "data/dxf_outline.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <numbers>

#include "tests/data/expect_refused.h"
#include "tests/data/outline_measures.h"

namespace clothfit {
namespace {

constexpr double kPi = std::numbers::pi;
const std::string kHeader = "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n4\n0\nENDSEC\n";

std::string block(const std::string& name, const std::string& entities) {
  return "0\nBLOCK\n8\n0\n2\n" + name + "\n" + entities + "0\nENDBLK\n";
}
std::string blocks(const std::string& all) {
  return "0\nSECTION\n2\nBLOCKS\n" + all + "0\nENDSEC\n";
}
std::string entities(const std::string& all) {
  return "0\nSECTION\n2\nENTITIES\n" + all + "0\nENDSEC\n0\nEOF\n";
}
std::string point(const std::string& layer, double x, double y) {
  return fmt::format("0\nPOINT\n8\n{}\n10\n{}\n20\n{}\n", layer, x, y);
}
std::string line(const std::string& layer, double x, double y, double to_x, double to_y) {
  return fmt::format("0\nLINE\n8\n{}\n10\n{}\n20\n{}\n11\n{}\n21\n{}\n", layer, x, y, to_x, to_y);
}
std::string arc(const std::string& layer, double x, double y, double radius, double begin,
                double end) {
  return fmt::format("0\nARC\n8\n{}\n10\n{}\n20\n{}\n40\n{}\n50\n{}\n51\n{}\n", layer, x, y, radius,
                     begin, end);
}

/// A polyline of vertices (x, y, bulge).
std::string polyline(const std::string& layer, const std::vector<std::array<double, 3>>& vertices,
                     int flags = 1) {
  std::string text = fmt::format("0\nPOLYLINE\n8\n{}\n66\n1\n70\n{}\n", layer, flags);
  for (const auto& [x, y, bulge] : vertices)
    text += fmt::format("0\nVERTEX\n8\n{}\n10\n{}\n20\n{}\n42\n{}\n", layer, x, y, bulge);
  return text + "0\nSEQEND\n";
}
std::string light_polyline(const std::string& layer,
                           const std::vector<std::array<double, 3>>& vertices, int flags = 1) {
  std::string text =
      fmt::format("  0\nLWPOLYLINE\n  8\n{}\n 90\n{}\n 70\n{}\n", layer, vertices.size(), flags);
  for (const auto& [x, y, bulge] : vertices)
    text += fmt::format(" 10\n{}\n 20\n{}\n 42\n{}\n", x, y, bulge);
  return text;
}

class DxfOutline : public testing::Test {
 protected:
  PanelOutline read(const std::string& text, const std::string& piece = "*",
                    std::optional<double> unit_m = std::nullopt) {
    return read_dxf_outline(folder_.write("a.dxf", text), piece, unit_m);
  }
  void expect_refusal(const std::string& beginning, const std::string& text,
                      const std::string& piece = "*") {
    expect_refused(folder_, beginning, [&] { read(text, piece); });
  }

  TemporaryFolder folder_;
};

TEST_F(DxfOutline, ReadsPolylinesInMillimetres) {
  const std::vector<std::array<double, 3>> square{
      {10, 10, 0}, {50, 10, 0}, {50, 30, 0}, {10, 30, 0}};
  const PanelOutline outline = read(kHeader + entities(polyline("cut", square)));
  Eigen::Matrix2Xd expected(2, 4);
  expected << -0.02, 0.02, 0.02, -0.02, -0.01, -0.01, 0.01, 0.01;
  EXPECT_LT((outline.corner_m - expected).norm(), 1e-15);
  EXPECT_EQ(outline.begin_at_corner, (std::vector{0, 1, 2, 3}));
  EXPECT_EQ(distance_m(outline, read(kHeader + entities(light_polyline("cut", square)))), 0);
  // Closed by its first vertex again, and without a flag.
  std::vector<std::array<double, 3>> again = square;
  again.push_back(square[0]);
  EXPECT_EQ(distance_m(outline, read(kHeader + entities(polyline("cut", again, 0)))), 0);
  const std::vector<std::array<double, 3>> clockwise{
      {10, 10, 0}, {10, 30, 0}, {50, 30, 0}, {50, 10, 0}};
  EXPECT_EQ(distance_m(outline, read(kHeader + entities(light_polyline("cut", clockwise)))), 0);
}

TEST_F(DxfOutline, TakesTheUnit) {
  const std::string square =
      entities(light_polyline("1", {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}));
  for (const auto& [code, unit_m] :
       {std::pair("1", 0.0254), {"4", 0.001}, {"5", 0.01}, {"6", 1.0}}) {
    std::string header = kHeader;
    header.replace(header.find("\n4\n"), 3, fmt::format("\n{}\n", code));
    EXPECT_NEAR(outline_area_m2(read(header + square)), unit_m * unit_m, 1e-15) << code;
  }
  EXPECT_NEAR(outline_area_m2(read(square, "*", 0.01)), 1e-4, 1e-15);
}

TEST_F(DxfOutline, MakesCirclesOfBulges) {
  // Counterclockwise and clockwise; then one arc of 270 degrees and one of 90.
  for (const double sign : {1.0, -1.0}) {
    const PanelOutline outline =
        read(kHeader + entities(light_polyline("1", {{0, 0, sign}, {40, 0, sign}})));
    EXPECT_NEAR(outline_length_m(outline), 2 * kPi * 0.02, 1e-9);
    EXPECT_NEAR(outline_area_m2(outline), kPi * 4e-4, 0.02 * kPi * 4e-4);
    EXPECT_EQ(outline.begin_at_corner, std::vector{0});
  }
  const PanelOutline uneven =
      read(kHeader +
           entities(polyline("1", {{20, 0, std::tan(3 * kPi / 8)}, {0, -20, std::tan(kPi / 8)}})));
  EXPECT_EQ(uneven.edges.size(), 3U);
  EXPECT_NEAR(outline_length_m(uneven), 2 * kPi * 0.02, 1e-9);
  EXPECT_EQ(uneven.begin_at_corner, std::vector{0});
}

TEST_F(DxfOutline, MakesOneEdgeOfPointsBetweenTurnPoints) {
  // A strip whose upper side is a bow of coarse lines: they turn by 30 degrees each. The lower side
  // has a turn point in its middle.
  std::vector<std::array<double, 3>> vertices{{-100, 0, 0}, {0, 0, 0}, {100, 0, 0}};
  std::string points = point("2", -100, 0) + point("2", 0, 0) + point("2", 100, 0);
  double length = 200;
  for (int k = 1; k < 6; ++k) {
    const double angle = kPi * k / 6;
    vertices.push_back({100 * std::cos(angle), 100 * std::sin(angle), 0});
    points += point("3", vertices.back()[0], vertices.back()[1]);
  }
  length += 6 * 200 * std::sin(kPi / 12);
  const std::string grain = line("7", 0, 10, 0, 60),
                    sewn = polyline("14", {{-50, 10, 0}, {50, 10, 0}, {0, 50, 0}});
  const PanelOutline outline =
      read(kHeader + blocks(block("OTHER", "") +
                            block("FRONT-M", points + polyline("1", vertices) + sewn + grain)),
           "FRONT-M");
  EXPECT_EQ(outline.begin_at_corner, (std::vector{0, 1, 2}));
  EXPECT_EQ(outline.edges.size(), 8U);
  EXPECT_NEAR(outline_length_m(outline), 1e-3 * length, 1e-12);
  // Without those points the turns decide.
  const PanelOutline bare = read(kHeader + blocks(block("A", polyline("1", vertices))), "A");
  EXPECT_EQ(bare.begin_at_corner, (std::vector{0, 2, 3, 4, 5, 6, 7}));
}

TEST_F(DxfOutline, JoinsLinesAndArcs) {
  // A stadium, its strokes in disorder and partly backwards.
  const std::string strokes = line("0", 0, 0, 50, 0) + arc("0", 0, 10, 10, 90, 270) +
                              line("0", 50, 20.00001, 0, 20) + arc("0", 50, 10, 10, 270, 90);
  const PanelOutline outline = read(kHeader + entities(strokes));
  EXPECT_NEAR(outline_length_m(outline), 0.1 + 2 * kPi * 0.01, 1e-7);
  EXPECT_EQ(outline.begin_at_corner, std::vector{0});
  const PanelOutline cut =
      read(kHeader + entities(line("7", 0, 1, 2, 3) + line("1", 0, 0, 50, 0) +
                              line("1", 50, 30, 0, 0) + line("1", 50, 0, 50, 30)));
  EXPECT_NEAR(outline_area_m2(cut), 0.5 * 0.05 * 0.03, 1e-15);
}

TEST_F(DxfOutline, RefusesWhatIsNoClosedOutline) {
  const std::string square = light_polyline("1", {{0, 0, 0}, {9, 0, 0}, {9, 9, 0}, {0, 9, 0}});
  expect_refusal("a.dxf:16: piece *: its outline is not closed",
                 kHeader + entities(light_polyline("1", {{0, 0, 0}, {9, 0, 0}, {9, 9, 0}}, 0)));
  expect_refusal("a.dxf: piece *: 2 closed polylines, in lines 16 and ",
                 kHeader + entities(square + square));
  expect_refusal("a.dxf:16: piece *: its lines and arcs do not join: none continues at (9, 0)",
                 kHeader + entities(line("1", 0, 0, 9, 0) + line("1", 9, 1, 0, 0)));
  expect_refusal("a.dxf: piece *: no outline, but INSERT, SPLINE",
                 kHeader + entities("0\nSPLINE\n8\n1\n0\nINSERT\n2\nA\n"));
  expect_refusal("a.dxf: piece *: no outline;", kHeader + entities(""));
  expect_refusal("a.dxf: piece *: no outline, but INSERT",
                 kHeader + blocks(block("A", square)) + entities("0\nINSERT\n2\nA\n"));
  expect_refusal("a.dxf:16: LWPOLYLINE lies in a plane of its own",
                 kHeader + entities(square + "210\n0\n220\n0\n230\n-1\n"));
  expect_refusal("a.dxf:16: piece *: a polyline of one point",
                 kHeader + entities(light_polyline("1", {{0, 0, 0}})));
}

TEST_F(DxfOutline, RefusesDrawingsItCannotRead) {
  const std::string square = light_polyline("1", {{0, 0, 0}, {9, 0, 0}, {9, 9, 0}, {0, 9, 0}});
  expect_refusal(
      "a.dxf: piece = FRNT; did you mean `FRONT`? known are `FRONT`, `BACK`",
      kHeader + blocks(block("FRONT", square) + block("BACK", square) + block("*D1", "")), "FRNT");
  expect_refusal("a.dxf: piece = A; `*`, for the drawing has no blocks", kHeader + entities(square),
                 "A");
  expect_refusal(
      "a.dxf: names no unit; $INSUNITS = 1 (inch), 4 (mm), 5 (cm) or 6 (m); give the unit",
      entities(square));
  std::string none = kHeader;
  expect_refusal("a.dxf:8: $INSUNITS = 0",
                 none.replace(none.find("\n4\n"), 3, "\n0\n") + entities(square));
  expect_refusal("a.dxf:20: group 10 = wide",
                 kHeader + entities("0\nLINE\n8\n1\n10\nwide\n20\n0\n11\n1\n21\n1\n"));
  expect_refusal("a.dxf:16: LINE without group 21",
                 kHeader + entities("0\nLINE\n10\n1\n20\n0\n11\n1\n"));
  expect_refusal("a.dxf:1: group code = hello", "hello\nworld\n");
  expect_refusal("a.dxf:2: begins within a group", "8\n1\n");
  expect_refusal("a.dxf:3: the last group has no value", "0\nSECTION\n2\n");
  expect_refusal("a.dxf: is a binary DXF drawing; a DXF drawing in text; export it as ASCII DXF",
                 std::string("AutoCAD Binary DXF\r\n\x1a\0\0", 23));
  expect_refused(folder_, "b.dxf",
                 [&] { read_dxf_outline(folder_.path() / "b.dxf", "A", std::nullopt); });
}

}  // namespace
}  // namespace clothfit
