#include "calib/calibrate.h"

#include <ceres/ceres.h>
#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <optional>
#include <utility>

#include "calib/pose_block.h"
#include "calib/pose_start.h"
#include "calib/projection.h"
#include "calib/robust_scale.h"
#include "calib/sheet_pose.h"
#include "data/input_error.h"

namespace clothfit {
namespace {

constexpr int kMinViews = 3;

/// The unknowns, and which of the observations take part.
struct Estimate {
  CameraModel model = CameraModel::pinhole;
  int distortion_count = 0;
  std::array<double, kMaxIntrinsics> intrinsics{};
  std::vector<PoseBlock> camera_from_board;  ///< one per view
  std::vector<std::vector<char>> used;       ///< per view and corner
  double corner_sigma_px = 0.1;              ///< weighs the corners against RationalPrior

  int intrinsics_count() const { return 4 + distortion_count; }
};

/// What is given, in the forms that the steps below need.
struct Observations {
  std::vector<Eigen::Vector2d> on_board_m;                ///< corners of the board, z = 0
  std::vector<const std::vector<Eigen::Vector2d>*> seen;  ///< per view, px
  double image_width = 0;
  double image_height = 0;
};

template <int kDistortionCount>
struct Reprojection {
  CameraModel model;
  Eigen::Vector2d on_board_m;
  Eigen::Vector2d observed_px;

  template <class Real>
  bool operator()(const Real* intrinsics, const Real* camera_from_board, Real* residual_px) const {
    const Eigen::Matrix<Real, 3, 1> on_board(Real(on_board_m.x()), Real(on_board_m.y()), Real(0.0));
    const Eigen::Matrix<Real, 3, 1> in_camera = transform(camera_from_board, on_board);
    if (!(in_camera[2] > Real(0.0))) return false;
    const Eigen::Matrix<Real, 2, 1> pixel =
        project<Real>(model, intrinsics, kDistortionCount, in_camera);
    residual_px[0] = pixel[0] - observed_px.x();
    residual_px[1] = pixel[1] - observed_px.y();
    return true;
  }

  static ceres::CostFunction* make(CameraModel model, const Eigen::Vector2d& on_board_m,
                                   const Eigen::Vector2d& observed_px) {
    return new ceres::AutoDiffCostFunction<Reprojection, 2, 4 + kDistortionCount, 7>(
        new Reprojection{model, on_board_m, observed_px});
  }
};

ceres::CostFunction* make_reprojection(const Estimate& estimate, const Eigen::Vector2d& on_board_m,
                                       const Eigen::Vector2d& observed_px) {
  switch (estimate.distortion_count) {
    case 4:
      return Reprojection<4>::make(estimate.model, on_board_m, observed_px);
    case 5:
      return Reprojection<5>::make(estimate.model, on_board_m, observed_px);
    case 8:
      return Reprojection<8>::make(estimate.model, on_board_m, observed_px);
    default:
      return Reprojection<0>::make(estimate.model, on_board_m, observed_px);
  }
}

/// Draws the denominator's coefficients of brown_conrady with 8 towards 0. Lenses with little
/// distortion leave them undetermined, and then the ratio runs off to where a zero and a pole
/// nearly cancel inside the picture.
struct RationalPrior {
  static constexpr double kSigma = 1;
  double weight_px;
  template <class Real>
  bool operator()(const Real* intrinsics, Real* residual_px) const {
    for (int i = 0; i < 3; ++i) residual_px[i] = intrinsics[9 + i] * (weight_px / kSigma);
    return true;
  }
};

/// Adds every used corner; `cauchy_scale_px` 0 stands for plain least squares. The problem points
/// into `estimate`.
void build_problem(const Observations& observations, double cauchy_scale_px, Estimate& estimate,
                   ceres::Problem& problem) {
  for (std::size_t view = 0; view < observations.seen.size(); ++view) {
    double* pose = estimate.camera_from_board[view].data();
    bool any = false;
    for (std::size_t corner = 0; corner < observations.on_board_m.size(); ++corner) {
      if (!estimate.used[view][corner]) continue;
      any = true;
      problem.AddResidualBlock(
          make_reprojection(estimate, observations.on_board_m[corner],
                            (*observations.seen[view])[corner]),
          cauchy_scale_px > 0 ? new ceres::CauchyLoss(cauchy_scale_px) : nullptr,
          estimate.intrinsics.data(), pose);
    }
    if (any) problem.SetManifold(pose, new PoseManifold);
  }
  if (estimate.distortion_count == 8 && problem.NumResidualBlocks() > 0) {
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<RationalPrior, 3, 12>(
                                 new RationalPrior{estimate.corner_sigma_px}),
                             nullptr, estimate.intrinsics.data());
  }
}

bool refine(const Observations& observations, double cauchy_scale_px, Estimate& estimate) {
  ceres::Problem problem;
  build_problem(observations, cauchy_scale_px, estimate, problem);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.max_num_iterations = 200;
  // Without an upper bound the damping fades away in the valleys of long distortion series, and
  // the normal equations become singular to rounding.
  options.max_trust_region_radius = 1e8;
  options.function_tolerance = 1e-12;
  options.parameter_tolerance = 1e-12;
  options.gradient_tolerance = 1e-14;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return summary.IsSolutionUsable();
}

/// Observed minus projected, px; infinite where a corner lies behind the camera.
std::vector<Eigen::Vector2d> view_residuals(const Observations& observations,
                                            const Estimate& estimate, std::size_t view) {
  std::vector<Eigen::Vector2d> residuals_px;
  const Rigid3 camera_from_board = from_block(estimate.camera_from_board[view]);
  for (std::size_t corner = 0; corner < observations.on_board_m.size(); ++corner) {
    const Eigen::Vector2d& on_board = observations.on_board_m[corner];
    const Eigen::Vector3d in_camera =
        camera_from_board * Eigen::Vector3d(on_board.x(), on_board.y(), 0);
    if (!(in_camera.z() > 0)) {
      residuals_px.push_back(Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity()));
      continue;
    }
    residuals_px.push_back((*observations.seen[view])[corner] -
                           project<double>(estimate.model, estimate.intrinsics.data(),
                                           estimate.distortion_count, in_camera));
  }
  return residuals_px;
}

bool is_active(const Estimate& estimate, std::size_t view) {
  const auto& used = estimate.used[view];
  return std::find(used.begin(), used.end(), char{1}) != used.end();
}

/// Robust standard deviation per coordinate over all corners of the active views, good or bad.
double robust_sigma_px(const Observations& observations, const Estimate& estimate) {
  std::vector<double> coordinates;
  for (std::size_t view = 0; view < observations.seen.size(); ++view) {
    if (!is_active(estimate, view)) continue;
    for (const auto& residual : view_residuals(observations, estimate, view)) {
      coordinates.push_back(residual.x());
      coordinates.push_back(residual.y());
    }
  }
  return robust_sigma(coordinates);
}

CameraParameters to_camera(const Observations& observations, const Estimate& estimate) {
  CameraParameters camera;
  camera.model = estimate.model;
  camera.image_width = static_cast<int>(observations.image_width);
  camera.image_height = static_cast<int>(observations.image_height);
  const auto& k = estimate.intrinsics;
  camera.focal_px = {k[0], k[1]};
  camera.centre_px = {k[2], k[3]};
  camera.distortion.assign(k.begin() + 4, k.begin() + estimate.intrinsics_count());
  return camera;
}

/// Focal lengths worth a start: the closed form from the homographies' orthogonality [zhang2000],
/// and, because it fails on views that are nearly parallel, a few that span usual lenses.
std::vector<Eigen::Vector2d> focal_candidates(const Observations& observations) {
  // A start has to live with distortion that is not known yet; gross errors are larger.
  const double tolerance_px =
      0.01 * std::hypot(observations.image_width, observations.image_height);
  std::vector<std::vector<cv::Point3f>> boards;
  std::vector<std::vector<cv::Point2f>> images;
  for (const auto* seen : observations.seen) {
    std::vector<cv::Point3f> board;
    std::vector<cv::Point2f> image;
    for (const int i : homography_inliers(observations.on_board_m, *seen, tolerance_px)) {
      const auto corner = static_cast<std::size_t>(i);
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
      if (focal.allFinite() && focal.minCoeff() > 0.1 * size_px &&
          focal.maxCoeff() < 100 * size_px) {
        candidates.push_back(focal);
      }
    } catch (const cv::Exception&) {  // views that do not determine it: the usual lenses remain
    }
  }
  for (const double factor : {0.6, 1.0, 1.6, 2.5, 5.0}) {
    candidates.push_back(Eigen::Vector2d::Constant(factor * size_px));
  }
  return candidates;
}

/// The camera without distortion at `focal_px` with the pose of each view; views without one are
/// left unused.
Estimate start_at(const Observations& observations, CameraModel model, int distortion_count,
                  const Eigen::Vector2d& focal_px) {
  Estimate start;
  start.model = model;
  start.distortion_count = distortion_count;
  const Eigen::Vector2d centre_px(0.5 * (observations.image_width - 1),
                                  0.5 * (observations.image_height - 1));
  start.intrinsics = {focal_px.x(), focal_px.y(), centre_px.x(), centre_px.y()};
  const double tolerance =
      0.01 * std::hypot(observations.image_width, observations.image_height) / focal_px.maxCoeff();
  for (const auto* seen : observations.seen) {
    std::vector<Eigen::Vector2d> on_image;
    for (const auto& pixel : *seen) {
      on_image.emplace_back((pixel - centre_px).cwiseQuotient(focal_px));
    }
    const auto poses = plane_poses(observations.on_board_m, on_image, tolerance);
    start.camera_from_board.push_back(to_block(poses.empty() ? Rigid3{} : poses.front()));
    start.used.emplace_back(seen->size(), poses.empty() ? char{0} : char{1});
  }
  return start;
}

Estimate best_start(const Observations& observations, CameraModel model, int distortion_count) {
  std::optional<Estimate> best;
  double best_sigma_px = std::numeric_limits<double>::infinity();
  for (const auto& focal_px : focal_candidates(observations)) {
    Estimate start = start_at(observations, model, distortion_count, focal_px);
    const double sigma_px = robust_sigma_px(observations, start);
    if (!best || sigma_px < best_sigma_px) {
      best = std::move(start);
      best_sigma_px = sigma_px;
    }
  }
  return *best;
}

double robust_cost(const std::vector<Eigen::Vector2d>& residuals_px, double scale_px) {
  double cost = 0;
  for (const auto& residual : residuals_px) {
    cost += std::log1p(residual.squaredNorm() / (scale_px * scale_px));
  }
  return cost;
}

/// A flat board far away looks nearly the same under two poses, and a view may have started in the
/// wrong one: takes the other where it fits better. True when a view was changed.
bool turn_views_round(const Observations& observations, double scale_px, Estimate& estimate) {
  const CameraParameters camera = to_camera(observations, estimate);
  bool changed = false;
  for (std::size_t view = 0; view < observations.seen.size(); ++view) {
    if (!is_active(estimate, view)) continue;
    std::vector<PlacedPixel> pixels;
    for (std::size_t corner = 0; corner < observations.on_board_m.size(); ++corner) {
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
    if (cost < 0.99 * cost_now) {
      changed = true;
    } else {
      estimate.camera_from_board[view] = pose_now;
    }
  }
  return changed;
}

/// Corners with a Cauchy loss whose scale follows the residuals down, so that gross errors lose
/// their pull while the distortion finds its shape.
bool refine_robustly(const Observations& observations, Estimate& estimate) {
  constexpr int kRounds = 8;
  constexpr double kCauchySigmas = 2;  // loses 5 % of efficiency on normal errors; no bias
  double sigma_px = robust_sigma_px(observations, estimate);
  bool turned_round = false;
  for (int round = 0; round < kRounds; ++round) {
    if (!refine(observations, kCauchySigmas * sigma_px, estimate)) return false;
    const double before_px = sigma_px;
    sigma_px = robust_sigma_px(observations, estimate);
    estimate.corner_sigma_px = sigma_px;
    if (sigma_px < 0.9 * before_px) continue;
    if (turned_round || !turn_views_round(observations, sigma_px, estimate)) return true;
    turned_round = true;
  }
  return true;
}

/// Plain least squares on the corners within `outlier_sigmas` robust sigma, until that set no
/// longer changes. A view with less than half of its corners good is left out as a whole: what else
/// agrees there may well be chance.
bool refine_on_good_corners(const Observations& observations, double outlier_sigmas,
                            Estimate& estimate) {
  constexpr int kRounds = 10;
  for (int round = 0; round < kRounds; ++round) {
    const double limit_px = outlier_sigmas * robust_sigma_px(observations, estimate);
    bool changed = round == 0;
    for (std::size_t view = 0; view < observations.seen.size(); ++view) {
      if (!is_active(estimate, view)) continue;
      auto& used = estimate.used[view];
      const auto residuals_px = view_residuals(observations, estimate, view);
      std::vector<char> good(used.size(), 0);
      std::size_t count = 0;
      for (std::size_t corner = 0; corner < good.size(); ++corner) {
        good[corner] = residuals_px[corner].norm() <= limit_px ? 1 : 0;
        count += static_cast<std::size_t>(good[corner]);
      }
      if (2 * count < good.size()) good.assign(good.size(), 0);
      changed = changed || good != used;
      used = std::move(good);
    }
    if (!changed) return true;
    if (!refine(observations, 0, estimate)) return false;
  }
  return true;
}

std::vector<std::string> intrinsic_names(CameraModel model) {
  if (model == CameraModel::kannala_brandt) return {"fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"};
  return {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"};
}

/// Standard deviations of the intrinsics: the inverse of the normal equations, times the variance
/// per coordinate. Nothing when the normal equations are singular.
std::optional<Eigen::VectorXd> intrinsic_sigmas(const Observations& observations,
                                                double variance_px2, Estimate& estimate) {
  ceres::Problem problem;
  build_problem(observations, 0, estimate, problem);
  ceres::Covariance covariance({});
  const double* block = estimate.intrinsics.data();
  const std::vector<std::pair<const double*, const double*>> wanted{{block, block}};
  if (!covariance.Compute(wanted, &problem)) return std::nullopt;
  const int n = estimate.intrinsics_count();
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> matrix(n, n);
  if (!covariance.GetCovarianceBlock(block, block, matrix.data())) return std::nullopt;
  const Eigen::VectorXd variance = variance_px2 * matrix.diagonal();
  if (!variance.allFinite() || variance.minCoeff() < 0) return std::nullopt;
  return Eigen::VectorXd(variance.cwiseSqrt());
}

/// Largest angle between the planes of any two active views.
double largest_tilt_rad(const Estimate& estimate) {
  std::vector<Eigen::Vector3d> normals;
  for (std::size_t view = 0; view < estimate.used.size(); ++view) {
    if (!is_active(estimate, view)) continue;
    normals.emplace_back(from_block(estimate.camera_from_board[view]).rotation *
                         Eigen::Vector3d::UnitZ());
  }
  double largest = 0;
  for (const auto& a : normals) {
    for (const auto& b : normals) {
      largest = std::max(largest, std::atan2(a.cross(b).norm(), std::abs(a.dot(b))));
    }
  }
  return largest;
}

/// Whether each used corner's pixel leads back to where the corner was: not so where the distortion
/// folds the picture over itself.
bool is_one_to_one(const Observations& observations, const Estimate& estimate) {
  const CameraParameters camera = to_camera(observations, estimate);
  for (std::size_t view = 0; view < observations.seen.size(); ++view) {
    const Rigid3 camera_from_board = from_block(estimate.camera_from_board[view]);
    for (std::size_t corner = 0; corner < observations.on_board_m.size(); ++corner) {
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

/// What is wrong with the observations as given; empty when nothing is.
std::string problem_with(const BoardDescription& board, const std::vector<BoardView>& views,
                         int image_width, int image_height) {
  if (board.columns < 3 || board.rows < 3 || !(board.square_m > 0)) {
    return fmt::format(
        "a board of {} x {} inner corners, {} m apart; 3 x 3 or more are needed, at a distance > 0",
        board.columns, board.rows, board.square_m);
  }
  if (image_width <= 0 || image_height <= 0) {
    return fmt::format("pictures of {} x {} px", image_width, image_height);
  }
  const auto corners = static_cast<std::size_t>(board.columns * board.rows);
  for (const auto& view : views) {
    if (view.corners_px.size() != corners) {
      return fmt::format("{}: {} corners; a board of {} x {} has {}", view.name,
                         view.corners_px.size(), board.columns, board.rows, corners);
    }
    for (const auto& corner : view.corners_px) {
      if (!corner.allFinite()) return fmt::format("{}: a corner that is not a number", view.name);
    }
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
  if (!(outlier_sigmas >= 2) || !std::isfinite(outlier_sigmas)) {
    throw InputError("outlier_sigmas", fmt::format("{}", outlier_sigmas),
                     "a number >= 2 (good corners are lost below that)");
  }
}

CalibrateResult calibrate(const BoardDescription& board, const std::vector<BoardView>& views,
                          int image_width, int image_height, const CalibrateOptions& options) {
  options.validate();
  CalibrateResult result;
  result.message = problem_with(board, views, image_width, image_height);
  if (!result.message.empty()) return result;

  Observations observations;
  observations.image_width = image_width;
  observations.image_height = image_height;
  for (int row = 0; row < board.rows; ++row) {
    for (int column = 0; column < board.columns; ++column) {
      observations.on_board_m.emplace_back(column * board.square_m, row * board.square_m);
    }
  }
  for (const auto& view : views) observations.seen.push_back(&view.corners_px);

  const int distortion_count = options.model == CameraModel::pinhole ? 0
                               : options.model == CameraModel::kannala_brandt
                                   ? 4
                                   : options.distortion_count;
  Estimate estimate = best_start(observations, options.model, distortion_count);
  if (!refine_robustly(observations, estimate) ||
      !refine_on_good_corners(observations, options.outlier_sigmas, estimate)) {
    result.message =
        fmt::format("the refinement found no camera that explains the corners; {}", kTiltAdvice);
    return result;
  }

  double sum_px2 = 0;
  int active_views = 0;
  for (std::size_t view = 0; view < views.size(); ++view) {
    ViewError error;
    error.name = views[view].name;
    error.camera_from_board = from_block(estimate.camera_from_board[view]);
    const auto residuals_px = view_residuals(observations, estimate, view);
    double view_sum_px2 = 0;
    for (std::size_t corner = 0; corner < residuals_px.size(); ++corner) {
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
    const auto at = static_cast<std::size_t>(i);
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
