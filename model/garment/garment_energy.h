#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "model/garment/body_contact.h"
#include "model/garment/garment_mesh.h"
#include "model/garment/self_contact.h"
#include "model/garment/spring_cloth.h"
#include "model/sheet/sheet_energy.h"

namespace clothfit {

/// The energy of a garment's particles: its fabric (SheetEnergy, or the springs of SpringCloth),
/// its seams while they are open, the body's pressure and its own.
///
/// An open garment has a particle for every vertex. Threads pull the sides of its seams together,
/// k l |x_a - x_b|^2 / 2 for every stretch l of a seam. A sewn one has a particle for all vertices
/// that seams join, and seams bend as uncut cloth.
class GarmentEnergy : public BlockEnergy {
 public:
  enum class Seams { open, sewn };
  /// `mesh` must outlive this. Throws InputError as fibres_of() does.
  GarmentEnergy(const GarmentMesh& mesh, const std::vector<MeasuredFabric>& fabrics, Seams seams);
  /// The same of the paper's springs in place of fabrics.
  GarmentEnergy(const GarmentMesh& mesh, const PaperSprings& springs, Seams seams);

  /// Lets a body press on the cloth's vertices, and between them at places not farther apart than a
  /// centimetre: a coarse mesh does not pass through what is wider. The body must outlive this.
  void set_body(const BodyField& body, double hold_off_m);
  /// Lets the cloth press on itself where it is nearer than `beta_m`.
  void set_self_contact(double beta_m);
  void set_gravity(const Eigen::Vector3d& gravity_m_per_s2) {
    cloth_->set_gravity(gravity_m_per_s2);
  }
  /// Sets the pull of the threads of an open garment: force per gap and length of seam.
  void set_thread(double pull_n_per_m2) { thread_n_per_m2_ = pull_n_per_m2; }

  double weight_n() const { return cloth_->weight_n(); }
  const Eigen::VectorXd& mass_kg() const override { return mass_kg_; }
  double energy_and_gradient(const Eigen::Matrix3Xd& position_m,
                             Eigen::Matrix3Xd& gradient_n) const override;
  double open_way(const Eigen::Matrix3Xd& from_m, const Eigen::Matrix3Xd& move_m) override {
    return self_contact_ ? self_contact_->open_way(from_m, move_m) : 1;
  }
  bool update_pairs(const Eigen::Matrix3Xd& position_m) override;
  const std::vector<Pair>& pairs() const override { return pairs_; }
  void second_derivative(const Eigen::Matrix3Xd& position_m, Curvature curvature,
                         std::vector<Eigen::Matrix3d>& blocks) const override;

  /// Returns how many edges pass through triangles of the cloth; 0 where it is not looked for.
  int crossings(const Eigen::Matrix3Xd& position_m) {
    return self_contact_ ? self_contact_->crossings(position_m) : 0;
  }
  /// Returns the direction in which its own pressure pushes every particle, of length 1; zero where
  /// none does. 3 x particles, for a place on the last way.
  Eigen::Matrix3Xd pushed_apart(const Eigen::Matrix3Xd& position_m) const;
  /// Returns how much of the cloth lies inside the body, at the places on which it presses.
  Inside inside_body(const Eigen::Matrix3Xd& position_m) const;

  /// Returns the positions of the vertices, 3 x vertices, and those of the particles: means.
  Eigen::Matrix3Xd vertices_m(const Eigen::Matrix3Xd& particle_m) const;
  Eigen::Matrix3Xd particles_m(const Eigen::Matrix3Xd& vertex_m) const;

 private:
  struct Thread {
    int a = 0, b = 0;
    double length_m = 0;         ///< of the seam that it stands for
    std::array<int, 3> block{};  ///< of a, of b and of both
  };
  /// Where a block of the cloth's second derivative goes.
  struct Target {
    int block = 0;
    bool plain = true;    ///< added as it is
    bool turned = false;  ///< its transpose is added
  };
  GarmentEnergy(const GarmentMesh& mesh, Seams seams);
  void take_cloth(std::unique_ptr<ClothEnergy> cloth, std::vector<int> particle_of_point);
  void add_threads();
  void find_targets();
  int block_of(int a, int b) const;  ///< number of a pair; it is there
  void add_contact_point(const std::vector<int>& vertices, const std::vector<double>& weights,
                         double area_m2, std::vector<ContactPoint>& points) const;
  std::vector<ContactPoint> contact_points() const;

  const GarmentMesh& mesh_;
  std::vector<int> particle_of_;  ///< of every vertex
  std::unique_ptr<ClothEnergy> cloth_;
  std::vector<int> particle_of_point_;  ///< of every point of `cloth_`
  Eigen::VectorXd mass_kg_;
  std::vector<Thread> threads_;
  double thread_n_per_m2_ = 0;
  std::optional<BodyContact> contact_;
  std::optional<SelfContact> self_contact_;
  std::vector<Pair> pairs_;  ///< those of the mesh, then those of places that touch; both sorted
  size_t pairs_of_mesh_ = 0;
  std::vector<Target> target_;  ///< of each pair of `cloth_`
};

}  // namespace clothfit
