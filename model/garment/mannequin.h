#pragma once

#include "model/topology/obstacle.h"

namespace clothfit {

/// Sizes of a standing body (m). Defaults are a mean of women's sizes. It faces -y; z is up, the
/// ground at 0, the body's left at +x.
struct MannequinSize {
  double height_m = 1.72;
  double bust_m = 0.97;  ///< girths
  double waist_m = 0.83;
  double hips_m = 1.03;
  double arm_rad = 0.80;  ///< by which the arms hang below the horizontal

  void validate() const;  ///< throws InputError
};

/// Makes a mannequin: a torso of ellipses from height to height, head, arms and legs of round
/// cones, melted into one smooth surface. It is closed; its triangles have sides of about
/// `spacing_m`.
TriangleMesh make_mannequin(const MannequinSize& size = {}, double spacing_m = 0.015);

}  // namespace clothfit
