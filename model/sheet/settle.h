#pragma once

#include <functional>
#include <limits>
#include <vector>

#include "model/rest/minimise.h"
#include "model/sheet/block_energy.h"

namespace clothfit {

/// A place on the way to balance.
struct SettleStep {
  int iteration = 0;  ///< 0: the start
  double energy_j = 0, gradient_n = 0;
  const Eigen::Matrix3Xd& position_m;
};

struct SettleRule {
  StopRule stop;
  std::function<void(const SettleStep&)> on_step;  ///< after every step; may be empty
  double load_n = 0;  ///< > 0; that deforms the sheet: its weight, the pull of a machine
  /// No point moves farther in one step: what lies in its way is seen.
  double longest_step_m = std::numeric_limits<double>::infinity();
  /// > 0; bounds the first step. g / length suits a start near balance, a hundred times that a
  /// start far from it.
  double first_shift_per_s2 = 0;
};
/// Moves points to where their forces are balanced: a local minimum of the energy near the path
/// downhill. `held` points stay (one entry per point). Newton steps (H + s M) d = -gradient are
/// solved by BlockCholesky.
///
/// H is the energy's second derivative, exact near balance, without the negative transverse
/// stiffness of compressed fibres far from it. The shift s M stands for the inertia of a cloth that
/// moves from rest to rest within 1 / sqrt(s). It rises until the matrix is positive definite and a
/// step lowers the energy, and falls where steps succeed. So a sheet leaves a saddle once it is off
/// it by more than rounding; at a start of perfect symmetry it stays.
///
/// Cloth comes to rest by many steps the same way. So each step begins ahead of the last place, by
/// a share of the last move [nesterov1983]. Where the energy rises, the next begins without.
MinimiseResult settle(BlockEnergy& energy, const std::vector<bool>& held, const SettleRule& rule,
                      Eigen::Matrix3Xd& position_m);

}  // namespace clothfit
