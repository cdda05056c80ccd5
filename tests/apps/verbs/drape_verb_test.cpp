// Runs `clothfit drape` from outside: what it writes, and that what it refuses is named and leaves
// nothing. The tests of fabric themselves: tests/model/laboratory.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "data/ply_mesh.h"
#include "tests/apps/program_run.h"
#include "tests/apps/scratch_folder.h"

namespace clothfit {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class DrapeVerb : public ::testing::Test {
 protected:
  DrapeVerb() { write("areal_density: 0.2\n"); }

  void write(const std::string& density) const {
    std::ofstream(here_.path() / "twill.yaml")
        << "format: clothfit-fabric/1\nname: twill\nunits: si\n"
        << density << "tension: {warp: 500, weft: 400}\nshear: 40\n"
        << "bending: {warp: {value: 8e-6, sigma: 8e-7}, weft: 2e-6}\ndrape_coefficient: 0.35\n";
  }
  test::ProgramRun run(std::vector<std::string> options) const {
    options.insert(options.begin(), {"drape", "--fabric", "twill.yaml"});
    return test::run_program(options, here_.path());
  }
  nlohmann::json json(const std::string& folder) const {
    std::ifstream file(here_.path() / folder / "drape.json");
    return nlohmann::json::parse(file);
  }

  const test::ScratchFolder here_{std::string("drape_") +
                                  ::testing::UnitTest::GetInstance()->current_test_info()->name()};
};

TEST_F(DrapeVerb, DrapesADiscAndComparesWithTheMeasuredOne) {
  const test::ProgramRun run_of_two =
      run({"--test", "cusick", "--spacing", "15mm", "--starts", "2"});

  ASSERT_EQ(run_of_two.exit_code, 0) << run_of_two.error;
  EXPECT_THAT(run_of_two.out, HasSubstr("twill: drape coefficient "));
  EXPECT_THAT(run_of_two.out, HasSubstr("Measured: 35.0 %"));
  EXPECT_THAT(test::names_in(here_.path() / "twill.cusick"),
              ElementsAre(".clothfit", "drape.csv", "drape.json", "drape.obj"));
  const nlohmann::json result = json("twill.cusick");
  EXPECT_NEAR(result.at("predicted_less_measured").get<double>(),
              result.at("coefficient").get<double>() - 0.35, 1e-12);
  EXPECT_EQ(result.at("drapes").size(), 2);
  EXPECT_GT(read_obj(here_.path() / "twill.cusick" / "drape.obj").triangle.cols(), 100);
}

TEST_F(DrapeVerb, CarriesTheSheetsSigmaToTheBendingLength) {
  ASSERT_EQ(run({"--test", "cantilever"}).exit_code, 0);

  const nlohmann::json result = json("twill.cantilever");
  const nlohmann::json& warp = result.at("warp");
  EXPECT_NEAR(
      warp.at("bending_length_sigma_m").get<double>() / warp.at("bending_length_m").get<double>(),
      0.1 / 3, 1e-6);
  EXPECT_NEAR(warp.at("bending_n_m").get<double>(), 8e-6, 8e-8);
  EXPECT_FALSE(result.at("weft").contains("bending_length_sigma_m"));
}

TEST_F(DrapeVerb, StretchesAndShears) {
  ASSERT_EQ(run({"--test", "tensile"}).exit_code, 0);
  ASSERT_EQ(run({"--test", "shear"}).exit_code, 0);

  EXPECT_NEAR(json("twill.tensile").at("warp").at("stiffness_n_per_m").get<double>(), 497, 2);
  EXPECT_NEAR(json("twill.shear").at("shear").at("stiffness_n_per_m").get<double>(), 40, 0.1);
}

class DrapeGarmentVerb : public DrapeVerb {
 protected:
  DrapeGarmentVerb() {
    std::ofstream(here_.path() / "tube.yaml") << tube("10");
    std::ofstream(here_.path() / "bar.obj") << bar();
  }
  /// A tube of 12 cm girth, above and below a level bar.
  static std::string tube(const std::string& width) {
    const std::string outline = "outline: [[0, 0], [" + width + ", 0], [" + width + ", 6], [0, 6]]";
    return "format: clothfit-pattern/1\nname: tube\nunit: cm\nfabrics: {twill: twill.yaml}\n"
           "panels:\n  upper: {at: [-5, -3, 6], turn: [0, 0, 0], " +
           outline +
           "}\n"
           "  lower: {at: [-5, 3, -6], turn: [180, 0, 0], " +
           outline +
           "}\n"
           "seams:\n  - [upper.2, lower.0]\n  - [upper.0, lower.2]\n";
  }
  /// A box of 20 x 2 x 2 cm along x.
  static std::string bar() {
    std::string text;
    for (const char* x : {"-0.1", "0.1"})
      for (const char* yz : {" -0.01 -0.01", " 0.01 -0.01", " 0.01 0.01", " -0.01 0.01"})
        text += std::string("v ") + x + yz + "\n";
    return text + "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
  }
  test::ProgramRun drape(std::vector<std::string> options) const {
    options.insert(options.begin(), {"drape", "tube.yaml"});
    return test::run_program(options, here_.path());
  }
};

TEST_F(DrapeGarmentVerb, SewsAPatternAroundABody) {
  const test::ProgramRun sewn =
      drape({"--body", "bar.obj", "--spacing", "15mm", "--format", "ply,pc2,gltf"});

  ASSERT_EQ(sewn.exit_code, 0) << sewn.error;
  EXPECT_THAT(sewn.out, HasSubstr("tube: 2 panels, 2 seams, 2 g; at rest"));
  EXPECT_THAT(test::names_in(here_.path() / "tube.drape"),
              ElementsAre(".clothfit", "back.png", "body.obj", "front.png", "garment.csv",
                          "garment.glb", "garment.json", "garment.obj", "garment.pc2",
                          "garment.ply", "left.png", "panels.obj", "report.html"));
  std::ifstream file(here_.path() / "tube.drape" / "garment.json");
  const nlohmann::json result = nlohmann::json::parse(file);
  EXPECT_EQ(result.at("places_inside_body"), 0);
  EXPECT_EQ(result.at("crossings"), 0);
  EXPECT_LE(result.at("imbalance").get<double>(), 1e-3);
  // The stiff tube rests on the bar as a ring of 19 mm radius would.
  const SurfaceMesh garment = read_obj(here_.path() / "tube.drape" / "garment.obj");
  EXPECT_EQ(garment.vertex_m.cols(), result.at("levels").back().at("particles"));
  EXPECT_EQ(read_ply(here_.path() / "tube.drape" / "garment.ply").vertex_m, garment.vertex_m);
  EXPECT_NEAR(garment.vertex_m.row(2).maxCoeff(), 0.0146, 0.001);
  EXPECT_NEAR(garment.vertex_m.row(2).minCoeff(), -0.0285, 0.001);
}

TEST_F(DrapeGarmentVerb, DrapesTheBundledSkirtOnTheMannequin) {
  const test::ProgramRun sewn =
      test::run_program({"drape", CLOTHFIT_SOURCE_DIR "/data/patterns/skirt.yaml", "--spacing",
                         "40mm", "--tolerance", "0.01"},
                        here_.path());

  ASSERT_EQ(sewn.exit_code, 0) << sewn.error;
  EXPECT_THAT(sewn.out, HasSubstr("skirt: 2 panels, 6 seams, 88 g"));
  // It hangs from the waist, which its narrow top keeps above the hips, and is 58 cm long.
  const SurfaceMesh garment = read_obj(here_.path() / "skirt.drape" / "garment.obj");
  const double top_m = garment.vertex_m.row(2).maxCoeff();
  EXPECT_NEAR(top_m, 1.04, 0.04);
  EXPECT_NEAR(top_m - garment.vertex_m.row(2).minCoeff(), 0.58, 0.03);
}

TEST_F(DrapeGarmentVerb, RefusesAndLeavesNothing) {
  const std::vector<std::string> before = test::names_in(here_.path());
  const auto expect = [&](int exit_code, const std::vector<std::string>& options,
                          const std::string& words) {
    const test::ProgramRun refused = drape(options);
    EXPECT_EQ(refused.exit_code, exit_code) << refused.error;
    EXPECT_THAT(refused.error, HasSubstr(words));
    EXPECT_EQ(test::names_in(here_.path()), before);
  };
  expect(3, {"--body", "bar.obj", "--spacing", "1mm", "--hold-off", "1m"}, "--hold-off: it is 1;");
  expect(3, {"--body", "bar.obj", "--self-distance", "1m"}, "--self-distance: it is 1;");
  expect(2, {"--body", "bar.obj", "--format", "ply,stl"}, "'ply,stl' is not a list of obj, ply");
  expect(3, {"--body", "twill.yaml"}, "twill.yaml");
  expect(3, {"--body", "bar.obj", "--fabric", "none.yaml"}, "none.yaml");
  expect(3, {"--body", "bar.obj", "--starts", "8"}, "--starts: is given with a pattern");
  std::filesystem::rename(here_.path() / "twill.yaml", here_.path() / "moved.yaml");
  EXPECT_THAT(drape({"--body", "bar.obj"}).error,
              HasSubstr("tube.yaml: its fabric twill names twill.yaml, which is not there"));
  std::filesystem::rename(here_.path() / "moved.yaml", here_.path() / "twill.yaml");
  expect(3, {"--test", "shear", "--fabric", "twill.yaml"}, "a pattern and a --test");
  std::ofstream(here_.path() / "bar.obj") << bar().substr(0, bar().rfind("f 4"));
  expect(3, {"--body", "bar.obj"}, "bar.obj: 4 of its edges do not lie between");
  std::ofstream(here_.path() / "bar.obj") << bar() << "v 0 0 172\n";
  expect(3, {"--body", "bar.obj"}, "bar.obj: it spans 172 m; a body in metres");
  std::ofstream(here_.path() / "bar.obj") << bar();
  std::string within = tube("10");
  within.replace(within.find("-3, 6]"), 6, "-3, 0]");
  std::ofstream(here_.path() / "tube.yaml") << within;
  expect(3, {"--body", "bar.obj"},
         "tube.yaml:6: panel upper: it begins inside the body, 10 mm deep");
  std::ofstream(here_.path() / "tube.yaml") << tube("-10");
  expect(3, {"--body", "bar.obj"}, "tube.yaml:6: panel upper: its outline runs clockwise");
}

TEST_F(DrapeVerb, RefusesWhatIsNoTestOrNoFabric) {
  const auto expect_refused = [&](const std::vector<std::string>& options,
                                  const std::string& words) {
    const std::vector<std::string> before = test::names_in(here_.path());
    const test::ProgramRun refused = run(options);
    EXPECT_EQ(refused.exit_code, 3) << refused.error;
    EXPECT_THAT(refused.error, HasSubstr(words));
    EXPECT_EQ(test::names_in(here_.path()), before);
  };
  expect_refused({"--test", "cusick", "--disc", "40cm"}, "--disc: ");
  expect_refused({"--test", "cusick", "--spacing", "5cm"}, "--spacing: ");
  expect_refused({"--test", "cusick", "--starts", "0"}, "--starts: ");
  write("areal_density: 200\n");
  expect_refused({"--test", "shear"}, "twill.yaml:4: areal_density = 200");
  EXPECT_EQ(run({"--test", "wash"}).exit_code, 2);
}

}  // namespace
}  // namespace clothfit
