#pragma once

#include <functional>

#include "model/cloth/cloth.h"

namespace clothfit {

/// A constant of a spring: its stiffness (N/m), say, or its dashpot's (N s/m).
using SpringConstant = std::function<double(SpringType type, const Spring& spring)>;

/// Bounds the eigenvalues of M^-1 L, L the network in which every spring pulls with `constant`
/// along itself. For stiffness this bounds the square of the largest angular frequency (1/s2), for
/// dashpots the damping rate (1/s).
///
/// The bound is, over all vertices, twice the largest eigenvalue of sum k u u' over the springs,
/// divided by the mass, in the flat cloth. A quarter more is added for folded cloth, where springs
/// of several directions may line up. Constants >= 0; 0 where all are.
double network_bound(const Cloth& cloth, const SpringConstant& constant);

}  // namespace clothfit
