#include "calib/boards/camera_start.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <optional>
#include <utility>

#include "calib/bundle/pose_start.h"

namespace clothfit {
namespace {

/// Returns focal lengths worth a start. The first is the closed form from the homographies'
/// orthogonality [zhang2000]; it fails on views that are nearly parallel, so a few that span usual
/// lenses follow.
std::vector<Eigen::Vector2d> focal_candidates(const BoardObservations& observations) {
  // A start knows no distortion yet, so the tolerance covers it; gross errors are larger.
  const double tolerance_px =
      0.01 * std::hypot(observations.image_width, observations.image_height);
  std::vector<std::vector<cv::Point3f>> boards;
  std::vector<std::vector<cv::Point2f>> images;
  for (const auto* seen : observations.seen) {
    std::vector<cv::Point3f> board;
    std::vector<cv::Point2f> image;
    for (const int i : homography_inliers(observations.on_board_m, *seen, tolerance_px)) {
      const auto corner = static_cast<size_t>(i);
      const Eigen::Vector2f on_board = observations.on_board_m[corner].cast<float>();
      const Eigen::Vector2f pixel = (*seen)[corner].cast<float>();
      board.emplace_back(on_board.x(), on_board.y(), 0.0F);
      image.emplace_back(pixel.x(), pixel.y());
    }
    if (2 * board.size() < seen->size()) continue;
    boards.push_back(std::move(board));
    images.push_back(std::move(image));
  }
  const double size_px = std::max(observations.image_width, observations.image_height);
  std::vector<Eigen::Vector2d> candidates;
  if (!boards.empty()) {
    try {
      const cv::Mat_<double> matrix =
          cv::initCameraMatrix2D(boards, images,
                                 cv::Size(static_cast<int>(observations.image_width),
                                          static_cast<int>(observations.image_height)),
                                 0);
      const Eigen::Vector2d focal(matrix(0, 0), matrix(1, 1));
      if (focal.allFinite() && focal.minCoeff() > 0.1 * size_px && focal.maxCoeff() < 100 * size_px)
        candidates.push_back(focal);
    } catch (const cv::Exception&) {  // views that do not determine it: the usual lenses remain
    }
  }
  for (const double factor : {0.6, 1.0, 1.6, 2.5, 5.0})
    candidates.push_back(Eigen::Vector2d::Constant(factor * size_px));
  return candidates;
}

/// Returns the camera without distortion at `focal_px`, with the pose of each view. Views without a
/// pose are left unused.
CameraEstimate start_at(const BoardObservations& observations, CameraModel model,
                        int distortion_count, const Eigen::Vector2d& focal_px) {
  CameraEstimate start;
  start.model = model;
  start.distortion_count = distortion_count;
  const Eigen::Vector2d centre_px(0.5 * (observations.image_width - 1),
                                  0.5 * (observations.image_height - 1));
  start.intrinsics = {focal_px.x(), focal_px.y(), centre_px.x(), centre_px.y()};
  const double tolerance =
      0.01 * std::hypot(observations.image_width, observations.image_height) / focal_px.maxCoeff();
  for (const auto* seen : observations.seen) {
    std::vector<Eigen::Vector2d> on_image;
    for (const auto& pixel : *seen)
      on_image.emplace_back((pixel - centre_px).cwiseQuotient(focal_px));
    const auto poses = plane_poses(observations.on_board_m, on_image, tolerance);
    start.camera_from_board.push_back(to_block(poses.empty() ? Rigid3{} : poses.front()));
    start.used.emplace_back(seen->size(), poses.empty() ? char{0} : char{1});
  }
  return start;
}

}  // namespace

CameraEstimate start_estimate(const BoardObservations& observations, CameraModel model,
                              int distortion_count) {
  std::optional<CameraEstimate> best;
  double best_sigma_px = std::numeric_limits<double>::infinity();
  for (const auto& focal_px : focal_candidates(observations)) {
    CameraEstimate start = start_at(observations, model, distortion_count, focal_px);
    const double sigma_px = robust_sigma_px(observations, start);
    if (!best || sigma_px < best_sigma_px) {
      best = std::move(start);
      best_sigma_px = sigma_px;
    }
  }
  return *best;
}

}  // namespace clothfit
