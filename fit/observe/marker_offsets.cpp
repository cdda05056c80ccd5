#include "fit/observe/marker_offsets.h"

#include <cassert>
#include <cmath>

namespace clothfit {

void profile_out_offsets(std::span<const MarkerResiduals> markers, double tau_m,
                         Eigen::Ref<Eigen::MatrixXd> columns) {
  assert(tau_m > 0);
  for (const MarkerResiduals& marker : markers) {
    double information = 0;                                            // W
    Eigen::Matrix3Xd sum = Eigen::Matrix3Xd::Zero(3, columns.cols());  // w' r
    for (const MarkerResiduals::Row& row : marker.rows) {
      information += 1 / (row.sigma_m * row.sigma_m);
      sum += columns.middleRows<3>(row.first) / row.sigma_m;
    }
    const double share = 1 - 1 / std::sqrt(1 + tau_m * tau_m * information);
    for (const MarkerResiduals::Row& row : marker.rows)
      columns.middleRows<3>(row.first) -= share / (information * row.sigma_m) * sum;
  }
}

Eigen::Matrix3Xd estimate_offsets(const ObservationSet& set,
                                  const std::vector<Eigen::Matrix3Xd>& positions, int frames,
                                  double tau_m) {
  assert(tau_m > 0 && set.dimension == 3 && !positions.empty());
  const Eigen::Index markers = positions.front().cols();
  Eigen::Matrix3Xd offset_m = Eigen::Matrix3Xd::Zero(3, markers);
  Eigen::RowVectorXd information = Eigen::RowVectorXd::Constant(markers, 1 / (tau_m * tau_m));
  for (const Observation& row : set.rows) {
    if (row.frame >= frames) break;  // rows are sorted by frame
    const double weight = 1 / (row.sigma * row.sigma);
    offset_m.col(row.marker) +=
        weight * (row.observed - positions[static_cast<size_t>(row.frame)].col(row.marker));
    information[row.marker] += weight;
  }
  return offset_m.array().rowwise() / information.array();
}

}  // namespace clothfit
