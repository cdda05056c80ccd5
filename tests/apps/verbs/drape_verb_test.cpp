// Runs `clothfit drape` from outside: what it writes, and that what it refuses is named and leaves
// nothing. The tests of fabric themselves: tests/model/laboratory.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "data/obj_mesh.h"
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
