// Checks the readers of sewing patterns: what they make of darts, names and units, and what they
// refuse.

#include "data/pattern_file.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <numbers>

#include "tests/data/expect_refused.h"

namespace clothfit {
namespace {

const std::string kBegin = "format: clothfit-pattern/1\nname: bag\nunit: cm\n";
const std::string kFront =
    "panels:\n"
    "  front:\n"
    "    at: [0, -20, 0]\n"
    "    turn: [90, 0, 0]\n"
    "    outline:\n"
    "      - [-10, 0]\n"
    "      - {at: [10, 0], edge: right}\n"
    "      - {at: [10, 30], edge: top}\n"
    "      - {at: [-10, 30], edge: left, curve: [[-12, 15]]}\n";
const std::string kBack =
    "  back: {at: [0, 20, 0], turn: [90, 0, 180], grain: 90, outline: [[-10, 0], [10, 0], "
    "{at: [10, 30], bulge: 0.5}, [-10, 30]]}\n";

TEST(PatternFile, ReadsPanelsSeamsAndPlacements) {
  const TemporaryFolder folder;
  const Pattern pattern = read_pattern(folder.write(
      "bag.yaml", kBegin + "fabrics: {twill: twill.yaml}\n" + kFront + kBack +
                      "seams:\n  - [front.right, back.3]\n  - {sides: [front.left, back.1], "
                      "easing: 0.1}\n"));
  ASSERT_EQ(pattern.panels.size(), 2U);
  const Panel &front = pattern.panels[0], &back = pattern.panels[1];
  EXPECT_EQ(front.corner_m.col(2), Eigen::Vector2d(0.1, 0.3));
  EXPECT_EQ(front.edges[3].control_m[0], Eigen::Vector2d(-0.12, 0.15));
  EXPECT_EQ(back.edges[2].bulge, 0.5);
  EXPECT_NEAR(back.grain_rad, 0.5 * std::numbers::pi, 1e-12);
  // Panels stand up and look away from each other.
  const Eigen::Vector3d up = front.placement.linear().col(1), out = front.placement.linear().col(2),
                        out_behind = back.placement.linear().col(2);
  EXPECT_NEAR((up - Eigen::Vector3d::UnitZ()).norm(), 0, 1e-12);
  EXPECT_NEAR((out + Eigen::Vector3d::UnitY()).norm(), 0, 1e-12);
  EXPECT_NEAR((out_behind - Eigen::Vector3d::UnitY()).norm(), 0, 1e-12);
  EXPECT_EQ(pattern.seams[0].sides[0].edges, std::vector{1});
  EXPECT_EQ(pattern.seams[0].sides[1].edges, std::vector{3});
  EXPECT_EQ(pattern.seams[1].easing, 0.1);
  EXPECT_EQ(pattern.fabric_files[0].filename(), "twill.yaml");
}

TEST(PatternFile, CutsDartsIntoAnEdgeAndSewsThem) {
  const TemporaryFolder folder;
  const Pattern pattern = read_pattern(folder.write(
      "bag.yaml", kBegin + kFront +
                      "    darts:\n"
                      "      - {edge: top, at: 0.75, width: 2, depth: 5}\n"
                      "      - {edge: top, at: 0.25, width: 1, depth: 4}\n" +
                      kBack + "seams:\n  - {sides: [front.top, back.0], easing: 0.3}\n"));
  const Panel& front = pattern.panels[0];
  ASSERT_EQ(front.edge_count(), 10);
  Eigen::Matrix2Xd expected(2, 10);
  expected << -10, 10, 10, 5.5, 5, 4.5, -4, -5, -6, -10,  //
      0, 0, 30, 30, 26, 30, 30, 25, 30, 30;
  EXPECT_LT((100 * front.corner_m - expected).norm(), 1e-12);
  EXPECT_EQ(pattern.seams[0].sides[0].edges, (std::vector{2, 5, 8}));
  ASSERT_EQ(pattern.seams.size(), 3U);
  EXPECT_EQ(pattern.seams[1].sides[0].edges, std::vector{3});
  EXPECT_EQ(pattern.seams[1].sides[1].edges, std::vector{4});
  EXPECT_EQ(pattern.seams[1].line, 15);
}

TEST(PatternFile, RefusesWhatIsWrongInItsLine) {
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& beginning, const std::string& text) {
    expect_refused(folder, beginning, [&] { read_pattern(folder.write("bag.yaml", text)); });
  };
  refused("bag.yaml:1: format = clothfit-fabric/1", "format: clothfit-fabric/1\n");
  refused("bag.yaml:5: panels.front = square", kBegin + "panels:\n  front: square\n");
  refused("bag.yaml:4: 0 panels", kBegin + "panels: {}\n");
  refused("bag.yaml:13: panel frnt", kBegin + kFront + "seams: [[frnt.top, front.left]]\n");
  refused("bag.yaml:13: edge bottom of panel front",
          kBegin + kFront + "seams: [[front.bottom, front.left]]\n");
  refused("bag.yaml:13: edge 4 of panel front",
          kBegin + kFront + "seams: [[front.4, front.left]]\n");
  refused("bag.yaml:13: side = front", kBegin + kFront + "seams: [[front, front.left]]\n");
  refused("bag.yaml:13: a seam of 1 sides", kBegin + kFront + "seams: [[front.left]]\n");
  const std::string darts = kBegin + kFront + "    darts:\n      - {edge: ";
  refused("bag.yaml:14: a dart in a curved edge", darts + "left, at: 0.5, width: 1, depth: 2}\n");
  refused("bag.yaml:14: a dart 30 mm wide", darts + "top, at: 0.05, width: 3, depth: 2}\n");
  refused("bag.yaml:14: edge = waist", darts + "waist, at: 0.5, width: 3, depth: 2}\n");
  refused("bag.yaml:13: two darts meet in edge top",
          darts +
              "top, at: 0.5, width: 3, depth: 2}\n      - {edge: top, at: 0.55, width: 3, "
              "depth: 2}\n");
  refused("bag.yaml:5: an edge with curve and bulge",
          kBegin +
              "panels: {a: {at: [0, 0, 0], turn: [0, 0, 0], outline: [[0, 0],\n"
              "{at: [1, 0], bulge: 1, curve: [[1, 1]]}, [0, 1]]}}\n");
  refused("bag.yaml:9: a second edge right",
          kBegin +
              "panels:\n  a:\n    at: [0, 0, 0]\n    turn: [0, 0, 0]\n    outline: [{at: [0, "
              "0], edge: right},\n{at: [1, 0], edge: right}, [0, 1]]\n");
}

std::string specification(const std::string& edges, const std::string& stitches) {
  return R"({"pattern": {"panels": {"square": {"translation": [10, 20, 30],
    "rotation": [0, 0, 90], "vertices": [[0, 0], [0, 40], [40, 40], [40, 0]],
    "edges": [)" +
         edges + R"(]}}, "stitches": [)" + stitches +
         R"(]}, "properties": {"curvature_coords": "relative", "units_in_meter": 100}})";
}
const std::string kEdges =
    R"({"endpoints": [0, 1]}, {"endpoints": [1, 2], "curvature": {"type": "circle",
    "params": [20, 0, 1]}}, {"endpoints": [2, 3]},
    {"endpoints": [3, 0], "curvature": {"type": "quadratic", "params": [[0.5, 0.25]]}})";

TEST(GarmentCode, TurnsPanelsThatAreDrawnFromInside) {
  const TemporaryFolder folder;
  const Pattern pattern = read_pattern(
      folder.write("square.json", specification(kEdges, R"([{"panel": "square", "edge": 0},
                                            {"panel": "square", "edge": 2}])")));
  const Panel& panel = pattern.panels.at(0);
  // Clockwise as drawn: mirrored, so that its outline runs counterclockwise and its z axis is
  // turned round.
  EXPECT_EQ(panel.corner_m.col(2), Eigen::Vector2d(-0.4, 0.4));
  EXPECT_NEAR(panel.edges[1].bulge, -1, 1e-6) << "half a circle, now to the other side";
  // Along the chord 0.5, to its left 0.25: (20, 0) + 0.25 (0, -40), mirrored.
  EXPECT_NEAR((panel.edges[3].control_m[0] - Eigen::Vector2d(-0.2, -0.1)).norm(), 0, 1e-12);
  // (40, 0) turned by 90 degrees is (0, 40), moved (10, 60, 30) with y up: (10, -30, 60) with z up.
  const Eigen::Vector3d corner = panel.placement * Eigen::Vector3d(-0.4, 0, 0);
  EXPECT_NEAR((corner - Eigen::Vector3d(0.1, -0.3, 0.6)).norm(), 0, 1e-12);
  EXPECT_NEAR((panel.placement.linear().col(2) - Eigen::Vector3d::UnitY()).norm(), 0, 1e-12);
  EXPECT_EQ(pattern.seams.at(0).sides[1].edges, std::vector{2});
}

TEST(GarmentCode, TellsTheSideOfAPanelOfArcs) {
  // Three quarters of a ring, counterclockwise: its corners alone run the other way.
  const TemporaryFolder folder;
  const Pattern ring = read_pattern(folder.write("ring.json", R"({"pattern": {"panels": {"ring": {
    "translation": [0, 0, 0], "rotation": [0, 0, 0],
    "vertices": [[10, 0], [30, 0], [0, -30], [0, -10]], "edges": [{"endpoints": [0, 1]},
    {"endpoints": [1, 2], "curvature": {"type": "circle", "params": [30, 1, 1]}},
    {"endpoints": [2, 3]},
    {"endpoints": [3, 0], "curvature": {"type": "circle", "params": [10, 1, 0]}}]}},
    "stitches": []}})"));
  EXPECT_EQ(ring.panels[0].corner_m.col(0), Eigen::Vector2d(0.1, 0)) << "not turned over";
  EXPECT_GT(ring.panels[0].edges[1].bulge, 0);
}

TEST(GarmentCode, RefusesWhatIsNoSpecification) {
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& beginning, const std::string& text) {
    expect_refused(folder, beginning, [&] { read_pattern(folder.write("p.json", text)); });
  };
  refused("p.json: `/pattern` is missing", "{}");
  refused(
      "p.json: `/pattern/stitches/0/1/panel` is `round`",
      specification(kEdges, R"([{"panel": "square", "edge": 0}, {"panel": "round", "edge": 2}])"));
  refused(
      "p.json: `/pattern/stitches/0/1/edge` is 4",
      specification(kEdges, R"([{"panel": "square", "edge": 0}, {"panel": "square", "edge": 4}])"));
  refused("p.json: `/pattern/panels/square/edges/1` does not begin where the last one ends",
          specification(R"({"endpoints": [0, 1]}, {"endpoints": [2, 3]})", ""));
  refused("p.json: `/pattern/panels/square/edges/1/curvature/type` is `spline`",
          specification(R"({"endpoints": [0, 1]}, {"endpoints": [1, 0],
                           "curvature": {"type": "spline", "params": []}})",
                        ""));
  refused("p.json: `/pattern/panels/square/edges/1/curvature/params/0` is less than half its chord",
          specification(R"({"endpoints": [0, 1]}, {"endpoints": [1, 0],
                           "curvature": {"type": "circle", "params": [19, 0, 1]}})",
                        ""));
}

TEST(GarmentCode, ReadsItsOwnPatterns) {
  const char* data = std::getenv("CLOTHFIT_DATA");
  if (!data) GTEST_SKIP() << "set CLOTHFIT_DATA to a folder with garments/";
  const std::filesystem::path folder = std::filesystem::path(data) / "garments";
  for (const auto& [name, panels, seams] :
       {std::tuple{"shirt_mean", 8, 18}, {"dress_pencil", 6, 23}, {"js_mean_all", 12, 57}}) {
    const Pattern pattern = read_pattern(folder / (std::string(name) + "_specification.json"));
    EXPECT_EQ(pattern.panels.size(), static_cast<size_t>(panels)) << name;
    EXPECT_EQ(pattern.seams.size(), static_cast<size_t>(seams)) << name;
  }
}

}  // namespace
}  // namespace clothfit
