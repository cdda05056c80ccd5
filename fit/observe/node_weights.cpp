#include "fit/observe/node_weights.h"

#include "model/topology/surface.h"

namespace clothfit {

Eigen::MatrixXd node_weights(const Mesh& mesh, int nodes, const Eigen::Matrix2Xd& points) {
  return Eigen::MatrixXd(
      vertex_weights(make_surface(nodes, nodes, mesh.width_m, mesh.height_m, points)));
}

}  // namespace clothfit
