#include "model/rest/held_projection.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "data/algebra/dense_factors.h"

namespace clothfit {

HeldProjection::HeldProjection(const Mesh& mesh, const std::vector<HeldVertexWeights>& held)
    : held_(held) {
  for (const HeldVertexWeights& point : held_)
    for (const auto& [vertex, weight] : point.weights)
      if (weight != 0) touched_.push_back(vertex);
  std::ranges::sort(touched_);
  touched_.erase(std::ranges::unique(touched_).begin(), touched_.end());
  assert(touched_.empty() || touched_.back() < mesh.vertex_count());
  static_cast<void>(mesh);

  const auto touched = static_cast<Eigen::Index>(touched_.size());
  weights_ = Eigen::MatrixXd::Zero(count(), touched);
  for (int h = 0; h < count(); ++h)
    for (const auto& [vertex, weight] : held_[static_cast<size_t>(h)].weights)
      if (weight != 0)
        weights_(h, std::ranges::lower_bound(touched_, vertex) - touched_.begin()) += weight;
  if (held_.empty()) return;
  lift_ = weights_.transpose() * LeastNormFactors(weights_ * weights_.transpose()).pseudo_inverse();
  projection_ = Eigen::MatrixXd::Identity(touched, touched) - lift_ * weights_;
  // Rounding residuals at a vertex that is held itself are cleared.
  projection_ = projection_.unaryExpr([](double p) { return std::abs(p) < 1e-14 ? 0.0 : p; });
}

void HeldProjection::project(MeshField& field) const {
  const auto touched = static_cast<Eigen::Index>(touched_.size());
  Eigen::Matrix3Xd there(3, touched);
  for (Eigen::Index n = 0; n < touched; ++n)
    there.col(n) = field.at(touched_[static_cast<size_t>(n)]);
  const Eigen::Matrix3Xd left = there * projection_.transpose();
  for (Eigen::Index n = 0; n < touched; ++n)
    field.set(touched_[static_cast<size_t>(n)], left.col(n));
}

Eigen::Matrix3Xd HeldProjection::locate(const MeshField& position_m) const {
  Eigen::Matrix3Xd place = Eigen::Matrix3Xd::Zero(3, count());
  for (int h = 0; h < count(); ++h)
    for (const auto& [vertex, weight] : held_[static_cast<size_t>(h)].weights)
      place.col(h) += weight * position_m.at(vertex);
  return place;
}

void HeldProjection::place(const Eigen::Matrix3Xd& target_m, MeshField& position_m) const {
  const Eigen::Matrix3Xd shift = (target_m - locate(position_m)) * lift_.transpose();
  for (size_t n = 0; n < touched_.size(); ++n)
    position_m.set(touched_[n],
                   position_m.at(touched_[n]) + shift.col(static_cast<Eigen::Index>(n)));
}

Eigen::SparseMatrix<double> allowed_motions(const HeldProjection& held, int vertices) {
  Eigen::MatrixXd among_touched(held.touched().size(), 0);
  const Eigen::MatrixXd& weights = held.weights();
  if (held.count() > 0 && LeastNormFactors(weights).rank() < weights.cols())
    among_touched = null_space(weights);
  std::vector<Eigen::Triplet<double>> entries;
  int column = 0;
  for (int v = 0; v < vertices; ++v)
    if (!std::ranges::binary_search(held.touched(), v))
      for (int c = 0; c < 3; ++c) entries.emplace_back(3 * v + c, column++, 1.0);
  for (Eigen::Index k = 0; k < among_touched.cols(); ++k)
    for (int c = 0; c < 3; ++c, ++column)
      for (size_t n = 0; n < held.touched().size(); ++n)
        entries.emplace_back(3 * held.touched()[n] + c, column,
                             among_touched(static_cast<Eigen::Index>(n), k));
  Eigen::SparseMatrix<double> motions(3 * vertices, column);
  motions.setFromTriplets(entries.begin(), entries.end());
  return motions;
}

}  // namespace clothfit
