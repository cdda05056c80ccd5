#pragma once

#include <Eigen/Core>

namespace clothfit {

/// Returns the area (m2) that triangles cover as seen along z, each place counted once.
/// `position_m` 3 x vertices, `triangle` 3 x triangles. Lines of sight lie in rows, exact along x;
/// `row_m` is their distance along y, > 0. The error falls with its square: 1e-5 of a drape
/// specimen's area at 0.2 mm.
double shadow_area_m2(const Eigen::Matrix3Xd& position_m, const Eigen::Matrix3Xi& triangle,
                      double row_m = 2e-4);

}  // namespace clothfit
