// Checks the demo from pictures to parameters against what was simulated and rendered. Refusals of
// bad input by its parts: program_test.cpp.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "calib/camera/projection.h"
#include "data/camera_parameters.h"
#include "data/fit_result.h"
#include "data/recording.h"
#include "data/text_file.h"
#include "data/tracks.h"
#include "tests/apps/program_run.h"
#include "tests/apps/scratch_folder.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

const fs::path kTruth = fs::path(CLOTHFIT_SOURCE_DIR) / "tests/fixtures/truth/tags_onecam";

double value_of(const FitResult& result, const std::string& name) {
  for (const ParameterEstimate& parameter : result.parameters)
    if (parameter.name == name) return parameter.value;
  for (const ParameterEstimate& parameter : result.nuisance)
    if (parameter.name == name) return parameter.value;
  ADD_FAILURE() << "no parameter " << name;
  return NAN;
}

using VisibleMarkers = std::map<std::pair<int, std::string>, Eigen::Vector2d>;

/// Reads the pixels of the markers that the renderer says are visible: frame,marker,u,v,visible.
VisibleMarkers true_markers(const fs::path& file) {
  std::istringstream lines(read_text(file));
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "frame,marker,u,v,visible");
  VisibleMarkers visible;
  while (std::getline(lines, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream fields(line);
    int frame = 0, seen = 0;
    std::string marker;
    Eigen::Vector2d pixel;
    fields >> frame >> marker >> pixel.x() >> pixel.y() >> seen;
    if (seen == 1) visible[{frame, marker}] = pixel;
  }
  return visible;
}

CameraParameters camera_after(const fs::path& demo, const std::string& step) {
  return read_camera(demo / "steps" / step / "cameras/front.yaml");
}

/// Expects a focal length that is right to two in a thousand.
void expect_true_calibration(const fs::path& demo) {
  const CameraParameters truth = read_camera(kTruth / "truth_camera_front.yaml");

  const CameraParameters found = camera_after(demo, "calibrated");

  EXPECT_NEAR(found.focal_px.x(), truth.focal_px.x(), 2e-3 * truth.focal_px.x());
  EXPECT_NEAR(found.focal_px.y(), truth.focal_px.y(), 2e-3 * truth.focal_px.y());
}

/// Expects corners tracked no worse than by a plain detector, and honest sigmas.
void expect_true_tracks(const fs::path& demo) {
  const Recording recording = read_recording(demo / "steps/tracked");
  const Tracks2d found = read_tracks2d(recording.tracks2d.at("front"), recording.markers);

  const VisibleMarkers visible = true_markers(kTruth / "truth_tracks2d_front.csv.gz");
  std::vector<double> errors;
  double chi_square = 0;
  for (const Position2d& row : found) {
    if (!row.rejected.empty()) continue;
    const auto truth =
        visible.find({row.frame, recording.markers.markers[static_cast<size_t>(row.marker)].name});
    if (truth == visible.end()) continue;
    errors.push_back((row.position_px - truth->second).norm());
    chi_square += std::pow(errors.back() / row.sigma_px, 2) / 2;
  }
  std::sort(errors.begin(), errors.end());
  const auto count = static_cast<double>(errors.size());
  EXPECT_GE(count / static_cast<double>(visible.size()), 0.9982);
  EXPECT_LE(errors[errors.size() / 2], 0.107);
  EXPECT_LE(errors[errors.size() * 95 / 100], 0.32);
  EXPECT_NEAR(chi_square / count, 1.0, 0.3);  // sigma is honest
}

/// Expects the fabric within 10 %, held-out frames within a pixel.
void expect_true_fabric(const fs::path& demo) {
  const FitResult result = read_fit_result(demo / "fit.json");
  std::ifstream file(kTruth / "truth.json");
  const auto springs = nlohmann::json::parse(file).at("springs");

  for (const auto& [name, types] :
       {std::pair("tension_warp", "types_0_1"), std::pair("tension_weft", "types_0_1"),
        std::pair("shear", "types_2_3"), std::pair("flexion_warp", "types_4_5"),
        std::pair("flexion_weft", "types_4_5")}) {
    const double truth = springs.at(types).at("k");
    EXPECT_NEAR(value_of(result, name), truth, 0.1 * truth) << name;
  }
  for (const ParameterEstimate& parameter : result.parameters) {
    if (parameter.name == "areal_density") continue;
    EXPECT_EQ(parameter.state, ParameterState::fitted) << parameter.name;
    EXPECT_LT(parameter.sigma, 0.05 * parameter.value) << parameter.name;
  }
  ASSERT_EQ(result.errors.size(), 1u);
  EXPECT_EQ(result.errors[0].unit, "px");
  EXPECT_LT(result.errors[0].held_out.rms, 1.0);
  EXPECT_GT(result.errors[0].trivial.first_frame, 10.0);
}

/// Expects gravity in the camera's axes to be better than from the reference points alone.
void expect_true_gravity(const fs::path& demo) {
  // Down is taken as the true camera has it, as the placed one has it, and after the fit.
  const Eigen::Vector3d down(0, 0, -1);
  const Eigen::Vector3d truth =
      camera_from_world(read_camera(kTruth / "truth_camera_front.yaml")).rotation * down;
  const Rigid3 placed = camera_from_world(camera_after(demo, "tracked"));
  const FitResult result = read_fit_result(demo / "fit.json");
  // world_tilt_a turns about the world's x axis, world_tilt_b about x cross down = y
  // (fit/problem/problem.cpp).
  const Eigen::Vector3d turn =
      value_of(result, "world_tilt_a") * Eigen::Vector3d::UnitX() +
      value_of(result, "world_tilt_b") * Eigen::Vector3d::UnitX().cross(down);
  const Eigen::Vector3d fitted_down =
      Eigen::AngleAxisd(turn.norm(), turn.stableNormalized()) * down;

  const double error_placed = std::acos(std::min(1.0, truth.dot(placed.rotation * down)));
  const double error_fitted = std::acos(std::min(1.0, truth.dot(placed.rotation * fitted_down)));

  // Survey errors of 1 mm leave the placed camera off by up to three of its sigma of 2.7 mrad. The
  // swing knows better than a third of that sigma.
  EXPECT_LT(error_placed, 8e-3);
  EXPECT_LT(error_fitted, 0.9e-3);
  EXPECT_LT(error_fitted, error_placed);
}

// This is one test, because the demo that all of it looks at takes half a minute.
TEST(Demo, ReachesItsTargetsFromThePictures) {
  const test::ScratchFolder here("demo");

  const test::ProgramRun run = test::run_program({"demo"}, here.path());

  ASSERT_EQ(run.exit_code, 0) << run.error;
  EXPECT_NE(run.out.find("tension_warp"), std::string::npos);
  EXPECT_NE(run.out.find("demo.fit/report.html"), std::string::npos);
  const fs::path demo = here.path() / "demo.fit";
  EXPECT_TRUE(fs::exists(demo / "report.html"));
  expect_true_calibration(demo);
  expect_true_tracks(demo);
  expect_true_fabric(demo);
  expect_true_gravity(demo);
}

}  // namespace
}  // namespace clothfit
