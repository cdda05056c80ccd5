// Checks model files as they are read, written and refused. Not checked here: a model's simulation
// (tests/fit/problem/simulation_test.cpp), and what recordings share with it in full
// (recording_test.cpp).

#include "data/model_description.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <limits>

#include "tests/data/expect_refused.h"
#include "tests/data/temporary_folder.h"

namespace clothfit {
namespace {

/// Line 1 holds the format.
const std::string kModel = R"(format: clothfit-model/1
name: curtain
cloth: {size: [0.3, 0.4], mass: 0.03, masses: equal, mesh: {columns: 17, rows: 13}}
mesh: {columns: 9, rows: 7}
fabric:
  tension_warp: 41.5
  tension_weft: 40
  shear: 15
  flexion_warp: 8
  flexion_weft: 7
  damping_warp: 0.002
  damping_weft: 0.001
strain_limit: {mode: consistent, elongation: 0.1}
gravity: [0.0, 0.5, -9.8]
held:
  - {at: [0.0, 0.0], motion: fixed}
  - {at: [0.3, 0.0], motion: path, file: right.csv}
  - {edge: bottom, motion: fixed}
effects:
  - {effect: wind, parameters: {q: [0.0, 0.25, 0.0]}}
start: {kind: at_rest, position: [0.1, 0.2, 1.0], orientation: [0.6, 0.8, 0.0, 0.0]}
time: {frame_rate: 50.0, duration: 0.7}
time_step: 0.0005
obstacle: scene/table.obj
)";

class ModelFile : public testing::Test {
 protected:
  const TemporaryFolder folder_;
  void SetUp() override {
    folder_.write("right.csv", "time,x,y,z\n0,0,0,1\n0.5,0.1,0,1\n1,0,0,1\n");
    folder_.write("scene/table.obj", "v 0 0 0.7\nv 1 0 0.7\nv 1 1 0.7\nv 0 1 0.7\nf 1 2 3 4\n");
  }

  ModelDescription read(const std::string& text) const {
    return read_model(folder_.write("model.yaml", text));
  }
  /// Replaces the first `from` in the model.
  static std::string with(const std::string& from, const std::string& to) {
    std::string text = kModel;
    const size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  }
  void expect_refused_with(const std::string& from, const std::string& to,
                           const std::string& beginning) const {
    expect_refused(folder_, beginning, [&] { read(with(from, to)); });
  }
};

TEST_F(ModelFile, HoldsEveryKeyOfTheFormat) {
  const ModelDescription model = read(kModel);

  EXPECT_EQ(model.name, "curtain");
  EXPECT_EQ(model.cloth.width_m, 0.3);
  EXPECT_EQ(model.cloth.mass_kg, 0.03);
  EXPECT_EQ(model.cloth.masses, MassDistribution::equal);
  EXPECT_EQ(model.cloth.mesh_columns, 17);
  EXPECT_EQ(model.mesh_columns, 9);
  EXPECT_EQ(model.mesh_rows, 7);
  EXPECT_EQ(model.fabric.at("tension_warp"), 41.5);
  EXPECT_EQ(model.fabric.at("damping_weft"), 0.001);
  EXPECT_EQ(model.strain_limit, StrainLimitKind::consistent);
  EXPECT_EQ(model.critical_elongation, 0.1);
  EXPECT_EQ(model.gravity_m_per_s2, Eigen::Vector3d(0, 0.5, -9.8));
  ASSERT_EQ(model.held.size(), 3u);
  EXPECT_EQ(model.held[0].point.motion, HeldMotion::fixed);
  EXPECT_EQ(model.held[1].path.position_m[1], Eigen::Vector3d(0.1, 0, 1));
  EXPECT_EQ(model.held[2].point.edge, ClothEdge::bottom);
  ASSERT_EQ(model.effects.size(), 1u);
  EXPECT_EQ(model.effects[0].parameters.at("q"), (std::vector<double>{0, 0.25, 0}));
  EXPECT_EQ(model.effects[0].line, 20);
  EXPECT_EQ(model.start, StartKind::at_rest);
  EXPECT_EQ(model.sheet.position_m, Eigen::Vector3d(0.1, 0.2, 1.0));
  EXPECT_EQ(model.sheet.orientation.coeffs(), Eigen::Vector4d(0.8, 0, 0, 0.6));
  EXPECT_EQ(model.frame_rate_hz, 50.0);
  ASSERT_EQ(model.frame_time_s.size(), 36u);  // 0.7 * 50 is a little below 35 in binary
  EXPECT_EQ(model.frame_time_s.back(), 0.7);
  EXPECT_EQ(model.time_step_s, 0.0005);
  ASSERT_TRUE(model.obstacle);
  EXPECT_EQ(model.obstacle->vertex_m.col(1), Eigen::Vector3d(1, 0, 0.7));
  EXPECT_EQ(model.obstacle->triangle.cols(), 2);
}

TEST_F(ModelFile, NeedsLittle) {
  const ModelDescription model = read(
      "format: clothfit-model/1\nname: a\ncloth: {size: [1, 1], mass: 0.1}\n"
      "fabric: {tension_warp: 1, tension_weft: 1, shear: 0, flexion_warp: 0, flexion_weft: 0, "
      "damping_warp: 0, damping_weft: 0}\n"
      "start: {kind: released_flat}\ntime: {frame_rate: 10, duration: 1}\n");

  EXPECT_EQ(model.mesh_columns, 17);
  EXPECT_EQ(model.gravity_m_per_s2, Eigen::Vector3d(0, 0, -9.81));
  EXPECT_TRUE(model.held.empty());
  EXPECT_FALSE(model.time_step_s);
  EXPECT_EQ(model.strain_limit, StrainLimitKind::off);
  EXPECT_FALSE(model.obstacle);
}

TEST_F(ModelFile, OfTheDocumentsIsOne) {
  std::ifstream in(std::string(CLOTHFIT_SOURCE_DIR) + "/docs/formats.md");
  const std::string page{std::istreambuf_iterator<char>(in), {}};
  const size_t begin = page.find("format: clothfit-model/1");
  ASSERT_NE(begin, std::string::npos);

  const ModelDescription model = read(page.substr(begin, page.find("```", begin) - begin));

  EXPECT_EQ(model.name, "curtain");
  EXPECT_EQ(model.frame_time_s.size(), 121u);
}

TEST_F(ModelFile, ReadsBackAsWrittenToTheLastBit) {
  ModelDescription model = read(kModel);
  model.fabric["shear"] = 1.0 / 3;
  model.sheet.orientation = Eigen::Quaterniond(0.1, 0.2, 0.3, 0.4).normalized();
  model.held[1].path.position_m[0].x() = std::numeric_limits<double>::denorm_min();
  model.obstacle->vertex_m(2, 3) = 1.0 / 3;

  std::filesystem::create_directories(folder_ / "out");
  write_model(model, folder_ / "out");
  const ModelDescription again = read_model(folder_ / "out" / "model.yaml");

  EXPECT_EQ(again.fabric, model.fabric);
  EXPECT_EQ(again.sheet.orientation.coeffs(), model.sheet.orientation.coeffs());
  EXPECT_EQ(again.sheet.position_m, model.sheet.position_m);
  EXPECT_EQ(again.frame_time_s, model.frame_time_s);
  EXPECT_EQ(again.frame_rate_hz, model.frame_rate_hz);
  EXPECT_EQ(again.time_step_s, model.time_step_s);
  EXPECT_EQ(again.cloth.masses, model.cloth.masses);
  EXPECT_EQ(again.cloth.mesh_rows, model.cloth.mesh_rows);
  EXPECT_EQ(again.mesh_rows, model.mesh_rows);
  EXPECT_EQ(again.strain_limit, model.strain_limit);
  EXPECT_EQ(again.critical_elongation, model.critical_elongation);
  EXPECT_EQ(again.gravity_m_per_s2, model.gravity_m_per_s2);
  ASSERT_EQ(again.held.size(), model.held.size());
  EXPECT_EQ(again.held[1].path.time_s, model.held[1].path.time_s);
  EXPECT_EQ(again.held[1].path.position_m, model.held[1].path.position_m);
  EXPECT_EQ(again.held[2].point.edge, model.held[2].point.edge);
  ASSERT_TRUE(again.obstacle);
  EXPECT_EQ(again.obstacle->vertex_m, model.obstacle->vertex_m);
  EXPECT_EQ(again.obstacle->triangle, model.obstacle->triangle);
  EXPECT_EQ(again.effects[0].parameters, model.effects[0].parameters);
  EXPECT_EQ(again.start, model.start);
}

/// Returns the model with springs instead of its fabric.
std::string with_springs(const std::string& damping = "[0, 0, 0, 0, 0, 0.001]") {
  std::string text = kModel;
  const size_t begin = text.find("fabric:"), end = text.find("gravity:");
  return text.replace(begin, end - begin,
                      "springs:\n"
                      "  natural_length: [0.05, 0.05, 0.07, 0.07, 0.1, 0.1]\n"
                      "  stiffness: [40, 41, 15, 15, 8, 0]\n"
                      "  damping: " +
                          damping +
                          "\n"
                          "  critical_elongation: [0.1, 0.1, 0.2, 0.2, 0.3, 0.3]\n"
                          "strain_limit: {mode: positions}\n");
}

TEST_F(ModelFile, MayGiveItsSpringsTypeByType) {
  ModelDescription model = read(with_springs());
  ASSERT_TRUE(model.springs);
  EXPECT_TRUE(model.fabric.empty());
  EXPECT_EQ(model.fabric_line, 5);
  EXPECT_EQ(model.springs->stiffness_n_per_m[1], 41);
  model.springs->natural_length_m[3] = 1.0 / 3;
  model.springs->critical_elongation->at(5) = 0.1 + 0.2;

  std::filesystem::create_directories(folder_ / "out");
  write_model(model, folder_ / "out");
  const ModelDescription again = read_model(folder_ / "out" / "model.yaml");

  EXPECT_EQ(again.springs, model.springs);
  EXPECT_EQ(again.strain_limit, StrainLimitKind::positions);
}

TEST_F(ModelFile, RefusesSpringsThatCannotBe) {
  const auto expect = [&](const std::string& from, const std::string& to,
                          const std::string& beginning) {
    std::string text = with_springs();
    const size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    expect_refused(folder_, beginning, [&] { read(text); });
  };
  expect("[0.05,", "[0,", "model.yaml:6: springs.natural_length[0] = 0; ");
  expect("[40, 41, 15, 15, 8, 0]", "[40, 41, 15]", "model.yaml:7: springs.stiffness");
  expect("[40, 41, 15, 15, 8, 0]", "[0, 0, 0, 0, 0, 0]", "model.yaml:5: springs: every stiffness ");
  expect("0.001]", "-1]", "model.yaml:8: springs.damping[5] = -1; ");
  expect("{mode: positions}", "{mode: positions, elongation: 0.1}",
         "model.yaml:10: strain_limit.elongation stands beside springs; ");
  expect("  critical_elongation: [0.1, 0.1, 0.2, 0.2, 0.3, 0.3]\n", "",
         "model.yaml:9: the strain is limited, and the springs have no limits; ");
  expect("springs:\n", "fabric: {}\nsprings:\n", "model.yaml:5: the model has both ");
}

/// Returns the model with a start in motion on a mesh of 2 x 2.
std::string in_motion(const std::string& start = "{kind: in_motion, file: start.csv}") {
  std::string text = kModel;
  text.replace(text.find("{columns: 9, rows: 7}"), 21, "{columns: 2, rows: 2}");
  const size_t begin = text.find("{kind: at_rest"), end = text.find("\n", begin);
  return text.replace(begin, end - begin, start);
}

TEST_F(ModelFile, MayBeginInMotion) {
  folder_.write("start.csv",
                "row,column,x,y,z,vx,vy,vz\n1,1,0.3,0.4,0,0,0,1\n0,0,0,0,0,0,0,0\n"
                "0,1,0.3,0,0,0,0,2\n1,0,0,0.4,0,0,0,3\n");
  ModelDescription model = read(in_motion());
  ASSERT_TRUE(model.start_state);
  EXPECT_EQ(model.start, StartKind::unknown);
  EXPECT_EQ(model.start_state->position_m.col(1), Eigen::Vector3d(0.3, 0, 0));
  EXPECT_EQ(model.start_state->velocity_m_per_s.row(2), Eigen::RowVector4d(0, 2, 3, 1));
  model.start_state->position_m(0, 2) = 1.0 / 3;
  model.start_state->velocity_m_per_s(1, 3) = std::numeric_limits<double>::denorm_min();

  std::filesystem::create_directories(folder_ / "out");
  write_model(model, folder_ / "out");
  const ModelDescription again = read_model(folder_ / "out" / "model.yaml");

  ASSERT_TRUE(again.start_state);
  EXPECT_EQ(again.start_state->position_m, model.start_state->position_m);
  EXPECT_EQ(again.start_state->velocity_m_per_s, model.start_state->velocity_m_per_s);
}

TEST_F(ModelFile, RefusesAStartInMotionThatIsNotWhole) {
  const std::string three =
      "row,column,x,y,z,vx,vy,vz\n0,0,0,0,0,0,0,0\n0,1,1,0,0,0,0,0\n"
      "1,0,0,1,0,0,0,0\n";
  const auto expect = [&](const std::string& table, const std::string& beginning) {
    folder_.write("start.csv", table);
    expect_refused(folder_, beginning, [&] { read(in_motion()); });
  };
  expect(three, "start.csv: has 3 rows; ");
  expect(three + "1,0,1,1,0,0,0,0\n", "start.csv:5: vertex [1, 0] comes twice; ");
  expect(three + "1,2,1,1,0,0,0,0\n", "start.csv:5: there is no vertex [1, 2]; ");
  expect(three + "1,1,1,1,nan,0,0,0\n", "start.csv:5: ");
  folder_.write("start.csv", three + "1,1,1,1,0,0,0,0\n");
  const auto expect_start = [&](const std::string& start, const std::string& beginning) {
    expect_refused(folder_, beginning, [&] { read(in_motion(start)); });
  };
  expect_start("{kind: in_motion}", "model.yaml:");
  expect_start("{kind: in_motion, file: none.csv}", "model.yaml:21: start.file = none.csv: ");
  expect_start("{kind: in_motion, file: start.csv, position: [0, 0, 0]}",
               "model.yaml:21: start.position stands beside in_motion; ");
  expect_start("{kind: at_rest, file: start.csv}",
               "model.yaml:21: start.file stands beside at_rest; ");
}

TEST_F(ModelFile, NamesEveryModeOfTheStrainLimit) {
  std::filesystem::create_directories(folder_ / "out");
  for (const auto& [word, kind] : {std::pair{"off", StrainLimitKind::off},
                                   {"positions", StrainLimitKind::positions},
                                   {"rates_first", StrainLimitKind::rates_first},
                                   {"consistent", StrainLimitKind::consistent}}) {
    const ModelDescription model = read(with("mode: consistent", std::string("mode: ") + word));
    EXPECT_EQ(model.strain_limit, kind);
    EXPECT_EQ(to_string(kind), word);

    write_model(model, folder_ / "out");

    EXPECT_EQ(read_model(folder_ / "out" / "model.yaml").strain_limit, kind);
  }
}

TEST_F(ModelFile, KeepsUnevenTimes) {
  folder_.write("t.csv", "frame,time\n0,0.5\n1,0.6\n2,0.75\n");
  const ModelDescription model = read(with("{frame_rate: 50.0, duration: 0.7}", "{file: t.csv}"));
  EXPECT_EQ(model.frame_time_s, (std::vector<double>{0.5, 0.6, 0.75}));

  std::filesystem::create_directories(folder_ / "out");
  write_model(model, folder_ / "out");

  EXPECT_EQ(read_model(folder_ / "out" / "model.yaml").frame_time_s, model.frame_time_s);
}

TEST_F(ModelFile, IsWholeInAFolderThatIsMovedAway) {
  std::filesystem::create_directories(folder_ / "out");
  write_model(read(kModel), folder_ / "out");

  std::filesystem::create_directories(folder_ / "far/away");
  std::filesystem::rename(folder_ / "out", folder_ / "far/away/out");
  std::filesystem::remove_all(folder_ / "scene");
  std::filesystem::remove(folder_ / "right.csv");

  const ModelDescription model = read_model(folder_ / "far/away/out/model.yaml");
  EXPECT_EQ(model.obstacle->vertex_m.col(1), Eigen::Vector3d(1, 0, 0.7));
  EXPECT_EQ(model.held[1].path.position_m.size(), 3u);
}

TEST_F(ModelFile, IsRefusedWithFileAndLine) {
  expect_refused_with("mass: 0.03", "mass: -0.03", "model.yaml:3: cloth.mass = -0.03; ");
  expect_refused_with("mass: 0.03, ", "", "model.yaml:3: cloth.mass is missing; ");
  expect_refused_with("[0.3, 0.4]", "[0.3, -0.4]", "model.yaml:3: cloth.size[1] = -0.4; ");
  expect_refused_with("columns: 9", "columns: 1", "model.yaml:4: mesh.columns = 1; ");
  expect_refused_with("tension_weft: 40", "tension_weft: -40",
                      "model.yaml:7: fabric.tension_weft = -40; ");
  expect_refused_with("tension_weft: 40", "tension_weft: .nan",
                      "model.yaml:7: fabric.tension_weft = .nan; ");
  expect_refused_with("tension_weft: 40", "tension_weft: 1e400",
                      "model.yaml:7: fabric.tension_weft = 1e400; ");
  expect_refused_with("  shear: 15\n", "", "model.yaml:");
  expect_refused_with("  shear: 15", "  sheer: 15", "model.yaml:8: unknown key");
  expect_refused_with("damping_warp: 0.002", "damping_warp: -1",
                      "model.yaml:11: fabric.damping_warp = -1; ");
  expect_refused_with("elongation: 0.1", "elongation: -0.1",
                      "model.yaml:13: strain_limit.elongation = -0.1; ");
  expect_refused_with("mode: consistent", "mode: strict", "model.yaml:13: ");
  expect_refused_with("at: [0.0, 0.0]", "at: [0.31, 0.0]",
                      "model.yaml:16: held[0].at = [0.31, 0] lies outside the cloth; ");
  expect_refused_with("motion: path", "motion: tracked", "model.yaml:17: ");
  expect_refused_with("right.csv", "left.csv", "model.yaml:17: ");
  expect_refused_with("kind: at_rest", "kind: unknown", "model.yaml:21: ");
  expect_refused_with("[0.6, 0.8, 0.0, 0.0]", "[1, 1, 0, 0]",
                      "model.yaml:21: start.orientation = [1, 1, 0, 0] is no rotation; ");
  expect_refused_with("duration: 0.7", "duration: 0", "model.yaml:22: time.duration = 0; ");
  expect_refused_with("duration: 0.7", "duration: -1", "model.yaml:22: time.duration = -1; ");
  expect_refused_with("duration: 0.7", "duration: 0.01", "model.yaml:22: time.duration = 0.01; ");
  expect_refused_with("duration: 0.7", "duration: 1e9", "model.yaml:22: time.duration = ");
  expect_refused_with("duration: 0.7", "file: right.csv", "model.yaml:22: time has both ");
  expect_refused_with("time_step: 0.0005", "time_step: 0", "model.yaml:23: time_step = 0; ");
  expect_refused_with("scene/table.obj", "scene/tabel.obj",
                      "model.yaml:24: obstacle = scene/tabel.obj: there is no such file; ");
  expect_refused_with("scene/table.obj", "scene",
                      "model.yaml:24: obstacle = scene: there is no such file; ");
  expect_refused_with("clothfit-model/1", "clothfit-recording/1", "model.yaml:1: ");
}

TEST_F(ModelFile, IsRefusedWhereItsObstacleIsNoSurface) {
  folder_.write("scene/table.obj", "");
  expect_refused(folder_, "scene/table.obj: no faces; ", [&] { read(kModel); });
  folder_.write("scene/table.obj", "v 0 0 0.7\nv 1 0 0.7\nf 1 2 3\n");
  expect_refused(folder_, "scene/table.obj:3: corner `3`; ", [&] { read(kModel); });
}

TEST_F(ModelFile, IsRefusedWithoutAnyStiffness) {
  std::string text = kModel;
  for (const char* number : {"41.5", " 40", " 15", " 8", " 7"}) {
    const size_t at = text.find(number, text.find("tension_warp"));
    text.replace(at, std::string(number).size(), " 0");
  }

  expect_refused(folder_, "model.yaml:5: fabric: every stiffness is 0; ", [&] { read(text); });
}

}  // namespace
}  // namespace clothfit
