#include "model/garment/body_contact.h"

#include <cmath>
#include <utility>

namespace clothfit {
namespace {

constexpr double kPressure_pa = 1;
constexpr double kSteepness = 12;
/// The nearest part of the surface is looked for however far it is: bodies may be thick.
constexpr double kAnywhere_m = 1e6;

/// Energy, pressure and stiffness per area.
struct Push {
  double energy_j_per_m2 = 0, pressure_pa = 0, stiffness_n_per_m3 = 0;
};

Push push_at(double distance_m, double hold_off_m) {
  const double u = kSteepness * (1 - distance_m / hold_off_m);
  if (u <= 0) return {};
  const double beneath = std::max(u - kSteepness, 0.0), v = u - beneath;
  const double grown = std::exp(v), length_m = hold_off_m / kSteepness;
  const double pressure = grown - 1 - v, rise = grown - 1;
  return {.energy_j_per_m2 =
              kPressure_pa * length_m *
              (grown - 1 - v - 0.5 * v * v + pressure * beneath + 0.5 * rise * beneath * beneath),
          .pressure_pa = kPressure_pa * (pressure + rise * beneath),
          .stiffness_n_per_m3 = kPressure_pa * rise / length_m};
}

}  // namespace

BodyContact::BodyContact(const Obstacle& body, double hold_off_m, std::vector<ContactPoint> points)
    : body_(body), hold_off_m_(hold_off_m), points_(std::move(points)), free_(points_.size()) {}

std::optional<Obstacle::Distance> BodyContact::touched(size_t point,
                                                       const Eigen::Vector3d& place_m) const {
  Free& free = free_[point];
  if ((place_m - free.place_m).norm() < free.way_m) return std::nullopt;
  const auto near = body_.distance(place_m, kAnywhere_m);
  const double distance_m = near ? near->distance_m : kAnywhere_m;
  free = {place_m, distance_m - hold_off_m_};
  return distance_m < hold_off_m_ ? near : std::nullopt;
}

double BodyContact::add_energy_and_gradient(const Eigen::Matrix3Xd& position_m,
                                            Eigen::Matrix3Xd& gradient_n) const {
  double energy_j = 0;
  for (size_t p = 0; p < points_.size(); ++p) {
    const ContactPoint& point = points_[p];
    const auto near = touched(p, point.place_m(position_m));
    if (!near) continue;
    const Push push = push_at(near->distance_m, hold_off_m_);
    energy_j += point.area_m2 * push.energy_j_per_m2;
    const Eigen::Vector3d force_n = point.area_m2 * push.pressure_pa * near->outwards;
    for (size_t k = 0; k < static_cast<size_t>(point.count); ++k)
      gradient_n.col(point.point[k]) -= point.weight[k] * force_n;
  }
  return energy_j;
}

void BodyContact::add_second_derivative(const Eigen::Matrix3Xd& position_m,
                                        std::vector<Eigen::Matrix3d>& blocks) const {
  for (size_t p = 0; p < points_.size(); ++p) {
    const ContactPoint& point = points_[p];
    const auto near = touched(p, point.place_m(position_m));
    if (!near) continue;
    const Eigen::Matrix3d stiffness = point.area_m2 *
                                      push_at(near->distance_m, hold_off_m_).stiffness_n_per_m3 *
                                      near->outwards * near->outwards.transpose();
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
    const auto near = body_.distance(point.place_m(position_m), kAnywhere_m);
    if (!near || near->distance_m >= 0) continue;
    ++found.places;
    if (-near->distance_m <= found.deepest_m) continue;
    found.deepest_m = -near->distance_m;
    found.point = point.point[0];
  }
  return found;
}

}  // namespace clothfit
