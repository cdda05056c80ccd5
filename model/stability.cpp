#include "model/stability.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace clothfit {
namespace {

constexpr double kFoldedMargin = 1.25;

/// Bound on the eigenvalues of M^-1 L for the spring network with weights `k` per type.
double network_bound(const Cloth& cloth, const std::array<double, kSpringTypes>& k) {
  const Eigen::Matrix3Xd flat = flat_positions(cloth.mesh);
  std::vector<Eigen::Matrix3d> stiffness(static_cast<size_t>(cloth.mesh.vertex_count()),
                                         Eigen::Matrix3d::Zero());
  for (size_t type = 0; type < kSpringTypes; ++type) {
    for (const Spring& spring : cloth.springs[type]) {
      const Eigen::Vector3d u = (flat.col(spring.b) - flat.col(spring.a)).normalized();
      stiffness[static_cast<size_t>(spring.a)] += k[type] * u * u.transpose();
      stiffness[static_cast<size_t>(spring.b)] += k[type] * u * u.transpose();
    }
  }
  double bound = 0;
  for (size_t v = 0; v < stiffness.size(); ++v) {
    const double largest =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(stiffness[v], Eigen::EigenvaluesOnly)
            .eigenvalues()
            .maxCoeff();
    bound = std::max(bound, 2 * largest / cloth.mass_kg[static_cast<Eigen::Index>(v)]);
  }
  return bound;
}

}  // namespace

double stable_time_step_s(const Cloth& cloth, const ParameterSet& parameters) {
  double omega2 = kFoldedMargin * network_bound(cloth, parameters.springs.stiffness_n_per_m);
  double gamma = kFoldedMargin * network_bound(cloth, parameters.springs.damping_ns_per_m);
  double acceleration_ratio = 1;
  for (size_t e = 0; e < cloth.effects.size(); ++e) {
    const EffectRates rates =
        cloth.effects[e]->rates(cloth, parameters.springs, parameters.effects[e]);
    omega2 += rates.frequency2_per_s2;
    gamma += rates.damping_per_s;
    acceleration_ratio *= rates.acceleration_ratio;
  }
  omega2 *= acceleration_ratio;
  gamma *= acceleration_ratio;
  // h^2 omega2 + 2 h gamma - 4 = 0, in the form that survives omega2 = 0.
  const double root = std::sqrt(gamma * gamma + 4 * omega2);
  return gamma + root > 0 ? 4 / (gamma + root) : INFINITY;
}

}  // namespace clothfit
