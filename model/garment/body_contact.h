#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "model/garment/body_field.h"
#include "model/rest/hanging_energy.h"
#include "model/topology/obstacle.h"

namespace clothfit {

/// A point of the cloth that a body may press on: a mean of up to four points of the mesh.
struct ContactPoint {
  int count = 0;
  std::array<int, 4> point{};      ///< all different
  std::array<double, 4> weight{};  ///< their sum is 1
  double area_m2 = 0;
  std::array<int, 10> block{};  ///< of points 00, 10, 11, 20, ..., 33 in the second derivative

  Eigen::Vector3d place_m(const Eigen::Matrix3Xd& position_m) const {
    Eigen::Vector3d place = weight[0] * position_m.col(point[0]);
    for (size_t k = 1; k < static_cast<size_t>(count); ++k)
      place += weight[k] * position_m.col(point[k]);
    return place;
  }
};

/// Places of the cloth that lie inside a body.
struct Inside {
  int places = 0;
  double deepest_m = 0;
  int point = -1;  ///< of the mesh, nearest to the deepest place
};

/// The pressure of a body on cloth nearer than the hold-off distance delta [lethanh2007, section 5]
/// by the law of ContactPressure. Beneath the skin, where points may begin, it pushes them out.
/// Cloth that lies on a shoulder keeps 0.9 delta from it, tight cloth (170 Pa) 0.57. The pressure
/// acts without friction. The distance is that of a BodyField: at the creases of the exact one no
/// step would lower the energy.
///
/// It remembers how far each place may go without touching: one thread at a time may use it.
class BodyContact {
 public:
  /// `body` must outlive this; cells of twice the hold-off distance suit it.
  BodyContact(const BodyField& body, double hold_off_m, std::vector<ContactPoint> points);

  /// Adds the energy's derivative to `gradient_n` and returns the energy (J).
  double add_energy_and_gradient(const Eigen::Matrix3Xd& position_m,
                                 Eigen::Matrix3Xd& gradient_n) const;
  /// Adds the second derivative to `blocks`; without the part of it that is negative if `curvature`
  /// is clamped.
  void add_second_derivative(const Eigen::Matrix3Xd& position_m, Curvature curvature,
                             std::vector<Eigen::Matrix3d>& blocks) const;
  /// Returns how much of the cloth is inside by the exact distance.
  Inside inside(const Eigen::Matrix3Xd& position_m) const;

 private:
  std::optional<BodyField::Distance> touched(size_t point, const Eigen::Vector3d& place_m) const;

  const BodyField& body_;
  double hold_off_m_;
  std::vector<ContactPoint> points_;
  /// Where a point was when it was last found far outside, and how far it can go without touching.
  struct Free {
    Eigen::Vector3d place_m = Eigen::Vector3d::Zero();
    double way_m = -1;
  };
  mutable std::vector<Free> free_;
};

}  // namespace clothfit
