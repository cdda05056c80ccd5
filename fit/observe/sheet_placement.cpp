#include "fit/observe/sheet_placement.h"

#include <ceres/ceres.h>

#include <algorithm>

#include "calib/camera/projection.h"
#include "data/algebra/dense_factors.h"

namespace clothfit {
namespace {

/// One set as the first frames show it.
struct SheetView {
  const ObservationSet* set = nullptr;
  std::vector<const Observation*> rows;
};

std::vector<SheetView> first_views(const std::vector<ObservationSet>& sets, int frames) {
  std::vector<SheetView> views;
  for (const ObservationSet& set : sets) {
    SheetView view{.set = &set, .rows = {}};
    for (const Observation& row : set.rows)
      if (row.frame < frames) view.rows.push_back(&row);
    if (view.rows.size() >= 4) views.push_back(std::move(view));
  }
  return views;
}

Eigen::Vector3d flat_place(const Eigen::Matrix2Xd& marker_m, int marker) {
  return {marker_m(0, marker), marker_m(1, marker), 0.0};
}

/// Says whether the markers of a view span the plane.
bool spans_plane(const SheetView& view, const Eigen::Matrix2Xd& marker_m) {
  Eigen::Matrix2Xd places(2, static_cast<Eigen::Index>(view.rows.size()));
  for (size_t n = 0; n < view.rows.size(); ++n)
    places.col(static_cast<Eigen::Index>(n)) = marker_m.col(view.rows[n]->marker);
  places.colwise() -= places.rowwise().mean().eval();
  const Eigen::VectorXd square = symmetric_eigenvalues(places * places.transpose());
  return square[0] > 1e-6 * square[1];
}

Rigid3 start_from_3d(const SheetView& view, const Eigen::Matrix2Xd& marker_m) {
  const auto count = static_cast<Eigen::Index>(view.rows.size());
  Eigen::Matrix3Xd flat(3, count);
  Eigen::Matrix3Xd seen(3, count);
  for (Eigen::Index n = 0; n < count; ++n) {
    flat.col(n) = flat_place(marker_m, view.rows[static_cast<size_t>(n)]->marker);
    seen.col(n) = view.rows[static_cast<size_t>(n)]->observed;
  }
  return fit_rigid(flat, seen);
}

/// Computes a plane's pose from its image. The homography from (s, t, 1) to the ray's (x/z, y/z, 1)
/// has the first two axes and the origin of the sheet as columns, up to a common factor
/// [zhang2000].
std::optional<Rigid3> start_from_pixels(const SheetView& view, const Eigen::Matrix2Xd& marker_m) {
  const CameraParameters& camera = *view.set->camera;
  Eigen::MatrixXd equations(2 * static_cast<Eigen::Index>(view.rows.size()), 9);
  Eigen::Index used = 0;
  for (const Observation* row : view.rows) {
    const auto ray = unproject(camera, row->observed.head<2>());
    if (!ray || ray->z() <= 0) continue;
    const double x = ray->x() / ray->z();
    const double y = ray->y() / ray->z();
    const double s = marker_m(0, row->marker);
    const double t = marker_m(1, row->marker);
    equations.row(used++) << s, t, 1, 0, 0, 0, -x * s, -x * t, -x;
    equations.row(used++) << 0, 0, 0, s, t, 1, -y * s, -y * t, -y;
  }
  if (used < 8) return std::nullopt;
  const SingularVectors svd = right_singular_vectors(equations.topRows(used));
  Eigen::Matrix3d homography;
  homography << svd.vectors.col(8).head<3>().transpose(),
      svd.vectors.col(8).segment<3>(3).transpose(), svd.vectors.col(8).tail<3>().transpose();
  homography /= 0.5 * (homography.col(0).norm() + homography.col(1).norm());
  if (homography(2, 2) < 0) homography = -homography;  // the sheet lies in front of the camera
  Eigen::Matrix3d axes;
  axes << homography.col(0), homography.col(1), homography.col(0).cross(homography.col(1));
  const Rigid3 camera_from_sheet{Eigen::Quaterniond(nearest_orthogonal(axes)), homography.col(2)};
  return inverse(camera_from_world(camera)) * camera_from_sheet;
}

struct PlaceResidual3d {
  Eigen::Vector3d flat, seen;
  double sigma;
  template <class Real>
  bool operator()(const Real* rotation, const Real* translation, Real* residual) const {
    const Eigen::Map<const Eigen::Quaternion<Real>> q(rotation);
    const Eigen::Map<const Eigen::Matrix<Real, 3, 1>> shift(translation);
    Eigen::Map<Eigen::Matrix<Real, 3, 1>> r(residual);
    r = (q * flat.cast<Real>() + shift - seen.cast<Real>()) / sigma;
    return true;
  }
};

struct PlaceResidual2d {
  Eigen::Vector3d flat;
  Eigen::Vector2d seen;
  double sigma;
  const CameraParameters* camera;
  std::array<double, kMaxIntrinsics> intrinsics;
  Rigid3 camera_from_world;
  template <class Real>
  bool operator()(const Real* rotation, const Real* translation, Real* residual) const {
    const Eigen::Map<const Eigen::Quaternion<Real>> q(rotation);
    const Eigen::Map<const Eigen::Matrix<Real, 3, 1>> shift(translation);
    const Eigen::Matrix<Real, 3, 1> in_world = q * flat.cast<Real>() + shift;
    const Eigen::Matrix<Real, 3, 1> in_camera = camera_from_world.rotation.cast<Real>() * in_world +
                                                camera_from_world.translation_m.cast<Real>();
    if (in_camera.z() <= Real(0)) return false;
    std::array<Real, kMaxIntrinsics> numbers;
    std::transform(intrinsics.begin(), intrinsics.end(), numbers.begin(),
                   [](double number) { return Real(number); });
    const Eigen::Matrix<Real, 2, 1> pixel = project<Real>(
        camera->model, numbers.data(), static_cast<int>(camera->distortion.size()), in_camera);
    residual[0] = (pixel.x() - seen.x()) / sigma;
    residual[1] = (pixel.y() - seen.y()) / sigma;
    return true;
  }
};

}  // namespace

std::optional<Rigid3> place_flat_sheet(const std::vector<ObservationSet>& sets,
                                       const Eigen::Matrix2Xd& marker_m, int frames) {
  const std::vector<SheetView> views = first_views(sets, frames);
  std::optional<Rigid3> start;
  for (const SheetView& view : views) {
    if (start || !spans_plane(view, marker_m)) continue;
    start = view.set->camera ? start_from_pixels(view, marker_m) : start_from_3d(view, marker_m);
  }
  if (!start) return std::nullopt;

  Rigid3 world_from_sheet = *start;
  ceres::Problem problem;
  double* const rotation = world_from_sheet.rotation.coeffs().data();
  double* const translation = world_from_sheet.translation_m.data();
  constexpr double kHuberSigmas = 3;
  for (const SheetView& view : views) {
    for (const Observation* row : view.rows) {
      const Eigen::Vector3d flat = flat_place(marker_m, row->marker);
      ceres::CostFunction* cost = nullptr;
      if (view.set->camera) {
        const CameraParameters& camera = *view.set->camera;
        cost = new ceres::AutoDiffCostFunction<PlaceResidual2d, 2, 4, 3>(
            new PlaceResidual2d{flat, row->observed.head<2>(), row->sigma, &camera,
                                intrinsics_of(camera), camera_from_world(camera)});
      } else {
        cost = new ceres::AutoDiffCostFunction<PlaceResidual3d, 3, 4, 3>(
            new PlaceResidual3d{flat, row->observed, row->sigma});
      }
      problem.AddResidualBlock(cost, new ceres::HuberLoss(kHuberSigmas), rotation, translation);
    }
  }
  problem.SetManifold(rotation, new ceres::EigenQuaternionManifold);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.logging_type = ceres::SILENT;
  options.max_num_iterations = 50;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (!summary.IsSolutionUsable()) return std::nullopt;
  world_from_sheet.rotation.normalize();
  return world_from_sheet;
}

}  // namespace clothfit
