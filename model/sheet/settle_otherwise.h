#pragma once

#include "model/sheet/settle.h"

namespace clothfit {

/// Does what settle() does by nonlinear conjugate gradients (Polak and Ribiere's, started again
/// where they lose their conjugacy) [lethanh2007, section 3]: the method that it is compared with.
/// Each line search goes to where the slope has fallen to a tenth. Needs no second derivative;
/// `first_shift_per_s2` and `load_n` of the rule do not matter.
MinimiseResult settle_by_conjugate_gradients(BlockEnergy& energy, const std::vector<bool>& held,
                                             const SettleRule& rule, Eigen::Matrix3Xd& position_m);

/// Does what settle() does by letting the cloth move until it stands still: implicit time steps of
/// `step_s` [baraff1998] in air that takes its speed away within `calm_s`. Where a step would raise
/// kinetic and potential energy together, it and the speed are halved, down to a millionth of both.
MinimiseResult settle_by_time_steps(BlockEnergy& energy, const std::vector<bool>& held,
                                    const SettleRule& rule, double step_s, double calm_s,
                                    Eigen::Matrix3Xd& position_m);

}  // namespace clothfit
