#pragma once

#include <memory>

namespace clothfit {

/// A square soft body of the Bullet library, the yardstick of our speed. It has as many vertices,
/// links along the edges, the diagonals and over two edges. It hangs by two corners with nothing to
/// collide with. One step is a prediction, one iteration over the links and an integration.
class BulletPatch {
 public:
  explicit BulletPatch(int vertices_per_side);
  ~BulletPatch();

  int link_count() const;
  void step(double time_step_s);
  /// Returns the height of the lowest vertex (m), 0 at the beginning.
  double lowest_m() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace clothfit
