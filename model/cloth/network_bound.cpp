#include "model/cloth/network_bound.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <vector>

namespace clothfit {

double network_bound(const Cloth& cloth, const SpringConstant& constant) {
  constexpr double kFoldedMargin = 1.25;
  const Eigen::Matrix3Xd flat = flat_positions(cloth.mesh);
  std::vector<Eigen::Matrix3d> network(static_cast<size_t>(cloth.mesh.vertex_count()),
                                       Eigen::Matrix3d::Zero());
  for (int type = 0; type < kSpringTypes; ++type) {
    for (const Spring& spring : cloth.springs[static_cast<size_t>(type)]) {
      const double k = constant(static_cast<SpringType>(type), spring);
      const Eigen::Vector3d u = (flat.col(spring.b) - flat.col(spring.a)).normalized();
      network[static_cast<size_t>(spring.a)] += k * u * u.transpose();
      network[static_cast<size_t>(spring.b)] += k * u * u.transpose();
    }
  }
  double bound = 0;
  for (size_t v = 0; v < network.size(); ++v) {
    const double largest =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(network[v], Eigen::EigenvaluesOnly)
            .eigenvalues()
            .maxCoeff();
    bound = std::max(bound, 2 * largest / cloth.mass_kg[static_cast<Eigen::Index>(v)]);
  }
  return kFoldedMargin * bound;
}

}  // namespace clothfit
