#pragma once

#include <vector>

#include "model/rest/minimise.h"
#include "model/sheet/sheet_energy.h"

namespace clothfit {

/// Moves a sheet to where its forces are balanced: a local minimum of its energy near the path
/// downhill. `held` vertices stay (one entry per vertex). Newton steps (H + s M) d = -gradient are
/// solved by a sparse Cholesky factorisation.
///
/// H is the energy's second derivative, exact near balance, without the negative transverse
/// stiffness of compressed fibres far from it. The shift s M stands for the inertia of a cloth that
/// moves from rest to rest within 1 / sqrt(s). It rises until the matrix is positive definite and a
/// step lowers the energy, and falls where steps succeed. So a sheet leaves a saddle once it is off
/// it by more than rounding; at a start of perfect symmetry it stays.
///
struct SettleRule {
  StopRule stop;
  double load_n = 0;  ///< > 0; that deforms the sheet: its weight, the pull of a machine
  /// > 0; bounds the first step. g / length suits a start near balance, a hundred times that a
  /// start far from it.
  double first_shift_per_s2 = 0;
};
MinimiseResult settle(const SheetEnergy& energy, const std::vector<bool>& held,
                      const SettleRule& rule, Eigen::Matrix3Xd& position_m);

}  // namespace clothfit
