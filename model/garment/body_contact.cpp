#include "model/garment/body_contact.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include "model/garment/contact_pressure.h"

namespace clothfit {
namespace {

/// Returns a symmetric matrix without its negative eigenvalues.
Eigen::Matrix3d positive_part(const Eigen::Matrix3d& matrix) {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> of;
  of.computeDirect(matrix);
  return of.eigenvectors() * of.eigenvalues().cwiseMax(0.0).asDiagonal() *
         of.eigenvectors().transpose();
}

}  // namespace

BodyContact::BodyContact(const BodyField& body, double hold_off_m, std::vector<ContactPoint> points)
    : body_(body), hold_off_m_(hold_off_m), points_(std::move(points)), free_(points_.size()) {}

std::optional<BodyField::Distance> BodyContact::touched(size_t point,
                                                        const Eigen::Vector3d& place_m) const {
  Free& free = free_[point];
  if ((place_m - free.place_m).norm() < free.way_m) return std::nullopt;
  free.place_m = place_m;
  return body_.near(place_m, hold_off_m_, free.way_m);
}

double BodyContact::add_energy_and_gradient(const Eigen::Matrix3Xd& position_m,
                                            Eigen::Matrix3Xd& gradient_n) const {
  double energy_j = 0;
  for (size_t p = 0; p < points_.size(); ++p) {
    const ContactPoint& point = points_[p];
    const auto near = touched(p, point.place_m(position_m));
    if (!near) continue;
    const ContactPressure push = contact_pressure(near->distance_m, hold_off_m_);
    energy_j += point.area_m2 * push.energy_j_per_m2;
    const Eigen::Vector3d force_n = point.area_m2 * push.pressure_pa * near->gradient;
    for (size_t k = 0; k < static_cast<size_t>(point.count); ++k)
      gradient_n.col(point.point[k]) -= point.weight[k] * force_n;
  }
  return energy_j;
}

void BodyContact::add_second_derivative(const Eigen::Matrix3Xd& position_m, Curvature curvature,
                                        std::vector<Eigen::Matrix3d>& blocks) const {
  for (size_t p = 0; p < points_.size(); ++p) {
    const ContactPoint& point = points_[p];
    const auto near = touched(p, point.place_m(position_m));
    if (!near) continue;
    const ContactPressure push = contact_pressure(near->distance_m, hold_off_m_);
    Eigen::Matrix3d of_surface = -push.pressure_pa * near->per_m;
    if (curvature == Curvature::clamped) of_surface = positive_part(of_surface);
    const Eigen::Matrix3d stiffness =
        point.area_m2 *
        (of_surface + push.stiffness_n_per_m3 * near->gradient * near->gradient.transpose());
    size_t next = 0;
    for (size_t a = 0; a < static_cast<size_t>(point.count); ++a)
      for (size_t b = 0; b <= a; ++b)
        blocks[static_cast<size_t>(point.block[next++])] +=
            point.weight[a] * point.weight[b] * stiffness;
  }
}

Inside BodyContact::inside(const Eigen::Matrix3Xd& position_m) const {
  Inside found;
  for (const ContactPoint& point : points_) {
    const auto near = body_.exact().distance(point.place_m(position_m), Obstacle::kAnywhere_m);
    if (!near || near->distance_m >= 0) continue;
    ++found.places;
    if (-near->distance_m <= found.deepest_m) continue;
    found.deepest_m = -near->distance_m;
    const auto nearest = std::max_element(point.weight.begin(), point.weight.begin() + point.count);
    found.point = point.point[static_cast<size_t>(nearest - point.weight.begin())];
  }
  return found;
}

}  // namespace clothfit
