#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "model/sheet/block_energy.h"
#include "model/topology/surface_parts.h"

namespace clothfit {

/// The pressure of cloth on itself where it is nearer than beta [lethanh2007, sections 5 and 8]. It
/// acts between points and triangles and between edges, along their shortest connections, by the
/// law of ContactPressure. Edges that run the same way press less, and parallel ones not at all:
/// where their nearest places jump, points and triangles press alone.
///
/// What is near has to be known before: open_way() finds it.
class SelfContact {
 public:
  /// `area_m2`: of the cloth that belongs to every point; `beta_m`: distance at which parts begin
  /// to press, the least of their points'.
  SelfContact(SurfaceParts parts, Eigen::VectorXd area_m2, Eigen::VectorXd beta_m);

  /// Finds all that comes near on a straight way. Returns the share of it on which nothing
  /// passes through anything: distances keep a fifth of what they are at first.
  double open_way(const Eigen::Matrix3Xd& from_m, const Eigen::Matrix3Xd& move_m);

  /// Adds the energy's derivative to `gradient_n` and returns the energy (J), for a place on the
  /// way.
  double add_energy_and_gradient(const Eigen::Matrix3Xd& position_m,
                                 Eigen::Matrix3Xd& gradient_n) const;

  /// Adds the pairs of points that press on each other.
  void add_pairs(const Eigen::Matrix3Xd& position_m, std::vector<BlockEnergy::Pair>& pairs) const;

  /// Adds the second derivative but for how connections and edges turn:
  /// `add(a, b, block)` for the points a and b, each two once.
  template <class Add>
  void add_second_derivative(const Eigen::Matrix3Xd& position_m, const Add& add) const {
    for (const PartPair& pair : near_) {
      const Contact contact = contact_of(pair, position_m);
      if (contact.stiffness_n_per_m == 0) continue;
      const Eigen::Matrix3d along =
          contact.stiffness_n_per_m * contact.direction * contact.direction.transpose();
      for (size_t a = 0; a < 4; ++a)
        for (size_t b = 0; b <= a; ++b) {
          const auto i = static_cast<Eigen::Index>(a), j = static_cast<Eigen::Index>(b);
          const double weight = contact.weight[i] * contact.weight[j];
          if (weight != 0) add(pair.point[a], pair.point[b], weight * along);
        }
    }
  }

  /// Returns how many edges pass through triangles, by an exact test.
  int crossings(const Eigen::Matrix3Xd& position_m) { return parts_.crossings(position_m); }

 private:
  struct Contact {
    double energy_j = 0, force_n = 0, stiffness_n_per_m = 0;  ///< all 0: apart
    Eigen::Vector4d weight;
    Eigen::Vector3d direction;
    FourPlaces by_turning_n = FourPlaces::Zero();  ///< what edges that turn change in the energy
  };
  /// Returns the area on which a pair presses: half of the mean of both parts'.
  double area_of(const PartPair& pair) const;
  double beta_of(const PartPair& pair) const;
  Contact contact_of(const PartPair& pair, const Eigen::Matrix3Xd& position_m) const;

  SurfaceParts parts_;
  Eigen::VectorXd area_m2_, beta_m_;
  std::vector<PartPair> near_;
};

}  // namespace clothfit
