#include "calib/bundle/camera_estimate.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "calib/bundle/robust_scale.h"
#include "data/algebra/dense_factors.h"

namespace clothfit {
namespace {

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

ceres::CostFunction* make_reprojection(const CameraEstimate& estimate,
                                       const Eigen::Vector2d& on_board_m,
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
/// distortion leave them undetermined: a zero and a pole of the ratio then come to lie inside the
/// picture, where they nearly cancel.
struct RationalPrior {
  static constexpr double kSigma = 1;
  double weight_px;
  template <class Real>
  bool operator()(const Real* intrinsics, Real* residual_px) const {
    for (int i = 0; i < 3; ++i) residual_px[i] = intrinsics[9 + i] * (weight_px / kSigma);
    return true;
  }
};

/// Adds every used corner to the problem, which points into `estimate`. `cauchy_scale_px` 0 stands
/// for plain least squares.
void build_problem(const BoardObservations& observations, double cauchy_scale_px,
                   CameraEstimate& estimate, ceres::Problem& problem) {
  for (size_t view = 0; view < observations.seen.size(); ++view) {
    double* pose = estimate.camera_from_board[view].data();
    bool any = false;
    for (size_t corner = 0; corner < observations.on_board_m.size(); ++corner) {
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
  if (estimate.distortion_count == 8 && problem.NumResidualBlocks() > 0)
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<RationalPrior, 3, 12>(
                                 new RationalPrior{estimate.corner_sigma_px}),
                             nullptr, estimate.intrinsics.data());
}

/// Returns the order in which unknowns are eliminated. Within a group Ceres goes by addresses, and
/// the poses lie in memory in the order of the views.
std::shared_ptr<ceres::ParameterBlockOrdering> poses_first(const ceres::Problem& problem,
                                                           CameraEstimate& estimate) {
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (PoseBlock& pose : estimate.camera_from_board)
    if (problem.HasParameterBlock(pose.data())) ordering->AddElementToGroup(pose.data(), 0);
  double* const intrinsics = estimate.intrinsics.data();
  if (problem.HasParameterBlock(intrinsics)) ordering->AddElementToGroup(intrinsics, 1);
  return ordering;
}

constexpr Eigen::Index kPoseTangent = 6;

/// Returns a part of a sparse matrix.
Eigen::MatrixXd dense(const ceres::CRSMatrix& sparse, Eigen::Index row, Eigen::Index rows,
                      Eigen::Index column, Eigen::Index columns) {
  Eigen::MatrixXd part = Eigen::MatrixXd::Zero(rows, columns);
  for (Eigen::Index r = 0; r < rows; ++r) {
    const auto begin = static_cast<size_t>(sparse.rows[static_cast<size_t>(row + r)]);
    const auto end = static_cast<size_t>(sparse.rows[static_cast<size_t>(row + r) + 1]);
    for (size_t at = begin; at < end; ++at) {
      const Eigen::Index c = sparse.cols[at] - column;
      if (c >= 0 && c < columns) part(r, c) = sparse.values[at];
    }
  }
  return part;
}

}  // namespace

bool CameraEstimate::is_active(size_t view) const {
  return std::ranges::find(used[view], char{1}) != used[view].end();
}

bool refine_camera(const BoardObservations& observations, double cauchy_scale_px,
                   CameraEstimate& estimate) {
  ceres::Problem problem;
  build_problem(observations, cauchy_scale_px, estimate, problem);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.linear_solver_ordering = poses_first(problem, estimate);
  options.max_num_iterations = 200;
  // Without an upper bound the damping vanishes in the flat basins of long distortion series. The
  // normal equations then become singular to rounding.
  options.max_trust_region_radius = 1e8;
  options.function_tolerance = 1e-12;
  options.parameter_tolerance = 1e-12;
  options.gradient_tolerance = 1e-14;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return summary.IsSolutionUsable();
}

std::vector<Eigen::Vector2d> view_residuals(const BoardObservations& observations,
                                            const CameraEstimate& estimate, size_t view) {
  std::vector<Eigen::Vector2d> residuals_px;
  const Rigid3 camera_from_board = from_block(estimate.camera_from_board[view]);
  for (size_t corner = 0; corner < observations.on_board_m.size(); ++corner) {
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

double robust_sigma_px(const BoardObservations& observations, const CameraEstimate& estimate) {
  std::vector<double> coordinates;
  for (size_t view = 0; view < observations.seen.size(); ++view) {
    if (!estimate.is_active(view)) continue;
    for (const auto& residual : view_residuals(observations, estimate, view)) {
      coordinates.push_back(residual.x());
      coordinates.push_back(residual.y());
    }
  }
  return robust_sigma(coordinates);
}

CameraParameters to_camera(const BoardObservations& observations, const CameraEstimate& estimate) {
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

std::optional<Eigen::VectorXd> intrinsic_sigmas(const BoardObservations& observations,
                                                double variance_px2, CameraEstimate& estimate) {
  ceres::Problem problem;
  build_problem(observations, 0, estimate, problem);
  const Eigen::Index n = estimate.intrinsics_count();
  ceres::Problem::EvaluateOptions evaluate;
  evaluate.parameter_blocks = {estimate.intrinsics.data()};
  for (size_t view = 0; view < observations.seen.size(); ++view)
    if (estimate.is_active(view))
      evaluate.parameter_blocks.push_back(estimate.camera_from_board[view].data());
  ceres::CRSMatrix sparse;
  if (!problem.Evaluate(evaluate, nullptr, nullptr, nullptr, &sparse)) return std::nullopt;

  Eigen::MatrixXd by_intrinsics = dense(sparse, 0, sparse.num_rows, 0, n);
  Eigen::Index row = 0, column = n;
  for (size_t view = 0; view < observations.seen.size(); ++view) {
    if (!estimate.is_active(view)) continue;
    const auto rows = static_cast<Eigen::Index>(2 * std::ranges::count(estimate.used[view], 1));
    if (rows < kPoseTangent) return std::nullopt;
    const PivotedQr pose(dense(sparse, row, rows, column, kPoseTangent));
    if (pose.rank() < kPoseTangent) return std::nullopt;
    const Eigen::MatrixXd q = pose.first_of_q(kPoseTangent);
    const Eigen::MatrixXd along = q.transpose() * by_intrinsics.middleRows(row, rows);
    by_intrinsics.middleRows(row, rows) -= q * along;
    row += rows;
    column += kPoseTangent;
  }
  // Columns are scaled to length 1: pixels and coefficients stay comparable.
  const Eigen::VectorXd scale = by_intrinsics.colwise().norm().cwiseInverse();
  if (by_intrinsics.rows() < n || !scale.allFinite()) return std::nullopt;
  const PivotedQr qr(by_intrinsics * scale.asDiagonal());
  if (qr.rank() < n) return std::nullopt;
  const Eigen::MatrixXd root = scale.asDiagonal() * qr.inverse_r();
  const Eigen::VectorXd sigmas = std::sqrt(variance_px2) * root.rowwise().norm();
  if (!sigmas.allFinite()) return std::nullopt;
  return sigmas;
}

}  // namespace clothfit
