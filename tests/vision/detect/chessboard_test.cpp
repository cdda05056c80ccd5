// Checks corners of a chessboard: order on drawn boards, precision on the bundled stills, whose
// boards' places are known. Calibrations from them are checked in tests/calib.

#include "vision/detect/chessboard.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include "calib/camera/projection.h"
#include "data/camera_parameters.h"
#include "data/input_error.h"
#include "vision/ingest/open_images.h"

namespace clothfit {
namespace {

const std::filesystem::path kSource = CLOTHFIT_SOURCE_DIR;

/// Draws a board of squares of 20 px with its first inner corner at (60, 50), seen from the front.
cv::Mat drawn_board(const BoardDescription& board) {
  cv::Mat big(4 * 260, 4 * 320, CV_8UC1, cv::Scalar(230));
  for (int r = 0; r <= board.rows; ++r) {
    for (int c = 0; c <= board.columns; ++c) {
      if ((r + c) % 2 != 0) continue;
      // Four pixels of the big picture make one; corner (60, 50) lies between pixels there.
      const cv::Rect square(4 * (40 + 20 * c) + 2, 4 * (30 + 20 * r) + 2, 80, 80);
      cv::rectangle(big, square, cv::Scalar(30), cv::FILLED);
    }
  }
  cv::Mat grey;
  cv::resize(big, grey, cv::Size(320, 260), 0, 0, cv::INTER_AREA);
  cv::GaussianBlur(grey, grey, cv::Size(), 0.6);
  return grey;
}

TEST(Chessboard, NumbersCornersRowByRowWithoutMirroring) {
  const BoardDescription board{.columns = 9, .rows = 6, .square_m = 0.02};
  const cv::Mat upright = drawn_board(board);
  cv::Mat turned;
  for (int quarter = 0; quarter < 4; ++quarter) {
    SCOPED_TRACE(quarter);
    constexpr std::array kTurn = {-1, +cv::ROTATE_90_CLOCKWISE, +cv::ROTATE_180,
                                  +cv::ROTATE_90_COUNTERCLOCKWISE};
    if (quarter == 0)
      turned = upright.clone();
    else
      cv::rotate(upright, turned, kTurn[static_cast<size_t>(quarter)]);

    const auto corners = find_chessboard(turned, board);

    ASSERT_TRUE(corners);
    ASSERT_EQ(corners->size(), 54U);
    // Neighbours in a row, and in a column, are one square apart; rows then columns turn as x, y.
    for (size_t i = 0; i + 1 < 54; ++i) {
      if (i % 9 != 8) {
        EXPECT_NEAR(((*corners)[i + 1] - (*corners)[i]).norm(), 20, 0.05);
      }
      if (i + 9 < 54) {
        EXPECT_NEAR(((*corners)[i + 9] - (*corners)[i]).norm(), 20, 0.05);
      }
    }
    const Eigen::Vector2d right = (*corners)[1] - (*corners)[0];
    const Eigen::Vector2d down = (*corners)[9] - (*corners)[0];
    EXPECT_GT(right.x() * down.y() - right.y() * down.x(), 0);
    if (quarter == 0) {
      EXPECT_NEAR((*corners)[0].x(), 60, 0.05);
      EXPECT_NEAR((*corners)[0].y(), 50, 0.05);
    }
  }
}

TEST(Chessboard, IsNotFoundWhereItIsNotWhole) {
  const BoardDescription board{.columns = 9, .rows = 6, .square_m = 0.02};
  cv::Mat picture = drawn_board(board);
  EXPECT_FALSE(find_chessboard(picture, {.columns = 8, .rows = 8, .square_m = 0.02}));
  picture.colRange(0, 100).setTo(230);

  EXPECT_FALSE(find_chessboard(picture, board));
  EXPECT_THROW(find_chessboard(picture, {.columns = 1, .rows = 6, .square_m = 0.02}), InputError);
}

/// Squares of 3 px, finer than any board's, fill the picture around a part that is left out.
cv::Mat fine_texture(cv::Size size) {
  cv::Mat picture(size, CV_8UC1);
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x)
      picture.at<std::uint8_t>(y, x) = (x / 3 + y / 3) % 2 == 0 ? 40 : 210;
  return picture;
}

TEST(Chessboard, IsFoundAmongMoreQuadrilateralsThanTheSearchTakesIn) {
  const BoardDescription board{.columns = 9, .rows = 6, .square_m = 0.02};
  const cv::Mat small = drawn_board(board);
  const auto alone = find_chessboard(small, board);
  ASSERT_TRUE(alone);
  cv::Mat picture = fine_texture({640, 520});
  const cv::Rect place(150, 130, small.cols, small.rows);
  small.copyTo(picture(place));

  const auto corners = find_chessboard(picture, board);

  ASSERT_TRUE(corners);
  ASSERT_EQ(corners->size(), alone->size());
  for (size_t i = 0; i < corners->size(); ++i)
    EXPECT_LT(((*corners)[i] - (*alone)[i] - Eigen::Vector2d(place.x, place.y)).norm(), 1e-3);
}

TEST(Chessboard, OfFewPixelsIsFoundBeforeANoisyWall) {
  const BoardDescription board{.columns = 9, .rows = 6, .square_m = 0.02};
  for (const int square_px : {6, 9, 14}) {
    SCOPED_TRACE(square_px);
    cv::Mat picture(720, 1280, CV_8UC1, cv::Scalar(150));
    const cv::Rect paper(300, 200, (board.columns + 3) * square_px, (board.rows + 3) * square_px);
    cv::rectangle(picture, paper, cv::Scalar(230), cv::FILLED);
    for (int r = 0; r <= board.rows; ++r)
      for (int c = r % 2; c <= board.columns; c += 2)
        cv::rectangle(picture,
                      cv::Rect(paper.x + (c + 1) * square_px, paper.y + (r + 1) * square_px,
                               square_px, square_px),
                      cv::Scalar(30), cv::FILLED);
    cv::Mat noise(picture.size(), CV_16SC1), noisy;
    cv::RNG(2).fill(noise, cv::RNG::NORMAL, 0, 2);
    picture.convertTo(noisy, CV_16S);
    noisy += noise;
    noisy.convertTo(noisy, CV_8U);

    const auto corners = find_chessboard(noisy, board);

    ASSERT_TRUE(corners);
    const Eigen::Vector2d first_px(paper.x + 2 * square_px - 0.5, paper.y + 2 * square_px - 0.5);
    EXPECT_LT((corners->front() - first_px).norm(), 0.2);
  }
}

TEST(Chessboard, IsNotFoundInNoise) {
  // Searched as it is, it takes a quarter of an hour.
  cv::Mat noise(1200, 1600, CV_8UC1);
  cv::RNG(1).fill(noise, cv::RNG::UNIFORM, 0, 256);

  EXPECT_FALSE(find_chessboard(noise, {.columns = 9, .rows = 6, .square_m = 0.02}));
}

TEST(Chessboard, LiesWhereTheBundledStillsWereRendered) {
  const std::filesystem::path truth = kSource / "tests/fixtures/truth/tags_onecam";
  const CameraParameters camera = read_camera(truth / "truth_camera_front.yaml");
  const nlohmann::json boards = nlohmann::json::parse(
      std::ifstream(truth / "truth.json"))["cameras"]["front"]["calibration_boards_to_world"];
  const BoardDescription board{.columns = 9, .rows = 6, .square_m = 0.025};
  const auto stills = open_images(kSource / "data/recordings/tags_onecam/calibration/front");

  std::vector<double> errors;
  cv::Mat grey;
  for (size_t i = 0; stills->next(grey); ++i) {
    const auto corners = find_chessboard(grey, board);
    ASSERT_TRUE(corners) << stills->current_name();
    Eigen::Matrix4d world_from_board;
    for (int r = 0; r < 4; ++r) {
      for (int c = 0; c < 4; ++c)
        world_from_board(r, c) = boards[i][static_cast<size_t>(r)][static_cast<size_t>(c)];
    }
    // The board's own axes start in its middle.
    std::vector<Eigen::Vector2d> expected;
    for (int r = 0; r < board.rows; ++r) {
      for (int c = 0; c < board.columns; ++c) {
        const Eigen::Vector4d point((c - 4.0) * board.square_m, (r - 2.5) * board.square_m, 0, 1);
        const Eigen::Vector3d world = (world_from_board * point).head<3>();
        expected.push_back(*project(camera, camera_from_world(camera) * world));
      }
    }
    for (const Eigen::Vector2d& corner : *corners) {
      double nearest = INFINITY;
      for (const Eigen::Vector2d& place : expected)
        nearest = std::min(nearest, (corner - place).norm());
      errors.push_back(nearest);
    }
  }

  ASSERT_EQ(errors.size(), 15U * 54U);
  std::sort(errors.begin(), errors.end());
  RecordProperty("median_px", std::to_string(errors[errors.size() / 2]));
  RecordProperty("p95_px", std::to_string(errors[errors.size() * 95 / 100]));
  EXPECT_LT(errors[errors.size() / 2], 0.1);
  EXPECT_LT(errors[errors.size() * 95 / 100], 0.25);
}

}  // namespace
}  // namespace clothfit
