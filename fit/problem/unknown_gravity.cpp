#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>

#include "fit/problem/fitted_tilt.h"
#include "fit/problem/turned.h"
#include "fit/problem/unknown_group.h"

/// The direction of gravity, where cameras saw the cloth.
namespace clothfit {
namespace {

/// Standard deviation of a camera's rotation that comes without a covariance, rad: half a degree,
/// as a spirit level or a person's eye gives.
constexpr double kUnstatedTilt = 0.01;

/// Adds two level directions and, where a camera saw the cloth, gravity's direction as an unknown.
/// Its prior follows from the pose's covariance, or from kUnstatedTilt. Only gravity's direction in
/// the camera's axes matters to a cloth that is placed by what the camera sees. All else of the
/// pose moves the scene as a whole. With true camera_from_world = exp(w) * estimate, gravity seen
/// through the estimate is turned by R' w in the world (R the estimated rotation).
void add_gravity_direction(FitProblem& problem) {
  const Eigen::Vector3d down = problem.gravity_m_per_s2.stableNormalized();
  const Eigen::Vector3d away =
      std::abs(down.x()) < 0.9 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
  problem.level_axes.col(0) = (away - away.dot(down) * down).normalized();
  problem.level_axes.col(1) = problem.level_axes.col(0).cross(down);

  const ObservationSet& first = problem.observations.front();
  if (!first.camera || down.isZero()) return;
  const CameraPose& pose = *first.camera->camera_from_world;
  const Eigen::Matrix<double, 2, 3> level =
      problem.level_axes.transpose() * pose.rotation.toRotationMatrix().transpose();
  Eigen::Matrix3d of_rotation = kUnstatedTilt * kUnstatedTilt * Eigen::Matrix3d::Identity();
  if (pose.covariance) of_rotation = pose.covariance->topLeftCorner<3, 3>();
  const Eigen::Matrix2d covariance = level * of_rotation * level.transpose();
  GaussianPrior prior{.indices = {}, .mean = Eigen::Vector2d::Zero(), .sqrt_information = {}};
  prior.sqrt_information = covariance.inverse().llt().matrixU();
  constexpr double kTypicalTilt = 1e-3;
  for (const char* name : {"world_tilt_a", "world_tilt_b"}) {
    prior.indices.push_back(problem.space.size());
    problem.tilt.push_back({.parameter = problem.space.size(), .constant = 0});
    problem.space.parameters.push_back({.name = name,
                                        .unit = "rad",
                                        .role = ParameterRole::placement,
                                        .scale = ParameterScale::linear,
                                        .lower = -0.2,
                                        .upper = 0.2,
                                        .start = 0,
                                        .typical = kTypicalTilt});
  }
  problem.priors.push_back(std::move(prior));
}

/// Returns the rotation vector by which gravity is turned.
Eigen::Vector3d gravity_turn(const FitProblem& problem, const Eigen::VectorXd& values) {
  return problem.level_axes *
         Eigen::Vector2d(problem.tilt[0].value(values), problem.tilt[1].value(values));
}

class GravityUnknowns final : public UnknownGroup {
 public:
  void declare(const ProblemSource& source, FitProblem& problem) const override {
    if (!source.options.forecast) add_gravity_direction(problem);
  }

  void apply(const FitProblem& problem, const Eigen::VectorXd& values,
             ParameterSet& set) const override {
    if (!problem.tilt.empty())
      set.gravity_m_per_s2 = turned(gravity_turn(problem, values), problem.gravity_m_per_s2).value;
  }

  void differentiate(const FitProblem& problem, const Eigen::VectorXd& values,
                     const Eigen::VectorXd& slope, std::vector<Direction>& along) const override {
    if (problem.tilt.empty()) return;
    const Eigen::Matrix<double, 3, 2> by_tilt =
        turned(gravity_turn(problem, values), problem.gravity_m_per_s2).by_turn *
        problem.level_axes;
    for (size_t axis = 0; axis < 2; ++axis) {
      const Binding& binding = problem.tilt[axis];
      along[static_cast<size_t>(binding.parameter)].gravity_m_per_s2 =
          slope[binding.parameter] * by_tilt.col(static_cast<Eigen::Index>(axis));
    }
  }
};

}  // namespace

const UnknownGroup& gravity_unknowns() {
  static const GravityUnknowns group;
  return group;
}

FittedTilt fitted_tilt(const FitProblem& problem, const Eigen::VectorXd& values) {
  if (problem.tilt.empty()) return {};
  const auto prior = std::ranges::find_if(problem.priors, [&](const GaussianPrior& one) {
    return one.indices.front() == problem.tilt.front().parameter;
  });
  assert(prior != problem.priors.end());
  return {
      .angle_rad = gravity_turn(problem, values).norm(),
      .sigmas = prior->residual(values).norm(),
      .is_stated = problem.observations.front().camera->camera_from_world->covariance.has_value()};
}

}  // namespace clothfit
