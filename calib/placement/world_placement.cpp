#include "calib/placement/world_placement.h"

#include <ceres/ceres.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "calib/bundle/exact_pose.h"
#include "calib/bundle/pose_block.h"
#include "calib/bundle/pose_start.h"
#include "calib/placement/sheet_pose.h"
#include "calib/placement/tag_squares.h"
#include "data/algebra/dense_factors.h"

namespace clothfit {
namespace {

struct PixelOfPoint {
  const FixedCamera* camera;
  const PlacedPixel* observed;
  template <class Real>
  bool operator()(const Real* camera_from_world, const Real* place, Real* out) const {
    const Eigen::Matrix<Real, 3, 1> point(place[0], place[1], place[2]);
    return camera->residual<Real>(transform(camera_from_world, point), *observed, out);
  }
};

struct SurveyOfPoint {
  const PlacedPixel* surveyed;
  double sigma_m;
  template <class Real>
  bool operator()(const Real* place, Real* out) const {
    for (int i = 0; i < 3; ++i) out[i] = (place[i] - surveyed->point_m[i]) / sigma_m;
    return true;
  }
};

template <class Real>
Eigen::Matrix<Real, 3, 1> square_corner(size_t k, const Real* world_from_square,
                                        const Real* side_m) {
  const Eigen::Matrix<Real, 3, 1> corner = unit_square_corner(k).cast<Real>() * side_m[0];
  return transform(world_from_square, corner);
}

struct PixelOfSquare {
  const FixedCamera* camera;
  const PlacedPixel* observed;
  size_t corner;
  double sigma_factor;
  template <class Real>
  bool operator()(const Real* camera_from_world, const Real* world_from_square, const Real* side_m,
                  Real* out) const {
    const Eigen::Matrix<Real, 3, 1> place = square_corner(corner, world_from_square, side_m);
    if (!camera->residual<Real>(transform(camera_from_world, place), *observed, out)) return false;
    out[0] /= Real(sigma_factor);
    out[1] /= Real(sigma_factor);
    return true;
  }
};

struct SideLikeTheOthers {
  double sigma_m;
  template <class Real>
  bool operator()(const Real* side_m, const Real* common_side_m, Real* out) const {
    out[0] = (side_m[0] - common_side_m[0]) / Real(sigma_m);
    return true;
  }
};

struct SurveyOfSquare {
  const PlacedPixel* surveyed;
  double sigma_m;
  size_t corner;
  template <class Real>
  bool operator()(const Real* world_from_square, const Real* side_m, Real* out) const {
    const Eigen::Matrix<Real, 3, 1> place = square_corner(corner, world_from_square, side_m);
    for (int i = 0; i < 3; ++i) out[i] = (place[i] - surveyed->point_m[i]) / sigma_m;
    return true;
  }
};

/// Relative standard deviation of the sides of tags printed alike. It covers the accuracy of a
/// printer and the detector's bias from one tag to the next.
constexpr double kPrintTolerance = 1e-3;

/// All unknowns of the placement.
struct WorldUnknowns {
  PoseBlock camera_from_world{};
  std::vector<TagSquare> squares;
  std::vector<PoseBlock> world_from_square;
  std::vector<double> common_sides_m;          ///< of squares that are alike
  std::vector<size_t> single;                  ///< points that belong to no square
  std::vector<std::array<double, 3>> place_m;  ///< of the single points
};

/// The two standard deviations that the data themselves decide.
struct Spread {
  double survey_sigma_m = 1e-3;
  /// Pixels of squares, in units of the stated sigma, >= 1. Paper that is not quite flat and tags
  /// that are not quite alike raise it.
  double square_factor = 1;
};

/// The state after one solve.
struct WorldSolve {
  bool usable = false;
  double survey_sum = 0;         ///< of squared standardised residuals of the survey
  double survey_redundancy = 0;  ///< survey coordinates less those that the unknowns use up
  double square_sum = 0;         ///< the same for pixels of squares
  double square_redundancy = 0;
  Eigen::Matrix<double, 6, 6> covariance;
};

/// Lists all unknowns, the camera's pose first, so that its tangent holds the first six columns.
/// Ceres would list them in the order of their addresses, in which sums round differently from run
/// to run.
std::vector<double*> blocks_in_order(WorldUnknowns& unknowns) {
  std::vector<double*> blocks{unknowns.camera_from_world.data()};
  for (PoseBlock& square : unknowns.world_from_square) blocks.push_back(square.data());
  for (TagSquare& square : unknowns.squares) blocks.push_back(&square.side_m);
  for (double& side_m : unknowns.common_sides_m) blocks.push_back(&side_m);
  for (std::array<double, 3>& place_m : unknowns.place_m) blocks.push_back(place_m.data());
  return blocks;
}

WorldSolve solve_world(const FixedCamera& camera, const std::vector<PlacedPixel>& reference,
                       const Spread& spread, WorldUnknowns& unknowns) {
  ceres::Problem problem;
  double* pose = unknowns.camera_from_world.data();
  problem.AddParameterBlock(pose, 7, new PoseManifold);
  std::vector<ceres::ResidualBlockId> square_pixels, others, surveys;
  for (size_t s = 0; s < unknowns.squares.size(); ++s) {
    double* square = unknowns.world_from_square[s].data();
    double* side = &unknowns.squares[s].side_m;
    double* common_side = &unknowns.common_sides_m[unknowns.squares[s].alike];
    problem.AddParameterBlock(square, 7, new PoseManifold);
    others.push_back(
        problem.AddResidualBlock(new ceres::AutoDiffCostFunction<SideLikeTheOthers, 1, 1, 1>(
                                     new SideLikeTheOthers{kPrintTolerance * *common_side}),
                                 nullptr, side, common_side));
    for (size_t k = 0; k < 4; ++k) {
      const PlacedPixel* point = &reference[unknowns.squares[s].corners[k]];
      square_pixels.push_back(
          problem.AddResidualBlock(new ceres::AutoDiffCostFunction<PixelOfSquare, 2, 7, 7, 1>(
                                       new PixelOfSquare{&camera, point, k, spread.square_factor}),
                                   nullptr, pose, square, side));
      surveys.push_back(
          problem.AddResidualBlock(new ceres::AutoDiffCostFunction<SurveyOfSquare, 3, 7, 1>(
                                       new SurveyOfSquare{point, spread.survey_sigma_m, k}),
                                   nullptr, square, side));
    }
  }
  for (size_t i = 0; i < unknowns.single.size(); ++i) {
    const PlacedPixel* point = &reference[unknowns.single[i]];
    double* place = unknowns.place_m[i].data();
    others.push_back(problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<PixelOfPoint, 2, 7, 3>(new PixelOfPoint{&camera, point}),
        nullptr, pose, place));
    surveys.push_back(problem.AddResidualBlock(new ceres::AutoDiffCostFunction<SurveyOfPoint, 3, 3>(
                                                   new SurveyOfPoint{point, spread.survey_sigma_m}),
                                               nullptr, place));
  }

  WorldSolve result;
  ceres::Solver::Summary summary;
  ceres::Solve(solver_options(), &problem, &summary);
  if (!summary.IsSolutionUsable()) return result;

  ceres::Problem::EvaluateOptions evaluate;
  evaluate.residual_blocks = square_pixels;
  evaluate.residual_blocks.insert(evaluate.residual_blocks.end(), others.begin(), others.end());
  evaluate.residual_blocks.insert(evaluate.residual_blocks.end(), surveys.begin(), surveys.end());
  evaluate.parameter_blocks = blocks_in_order(unknowns);
  std::vector<double> residuals;
  ceres::CRSMatrix sparse;
  if (!problem.Evaluate(evaluate, nullptr, &residuals, nullptr, &sparse)) return result;
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(sparse.num_rows, sparse.num_cols);
  for (int row = 0; row < sparse.num_rows; ++row) {
    const auto begin = static_cast<size_t>(sparse.rows[static_cast<size_t>(row)]);
    const auto end = static_cast<size_t>(sparse.rows[static_cast<size_t>(row) + 1]);
    for (size_t at = begin; at < end; ++at) jacobian(row, sparse.cols[at]) = sparse.values[at];
  }

  // Columns are scaled to length 1: metres and radians, pixels and millimetres stay comparable.
  const Eigen::VectorXd scale = jacobian.colwise().norm().cwiseInverse();
  if (!scale.allFinite()) return result;
  const PivotedQr qr(jacobian * scale.asDiagonal());
  if (qr.rank() < jacobian.cols()) return result;
  const Eigen::Index n = jacobian.cols();
  const Eigen::MatrixXd thin_q = qr.first_of_q(n);
  const Eigen::MatrixXd root = scale.asDiagonal() * qr.inverse_r();
  result.covariance = (root * root.transpose()).topLeftCorner<6, 6>();

  const auto survey_rows = static_cast<Eigen::Index>(3 * surveys.size());
  const Eigen::Map<const Eigen::VectorXd> all(residuals.data(),
                                              static_cast<Eigen::Index>(residuals.size()));
  result.survey_sum = all.tail(survey_rows).squaredNorm();
  result.survey_redundancy =
      static_cast<double>(survey_rows) - thin_q.bottomRows(survey_rows).squaredNorm();
  const auto square_rows = static_cast<Eigen::Index>(2 * square_pixels.size());
  result.square_sum = all.head(square_rows).squaredNorm();
  result.square_redundancy =
      static_cast<double>(square_rows) - thin_q.topRows(square_rows).squaredNorm();
  result.usable = true;
  return result;
}

/// Finds the camera pose with the lowest robust spread, the surveyed places taken as exact.
std::optional<Rigid3> start_world(const CameraParameters& parameters, const FixedCamera& camera,
                                  const std::vector<PlacedPixel>& reference) {
  const auto image = on_image_plane(parameters, reference);
  if (!image) return std::nullopt;
  Eigen::Matrix3Xd points(3, static_cast<Eigen::Index>(reference.size()));
  std::vector<Eigen::Vector3d> in_world_m;
  for (size_t i = 0; i < reference.size(); ++i) {
    points.col(static_cast<Eigen::Index>(i)) = reference[i].point_m;
    in_world_m.push_back(reference[i].point_m);
  }
  std::vector<Rigid3> candidates;
  if (const auto pose = point_pose(in_world_m, *image)) candidates.push_back(*pose);

  // Points in nearly one plane look nearly the same under two poses, so both are tried.
  const Eigen::Vector3d middle = points.rowwise().mean();
  const SingularVectors svd = left_singular_vectors(points.colwise() - middle);
  if (svd.values[1] < 1e-3 * svd.values[0]) return std::nullopt;  // on a line
  Eigen::Matrix3d axes = svd.vectors;
  if (axes.determinant() < 0) axes.col(2) *= -1;
  const Rigid3 world_from_plane{Eigen::Quaterniond(axes), middle};
  std::vector<Eigen::Vector2d> on_plane_m;
  for (const auto& point : in_world_m)
    on_plane_m.emplace_back((inverse(world_from_plane) * point).head<2>());
  for (const auto& camera_from_plane : plane_poses(on_plane_m, *image))
    candidates.push_back(camera_from_plane * inverse(world_from_plane));

  std::optional<RobustPose> best;
  for (const auto& candidate : candidates) {
    const RobustPose refined = refine_pose_robustly(camera, reference, candidate);
    if (!best || refined.spread < best->spread) best = refined;
  }
  if (!best || !std::isfinite(best->spread)) return std::nullopt;
  return best->camera_from_world;
}

/// Returns the reference points that agree with the pose. A corner misread or a place written down
/// wrongly is off by centimetres. Other points are off by the survey's error, whose size is not
/// known yet, seen across the ray.
std::vector<PlacedPixel> without_blunders(const FixedCamera& camera,
                                          const std::vector<PlacedPixel>& reference,
                                          const Rigid3& camera_from_world) {
  constexpr double kBlunderSpreads = 8;
  const auto residuals = standardised_residuals(camera, reference, camera_from_world);
  std::vector<Eigen::Vector2d> across_ray_m;
  for (size_t i = 0; i < reference.size(); ++i) {
    const double depth_m = (camera_from_world * reference[i].point_m).z();
    across_ray_m.emplace_back(residuals[i] * reference[i].sigma_px * depth_m /
                              camera.intrinsics[0]);
  }
  const double limit_m = kBlunderSpreads * robust_spread(across_ray_m);
  std::vector<PlacedPixel> good;
  for (size_t i = 0; i < reference.size(); ++i)
    if (across_ray_m[i].norm() <= limit_m) good.push_back(reference[i]);
  return good;
}

WorldUnknowns first_unknowns(const std::vector<PlacedPixel>& reference,
                             const Rigid3& camera_from_world) {
  WorldUnknowns unknowns;
  unknowns.camera_from_world = to_block(camera_from_world);
  unknowns.squares = find_tag_squares(reference, unknowns.common_sides_m);
  std::vector<char> in_square(reference.size(), 0);
  for (const auto& square : unknowns.squares) {
    unknowns.world_from_square.push_back(to_block(square.world_from_square));
    for (const size_t corner : square.corners) in_square[corner] = 1;
  }
  for (size_t i = 0; i < reference.size(); ++i) {
    if (in_square[i]) continue;
    const auto& point = reference[i].point_m;
    unknowns.single.push_back(i);
    unknowns.place_m.push_back({point.x(), point.y(), point.z()});
  }
  return unknowns;
}

/// Solves in turn for the unknowns and for the two spreads, until the spreads converge.
WorldSolve solve_with_spread(const FixedCamera& camera, const std::vector<PlacedPixel>& reference,
                             WorldUnknowns& unknowns, Spread& spread) {
  constexpr double kSmallestSurveySigmaM = 1e-6;
  constexpr double kLeastSquareRedundancy = 2;  // fewer say nothing about a standard deviation
  constexpr int kRounds = 50;
  const auto settled = [](double now, double last) { return std::abs(now - last) < 3e-3 * last; };
  WorldSolve solve;
  for (int round = 0; round < kRounds; ++round) {
    solve = solve_world(camera, reference, spread, unknowns);
    if (!solve.usable || !(solve.survey_redundancy > 0)) break;
    const Spread before = spread;
    spread.survey_sigma_m =
        std::max(before.survey_sigma_m * std::sqrt(solve.survey_sum / solve.survey_redundancy),
                 kSmallestSurveySigmaM);
    if (solve.square_redundancy > kLeastSquareRedundancy)
      spread.square_factor = std::max(
          before.square_factor * std::sqrt(solve.square_sum / solve.square_redundancy), 1.0);
    if (settled(spread.survey_sigma_m, before.survey_sigma_m) &&
        settled(spread.square_factor, before.square_factor))
      break;
  }
  return solve;
}

}  // namespace

WorldPlacementResult place_world(const CameraParameters& parameters,
                                 const std::vector<PlacedPixel>& reference,
                                 const std::vector<PlacedPixel>& sheet) {
  WorldPlacementResult result;
  if (reference.size() < 4) {
    result.message =
        fmt::format("{} reference points are seen; 4 or more place the camera", reference.size());
    return result;
  }
  if (!is_finite(reference)) {
    result.message = "a reference point is not a number, or its sigma is not > 0";
    return result;
  }
  const FixedCamera camera(parameters);
  const auto start = start_world(parameters, camera, reference);
  if (!start) {
    result.message = "the reference points do not place the camera; are they on one line?";
    return result;
  }
  const std::vector<PlacedPixel> good = without_blunders(camera, reference, *start);
  result.reference_rejected = static_cast<int>(reference.size() - good.size());
  if (good.size() < 4) {
    result.message = fmt::format("only {} of {} reference points agree on a pose of the camera",
                                 good.size(), reference.size());
    return result;
  }

  WorldUnknowns unknowns = first_unknowns(good, *start);
  Spread spread;
  const WorldSolve solve = solve_with_spread(camera, good, unknowns, spread);
  if (!solve.usable) {
    result.message = "the reference points leave the camera's pose undetermined";
    return result;
  }
  result.camera_from_world = from_block(unknowns.camera_from_world);
  result.covariance = solve.covariance;
  result.reference_survey_sigma_m = spread.survey_sigma_m;
  double sum_px2 = 0;
  const auto residuals = standardised_residuals(camera, good, result.camera_from_world);
  for (size_t i = 0; i < good.size(); ++i)
    sum_px2 += (good[i].sigma_px * residuals[i]).squaredNorm();
  result.reference_rms_px = std::sqrt(sum_px2 / (2 * static_cast<double>(good.size())));
  result.usable = std::isfinite(result.reference_rms_px) && result.covariance.allFinite();
  result.message = fmt::format(
      "{} of {} reference points, survey sigma {:.2f} mm, rms {:.2f} px; sigma of the camera's "
      "tilt {:.1f} mrad",
      good.size(), reference.size(), 1e3 * spread.survey_sigma_m, result.reference_rms_px,
      1e3 * std::sqrt(result.covariance(0, 0)));

  if (result.usable && !sheet.empty()) {
    const SheetPoseResult placed = place_sheet(parameters, sheet);
    if (placed.usable) {
      result.has_sheet = true;
      result.sheet_rms_px = placed.rms_px;
      result.world_from_sheet = inverse(result.camera_from_world) * placed.camera_from_sheet;
      result.message += "; sheet: " + placed.message;
    } else {
      result.message += "; no sheet: " + placed.message;
    }
  }
  return result;
}

}  // namespace clothfit
