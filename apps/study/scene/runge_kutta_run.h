#pragma once

#include <Eigen/Core>
#include <vector>

#include "model/cloth/cloth.h"
#include "model/integrate/simulate.h"

namespace clothfit {

/// Returns positions (3 x vertices, world, m) at the schedule's times from rest. The scheme is the
/// classical one of Runge and Kutta of fourth order [kutta1901], with its own sum of the springs'
/// forces: neither the steps nor the kernels are those of fits. Its error is of fourth order in the
/// step where forces are smooth. The memory of effects moves on once a step, which is of first
/// order. Held points lie at vertices; no effect shifts them, and nothing limits strain. The result
/// is empty where the numbers do not work out, or `stop` ends it.
std::vector<Eigen::Matrix3Xd> run_runge_kutta(const Cloth& cloth, const ParameterSet& parameters,
                                              const Schedule& schedule, const StopCheck& stop = {});

}  // namespace clothfit
