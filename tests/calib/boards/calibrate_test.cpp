// Checks calibration from board corners: recovered truth, honest sigma, outliers, degenerate input.
// Does not check our own corner detection: vision's tests do. The bundled stills are read here with
// OpenCV's detector, so that the estimate alone is under test.

#include "calib/boards/calibrate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "calib/camera/projection.h"
#include "data/input_error.h"
#include "tests/calib/scattered_heap.h"

namespace clothfit {
namespace {

constexpr BoardDescription kBoard{.columns = 9, .rows = 6, .square_m = 0.025};
/// A board of the same size with fewer corners, which is calibrated with soon.
constexpr BoardDescription kCoarseBoard{.columns = 5, .rows = 4, .square_m = 0.045};

CameraParameters true_camera() {
  CameraParameters camera;
  camera.model = CameraModel::brown_conrady;
  camera.image_width = 960;
  camera.image_height = 720;
  camera.focal_px = {1012.3, 1010.7};
  camera.centre_px = {483.6, 355.2};
  camera.distortion = {-0.11, 0.035, 0.0008, -0.0005};
  return camera;
}

CalibrateOptions four_coefficients() {
  CalibrateOptions options;
  options.distortion_count = 4;
  return options;
}

BoardView view_of(const CameraParameters& camera, const Rigid3& camera_from_board, double noise_px,
                  std::mt19937_64& rng, const BoardDescription& board = kBoard) {
  std::normal_distribution<double> normal(0, noise_px);
  BoardView view;
  for (int row = 0; row < board.rows; ++row) {
    for (int column = 0; column < board.columns; ++column) {
      const Eigen::Vector3d on_board(column * board.square_m, row * board.square_m, 0);
      const auto pixel = project(camera, Eigen::Vector3d(camera_from_board * on_board));
      view.corners_px.emplace_back(*pixel + (noise_px > 0
                                                 ? Eigen::Vector2d(normal(rng), normal(rng))
                                                 : Eigen::Vector2d::Zero()));
    }
  }
  return view;
}

/// Returns camera from board: the board's middle at `middle_m`, turned by `w` out of the picture's
/// plane.
Rigid3 board_at(const Eigen::Vector3d& middle_m, const Eigen::Vector3d& w,
                const BoardDescription& board = kBoard) {
  const Eigen::Vector3d half(0.5 * (board.columns - 1) * board.square_m,
                             0.5 * (board.rows - 1) * board.square_m, 0);
  return Rigid3{Eigen::Quaterniond::Identity(), middle_m} *
         turn_and_shift(w, Eigen::Vector3d::Zero()) * Rigid3{Eigen::Quaterniond::Identity(), -half};
}

/// Makes twelve views all round, tilted by 17 to 40 degrees.
std::vector<BoardView> synthetic_views(const CameraParameters& camera, double noise_px,
                                       std::mt19937_64& rng,
                                       const BoardDescription& board = kBoard) {
  std::vector<BoardView> views;
  for (int i = 0; i < 12; ++i) {
    const double around = 2 * std::numbers::pi * i / 12;
    const double tilt = 0.3 + 0.4 * (i % 3) / 2;
    const Eigen::Vector3d w(tilt * std::cos(around), tilt * std::sin(around), 0.4 * (i % 2));
    const Eigen::Vector3d middle(0.09 * std::cos(2 * around), 0.06 * std::sin(2 * around),
                                 0.45 + 0.03 * (i % 4));
    views.push_back(view_of(camera, board_at(middle, w, board), noise_px, rng, board));
    views.back().name = "view " + std::to_string(i);
  }
  return views;
}

double true_value(const CameraParameters& camera, const std::string& name) {
  if (name == "fx") return camera.focal_px.x();
  if (name == "fy") return camera.focal_px.y();
  if (name == "cx") return camera.centre_px.x();
  if (name == "cy") return camera.centre_px.y();
  const std::vector<std::string> names{"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"};
  const auto at = static_cast<size_t>(std::find(names.begin(), names.end(), name) - names.begin());
  return at < camera.distortion.size() ? camera.distortion[at] : 0;
}

TEST(Calibrate, RecoversTheCameraExactlyWithoutNoise) {
  std::mt19937_64 rng(1);
  const CameraParameters camera = true_camera();

  for (const int count : {4, 5}) {
    SCOPED_TRACE(count);
    CalibrateOptions options;
    options.distortion_count = count;
    const CalibrateResult result =
        calibrate(kBoard, synthetic_views(camera, 0, rng), 960, 720, options);

    ASSERT_TRUE(result.usable) << result.message;
    EXPECT_LT(result.rms_px, 1e-6);
    for (const auto& estimate : result.intrinsics)
      EXPECT_NEAR(estimate.value, true_value(camera, estimate.name), 1e-4) << estimate.name;
  }
}

TEST(Calibrate, RecoversEveryModelWithinItsSigma) {
  CameraParameters pinhole = true_camera();
  pinhole.model = CameraModel::pinhole;
  pinhole.distortion.clear();
  CameraParameters fisheye = true_camera();
  fisheye.model = CameraModel::kannala_brandt;
  fisheye.distortion = {-0.02, 0.01, -0.004, 0.001};
  CameraParameters rational = true_camera();
  rational.distortion = {0.3, 0.05, 0.0008, -0.0005, 0.01, 0.4, 0.05, 0.01};
  std::mt19937_64 rng(2);
  SCOPED_TRACE("seed 2");

  for (const auto& camera : {pinhole, fisheye, rational}) {
    SCOPED_TRACE(static_cast<int>(camera.model));
    CalibrateOptions options;
    options.model = camera.model;
    options.distortion_count = static_cast<int>(camera.distortion.size());
    const CalibrateResult result =
        calibrate(kBoard, synthetic_views(camera, 0.1, rng), 960, 720, options);

    ASSERT_TRUE(result.usable) << result.message;
    EXPECT_NEAR(result.rms_px, 0.1, 0.01);
    for (const auto& estimate : result.intrinsics) {
      if (estimate.name[0] == 'k') continue;  // coefficients of a series trade with each other
      EXPECT_LT(std::abs(estimate.value - true_value(camera, estimate.name)), 4 * estimate.sigma)
          << estimate.name;
    }
  }
}

TEST(Calibrate, ReportsTheSigmaThatItsEstimatesScatterWith) {
  constexpr int kRepetitions = 40;
  const CameraParameters camera = true_camera();
  std::vector<double> square_error, variance;
  std::vector<std::string> names;
  for (int repetition = 0; repetition < kRepetitions; ++repetition) {
    SCOPED_TRACE("seed " + std::to_string(100 + repetition));
    std::mt19937_64 rng(static_cast<unsigned>(100 + repetition));
    const CalibrateResult result =
        calibrate(kCoarseBoard, synthetic_views(camera, 0.1, rng, kCoarseBoard), 960, 720,
                  four_coefficients());

    ASSERT_TRUE(result.usable) << result.message;
    ASSERT_EQ(result.intrinsics.size(), 8U);
    square_error.resize(8);
    variance.resize(8);
    names.clear();
    for (size_t i = 0; i < 8; ++i) {
      const NamedSigma& estimate = result.intrinsics[i];
      const double error = estimate.value - true_value(camera, estimate.name);
      EXPECT_LT(std::abs(error), 4 * estimate.sigma) << estimate.name;
      square_error[i] += error * error / kRepetitions;
      variance[i] += estimate.sigma * estimate.sigma / kRepetitions;
      names.push_back(estimate.name);
    }
  }

  // The scatter of 40 repetitions is itself known to 11 %.
  for (size_t i = 0; i < names.size(); ++i)
    EXPECT_NEAR(std::sqrt(square_error[i] / variance[i]), 1, 0.25) << names[i];
}

TEST(Calibrate, SurvivesGrossOutliers) {
  std::mt19937_64 rng(3);
  SCOPED_TRACE("seed 3");
  const CameraParameters camera = true_camera();
  auto views = synthetic_views(camera, 0.1, rng);
  std::uniform_real_distribution<double> wild(-60, 60);
  int spoiled = 0;
  for (auto& view : views) {
    for (size_t corner = 0; corner < view.corners_px.size(); ++corner) {
      if ((corner + 7 * static_cast<size_t>(spoiled)) % 12 != 0) continue;
      view.corners_px[corner] += Eigen::Vector2d(20 + wild(rng), -20 + wild(rng));
      ++spoiled;
    }
  }
  for (auto& corner : views[5].corners_px) corner = {480 + 5 * wild(rng), 360 + 5 * wild(rng)};

  const CalibrateResult result = calibrate(kBoard, views, 960, 720, four_coefficients());

  ASSERT_TRUE(result.usable) << result.message;
  EXPECT_EQ(result.views[5].used, 0) << "a view of nonsense takes no part";
  EXPECT_NEAR(result.rms_px, 0.1, 0.01);
  EXPECT_NEAR(result.intrinsics[0].value, camera.focal_px.x(), 4 * result.intrinsics[0].sigma);
  EXPECT_NEAR(result.intrinsics[1].value, camera.focal_px.y(), 4 * result.intrinsics[1].sigma);
  EXPECT_GT(result.corners_rejected, spoiled);
  EXPECT_LT(result.corners_rejected, spoiled + 54 + 5);
}

TEST(Calibrate, ReportsErrorsPerView) {
  std::mt19937_64 rng(4);
  SCOPED_TRACE("seed 4");
  const CameraParameters camera = true_camera();
  auto views = synthetic_views(camera, 0.05, rng);
  const Rigid3 camera_from_board = board_at({0.02, 0.01, 0.5}, {0.4, -0.3, 0.1});
  views.push_back(view_of(camera, camera_from_board, 0.08, rng));
  views.back().name = "unsteady";

  const CalibrateResult result = calibrate(kBoard, views, 960, 720, four_coefficients());

  ASSERT_TRUE(result.usable) << result.message;
  ASSERT_EQ(result.views.size(), 13U);
  EXPECT_EQ(result.views.back().name, "unsteady");
  EXPECT_NEAR(result.views.back().rms_px, 0.08, 0.015);
  EXPECT_NEAR(result.views.front().rms_px, 0.05, 0.01);
  const Rigid3 error = result.views.back().camera_from_board * inverse(camera_from_board);
  EXPECT_LT(rotation_vector(error.rotation).norm(), 5e-3);
}

TEST(Calibrate, GivesTheSameBitsWhereverTheHeapPutsItsNumbers) {
  std::mt19937_64 rng(7);
  const auto views = synthetic_views(true_camera(), 0.1, rng, kCoarseBoard);
  const auto numbers = [&] {
    std::vector<double> all;
    for (const auto& one : calibrate(kCoarseBoard, views, 960, 720, four_coefficients()).intrinsics)
      all.insert(all.end(), {one.value, one.sigma});
    return all;
  };
  const std::vector<double> here = numbers();
  ASSERT_FALSE(here.empty());

  for (unsigned seed = 0; seed < 4; ++seed) {
    const ScatteredHeap heap(seed);
    EXPECT_EQ(numbers(), here) << seed;
  }
}

TEST(Calibrate, RefusesTooFewViews) {
  std::mt19937_64 rng(5);
  auto views = synthetic_views(true_camera(), 0.1, rng);
  views.resize(2);

  const CalibrateResult result = calibrate(kBoard, views, 960, 720, {});

  EXPECT_FALSE(result.usable);
  EXPECT_THAT(result.message, testing::HasSubstr("2 pictures"));
}

TEST(Calibrate, RefusesParallelViews) {
  std::mt19937_64 rng(6);
  SCOPED_TRACE("seed 6");
  for (const double tilt : {0.0, 0.5}) {
    SCOPED_TRACE(tilt);
    std::vector<BoardView> views;
    for (int i = 0; i < 10; ++i)
      views.push_back(view_of(
          true_camera(), board_at({0.02 * (i % 3), 0.02 * (i % 4), 0.4 + 0.03 * i}, {tilt, 0, 0}),
          0.1, rng));

    const CalibrateResult result = calibrate(kBoard, views, 960, 720, four_coefficients());

    EXPECT_FALSE(result.usable) << result.message;
    EXPECT_THAT(result.message, testing::HasSubstr("focal length"));
    EXPECT_THAT(result.message, testing::HasSubstr("tilt the board"));
  }
}

TEST(Calibrate, RefusesWhatIsNotThisBoard) {
  std::mt19937_64 rng(7);
  auto views = synthetic_views(true_camera(), 0.1, rng);
  views[3].corners_px.pop_back();
  const CalibrateResult missing = calibrate(kBoard, views, 960, 720, {});
  EXPECT_FALSE(missing.usable);
  EXPECT_THAT(missing.message, testing::HasSubstr("view 3: 53 corners"));

  views = synthetic_views(true_camera(), 0.1, rng);
  views[4].corners_px[0].x() = std::nan("");
  EXPECT_FALSE(calibrate(kBoard, views, 960, 720, {}).usable);

  EXPECT_FALSE(calibrate({.columns = 9, .rows = 6, .square_m = 0}, views, 960, 720, {}).usable);

  for (auto& view : views)
    for (auto& corner : view.corners_px) corner = {100, 100};
  EXPECT_FALSE(calibrate(kBoard, views, 960, 720, {}).usable);
}

TEST(Calibrate, RefusesOptionsThatMeanNothing) {
  CalibrateOptions options;
  options.distortion_count = 6;
  EXPECT_THROW(options.validate(), InputError);
  options = {};
  options.outlier_sigmas = 0;
  EXPECT_THROW(options.validate(), InputError);
  EXPECT_NO_THROW(CalibrateOptions{}.validate());
}

TEST(Calibrate, FindsTheTrueFocalLengthOfTheBundledStills) {
  const std::filesystem::path folder =
      std::filesystem::path(CLOTHFIT_SOURCE_DIR) / "data/recordings/tags_onecam/calibration/front";
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) files.push_back(entry);
  std::sort(files.begin(), files.end());
  std::vector<BoardView> views;
  for (const auto& file : files) {
    const cv::Mat grey = cv::imread(file.string(), cv::IMREAD_GRAYSCALE);
    std::vector<cv::Point2f> corners;
    ASSERT_TRUE(cv::findChessboardCorners(grey, {kBoard.columns, kBoard.rows}, corners)) << file;
    cv::cornerSubPix(grey, corners, {5, 5}, {-1, -1}, {3, 50, 1e-4});
    BoardView view{.name = file.filename().string(), .corners_px = {}};
    for (const auto& corner : corners) view.corners_px.emplace_back(corner.x, corner.y);
    views.push_back(std::move(view));
  }

  const CalibrateResult result = calibrate(kBoard, views, 960, 720, {});

  // The camera that rendered the stills has 1012.3 px (tests/fixtures/truth/tags_onecam).
  ASSERT_TRUE(result.usable) << result.message;
  EXPECT_NEAR(result.camera.focal_px.x() / 1012.3, 1, 2e-3);
  EXPECT_NEAR(result.camera.focal_px.y() / 1012.3, 1, 2e-3);
  EXPECT_LT(result.rms_px, 0.1);
  EXPECT_LT(result.intrinsics[0].sigma, 1.5);
}

}  // namespace
}  // namespace clothfit
