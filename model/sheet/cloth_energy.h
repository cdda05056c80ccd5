#pragma once

#include "model/sheet/block_energy.h"

namespace clothfit {

/// The energy of a cloth's fabric and weight, whatever its model.
class ClothEnergy : public BlockEnergy {
 public:
  virtual void set_gravity(const Eigen::Vector3d& gravity_m_per_s2) = 0;
  /// Returns the cloth's weight, > 0 where gravity is.
  virtual double weight_n() const = 0;
};

}  // namespace clothfit
