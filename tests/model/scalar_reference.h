#pragma once

#include <Eigen/Core>

#include "model/cloth/cloth.h"

namespace clothfit {

/// This is the model a second time: one parameter set, three-vectors, no lanes, no instruction
/// sets. Its file is compiled without contraction, so that the model must agree with it to the last
/// bit.

/// Returns the springs' and dashpots' forces (N), summed at each vertex in the model's order. First
/// come those of springs from above, from the left, then those of springs that leave.
Eigen::Matrix3Xd reference_spring_forces(const Mesh& mesh, const SpringParameters& springs,
                                         const Eigen::Matrix3Xd& position_m,
                                         const Eigen::Matrix3Xd& velocity_m_per_s);

/// Takes one step: V += h (g + F / m), P += h V.
void reference_euler(const Eigen::VectorXd& mass_kg, const Eigen::Vector3d& gravity_m_per_s2,
                     double time_step_s, const Eigen::Matrix3Xd& force_n,
                     Eigen::Matrix3Xd& velocity_m_per_s, Eigen::Matrix3Xd& position_m);

/// Returns positions after `steps` steps of a cloth without held points, `rate_per_s` of viscous
/// damping.
Eigen::Matrix3Xd reference_fall(const Cloth& cloth, const ParameterSet& set, double rate_per_s,
                                double time_step_s, int steps);

}  // namespace clothfit
