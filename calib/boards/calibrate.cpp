#include "calib/boards/calibrate.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <utility>

#include "calib/boards/camera_start.h"
#include "calib/bundle/camera_estimate.h"
#include "calib/placement/sheet_pose.h"
#include "data/input_error.h"

namespace clothfit {
namespace {

constexpr int kMinViews = 3;

double robust_cost(const std::vector<Eigen::Vector2d>& residuals_px, double scale_px) {
  double cost = 0;
  for (const auto& residual : residuals_px)
    cost += std::log1p(residual.squaredNorm() / (scale_px * scale_px));
  return cost;
}

/// Gives a view the other of its two poses where that fits better; true when a view was changed. A
/// flat board far away looks nearly the same under both, and a view may have started in the wrong
/// one.
bool turn_views_round(const BoardObservations& observations, double scale_px,
                      CameraEstimate& estimate) {
  const CameraParameters camera = to_camera(observations, estimate);
  bool changed = false;
  for (size_t view = 0; view < observations.seen.size(); ++view) {
    if (!estimate.is_active(view)) continue;
    std::vector<PlacedPixel> pixels;
    for (size_t corner = 0; corner < observations.on_board_m.size(); ++corner) {
      const Eigen::Vector2d& on_board = observations.on_board_m[corner];
      pixels.push_back({.point_m = {on_board.x(), on_board.y(), 0},
                        .pixel_px = (*observations.seen[view])[corner],
                        .sigma_px = scale_px});
    }
    const SheetPoseResult placed = place_sheet(camera, pixels);
    if (!placed.usable) continue;
    const double cost_now = robust_cost(view_residuals(observations, estimate, view), scale_px);
    const PoseBlock pose_now = estimate.camera_from_board[view];
    estimate.camera_from_board[view] = to_block(placed.camera_from_sheet);
    const double cost = robust_cost(view_residuals(observations, estimate, view), scale_px);
    if (cost < 0.99 * cost_now)
      changed = true;
    else
      estimate.camera_from_board[view] = pose_now;
  }
  return changed;
}

/// Fits the corners under a Cauchy loss whose scale follows the residuals down. Gross errors then
/// lose their pull while the distortion is still being found.
bool refine_robustly(const BoardObservations& observations, CameraEstimate& estimate) {
  constexpr int kRounds = 8;
  constexpr double kCauchySigmas = 2;  // loses 5 % of efficiency on normal errors; no bias
  double sigma_px = robust_sigma_px(observations, estimate);
  bool turned_round = false;
  for (int round = 0; round < kRounds; ++round) {
    if (!refine_camera(observations, kCauchySigmas * sigma_px, estimate)) return false;
    const double before_px = sigma_px;
    sigma_px = robust_sigma_px(observations, estimate);
    estimate.corner_sigma_px = sigma_px;
    if (sigma_px < 0.9 * before_px) continue;
    if (turned_round || !turn_views_round(observations, sigma_px, estimate)) return true;
    turned_round = true;
  }
  return true;
}

/// Fits by least squares the corners within `outlier_sigmas` robust sigma, until that set stays the
/// same. A view with less than half of its corners good is left out as a whole: its good corners
/// may well agree by chance.
bool refine_on_good_corners(const BoardObservations& observations, double outlier_sigmas,
                            CameraEstimate& estimate) {
  constexpr int kRounds = 10;
  for (int round = 0; round < kRounds; ++round) {
    const double limit_px = outlier_sigmas * robust_sigma_px(observations, estimate);
    bool changed = round == 0;
    for (size_t view = 0; view < observations.seen.size(); ++view) {
      if (!estimate.is_active(view)) continue;
      auto& used = estimate.used[view];
      const auto residuals_px = view_residuals(observations, estimate, view);
      std::vector<char> good(used.size(), 0);
      size_t count = 0;
      for (size_t corner = 0; corner < good.size(); ++corner) {
        good[corner] = residuals_px[corner].norm() <= limit_px ? 1 : 0;
        count += static_cast<size_t>(good[corner]);
      }
      if (2 * count < good.size()) good.assign(good.size(), 0);
      changed = changed || good != used;
      used = std::move(good);
    }
    if (!changed) return true;
    if (!refine_camera(observations, 0, estimate)) return false;
  }
  return true;
}

std::vector<std::string> intrinsic_names(CameraModel model) {
  if (model == CameraModel::kannala_brandt) return {"fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"};
  return {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"};
}

/// Returns the largest angle between the planes of any two active views.
double largest_tilt_rad(const CameraEstimate& estimate) {
  std::vector<Eigen::Vector3d> normals;
  for (size_t view = 0; view < estimate.used.size(); ++view) {
    if (!estimate.is_active(view)) continue;
    normals.emplace_back(from_block(estimate.camera_from_board[view]).rotation *
                         Eigen::Vector3d::UnitZ());
  }
  double largest = 0;
  for (const auto& a : normals)
    for (const auto& b : normals)
      largest = std::max(largest, std::atan2(a.cross(b).norm(), std::abs(a.dot(b))));
  return largest;
}

/// Says whether each used corner's pixel leads back to that corner. It does not where the
/// distortion folds the picture over itself.
bool is_one_to_one(const BoardObservations& observations, const CameraEstimate& estimate) {
  const CameraParameters camera = to_camera(observations, estimate);
  for (size_t view = 0; view < observations.seen.size(); ++view) {
    const Rigid3 camera_from_board = from_block(estimate.camera_from_board[view]);
    for (size_t corner = 0; corner < observations.on_board_m.size(); ++corner) {
      if (!estimate.used[view][corner]) continue;
      const Eigen::Vector2d& on_board = observations.on_board_m[corner];
      const Eigen::Vector3d in_camera =
          camera_from_board * Eigen::Vector3d(on_board.x(), on_board.y(), 0);
      const auto pixel = project(camera, in_camera);
      if (!pixel) return false;
      const auto direction = unproject(camera, *pixel);
      if (!direction || (*direction - in_camera.normalized()).norm() > 1e-6) return false;
    }
  }
  return true;
}

/// Says what is wrong with the observations as given; empty when nothing is.
std::string problem_with(const BoardDescription& board, const std::vector<BoardView>& views,
                         int image_width, int image_height) {
  if (board.columns < 3 || board.rows < 3 || !(board.square_m > 0)) {
    return fmt::format(
        "a board of {} x {} inner corners, {} m apart; 3 x 3 or more are needed, at a distance > 0",
        board.columns, board.rows, board.square_m);
  }
  if (image_width <= 0 || image_height <= 0)
    return fmt::format("pictures of {} x {} px", image_width, image_height);
  const auto corners = static_cast<size_t>(board.columns * board.rows);
  for (const auto& view : views) {
    if (view.corners_px.size() != corners) {
      return fmt::format("{}: {} corners; a board of {} x {} has {}", view.name,
                         view.corners_px.size(), board.columns, board.rows, corners);
    }
    for (const auto& corner : view.corners_px)
      if (!corner.allFinite()) return fmt::format("{}: a corner that is not a number", view.name);
  }
  if (views.size() < kMinViews) {
    return fmt::format(
        "the board was found in {} pictures; {} or more are needed, 10 to 20 are good; hold it at "
        "different tilts",
        views.size(), kMinViews);
  }
  return {};
}

constexpr const char* kTiltAdvice = "tilt the board by 30 degrees or more, in different directions";

}  // namespace

void CalibrateOptions::validate() const {
  if (model == CameraModel::brown_conrady && distortion_count != 4 && distortion_count != 5 &&
      distortion_count != 8) {
    throw InputError("distortion_count", fmt::format("{}", distortion_count),
                     "brown_conrady has 4, 5 or 8 coefficients");
  }
  if (!(outlier_sigmas >= 2) || !std::isfinite(outlier_sigmas))
    throw InputError("outlier_sigmas", fmt::format("{}", outlier_sigmas),
                     "a number >= 2 (good corners are lost below that)");
}

CalibrateResult calibrate(const BoardDescription& board, const std::vector<BoardView>& views,
                          int image_width, int image_height, const CalibrateOptions& options) {
  options.validate();
  CalibrateResult result;
  result.message = problem_with(board, views, image_width, image_height);
  if (!result.message.empty()) return result;

  BoardObservations observations;
  observations.image_width = image_width;
  observations.image_height = image_height;
  for (int row = 0; row < board.rows; ++row)
    for (int column = 0; column < board.columns; ++column)
      observations.on_board_m.emplace_back(column * board.square_m, row * board.square_m);
  for (const auto& view : views) observations.seen.push_back(&view.corners_px);

  const int distortion_count = options.model == CameraModel::pinhole ? 0
                               : options.model == CameraModel::kannala_brandt
                                   ? 4
                                   : options.distortion_count;
  CameraEstimate estimate = start_estimate(observations, options.model, distortion_count);
  if (!refine_robustly(observations, estimate) ||
      !refine_on_good_corners(observations, options.outlier_sigmas, estimate)) {
    result.message =
        fmt::format("the refinement found no camera that explains the corners; {}", kTiltAdvice);
    return result;
  }

  double sum_px2 = 0;
  int active_views = 0;
  for (size_t view = 0; view < views.size(); ++view) {
    ViewError error;
    error.name = views[view].name;
    error.camera_from_board = from_block(estimate.camera_from_board[view]);
    const auto residuals_px = view_residuals(observations, estimate, view);
    double view_sum_px2 = 0;
    for (size_t corner = 0; corner < residuals_px.size(); ++corner) {
      if (!estimate.used[view][corner]) {
        ++error.rejected;
        continue;
      }
      ++error.used;
      view_sum_px2 += residuals_px[corner].squaredNorm();
    }
    if (error.used > 0) {
      error.rms_px = std::sqrt(view_sum_px2 / (2 * error.used));
      ++active_views;
    }
    sum_px2 += view_sum_px2;
    result.corners_used += error.used;
    result.corners_rejected += error.rejected;
    result.views.push_back(std::move(error));
  }
  if (active_views < kMinViews) {
    result.message = fmt::format(
        "only {} of {} views fit one camera and one flat board; check the board's size, and that "
        "all pictures come from one camera with its zoom and focus fixed",
        active_views, views.size());
    return result;
  }
  result.rms_px = std::sqrt(sum_px2 / (2 * result.corners_used));
  result.camera = to_camera(observations, estimate);

  const int unknowns = estimate.intrinsics_count() + 6 * active_views;
  const double variance_px2 = sum_px2 / (2 * result.corners_used - unknowns);
  const auto sigmas = intrinsic_sigmas(observations, variance_px2, estimate);
  constexpr double kSmallestTilt = 0.09;          // 5 degrees between the two most different views
  constexpr double kLargestRelativeSigma = 0.02;  // of a focal length that is determined
  if (!sigmas || largest_tilt_rad(estimate) < kSmallestTilt) {
    result.message = fmt::format(
        "the views do not determine the focal length (the boards are nearly parallel); {}",
        kTiltAdvice);
    return result;
  }
  const auto names = intrinsic_names(options.model);
  for (int i = 0; i < estimate.intrinsics_count(); ++i) {
    const auto at = static_cast<size_t>(i);
    result.intrinsics.push_back({names[at], estimate.intrinsics[at], (*sigmas)[i]});
  }
  const double relative_sigma =
      sigmas->head<2>().cwiseQuotient(result.camera.focal_px).cwiseAbs().maxCoeff();
  if (!(result.camera.focal_px.minCoeff() > 0) || relative_sigma > kLargestRelativeSigma) {
    result.message =
        fmt::format("the views leave the focal length undetermined ({:.0f} px, sigma {:.1f} %); {}",
                    result.camera.focal_px.x(), 100 * relative_sigma, kTiltAdvice);
    return result;
  }
  if (!is_one_to_one(observations, estimate)) {
    result.message =
        "the distortion that fits best folds the picture over itself; use fewer coefficients, or "
        "more views that reach into the corners of the picture";
    return result;
  }
  result.usable = true;
  result.message = fmt::format(
      "focal length {:.2f} x {:.2f} px, sigma {:.2f} and {:.2f}, from {} views; rms {:.3f} px, {} "
      "of "
      "{} corners left out",
      result.camera.focal_px.x(), result.camera.focal_px.y(), (*sigmas)[0], (*sigmas)[1],
      active_views, result.rms_px, result.corners_rejected,
      result.corners_used + result.corners_rejected);
  return result;
}

}  // namespace clothfit
