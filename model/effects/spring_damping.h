#pragma once

#include <memory>

#include "model/cloth/effect.h"

/// Damps inside the fabric beyond its common damping, for each group of springs by itself:
///
///   tension += time k dl/dt
///
/// time is a retardation time beside that of the fabric. A dashpot time k stands beside a spring of
/// stiffness k (a Kelvin-Voigt solid), so it is the fabric's and not the mesh's. It acts along the
/// springs only: cloth that turns rigidly loses no energy. Parameters: structural (types 0 and 1),
/// shear (2 and 3), flexion (4 and 5), in s, neutral at 0. Ours; see docs/effects.
namespace clothfit::spring_damping {

EffectDescription describe();
std::unique_ptr<Effect> make();

}  // namespace clothfit::spring_damping
