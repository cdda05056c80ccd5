#pragma once

#include "model/fabric/measured_fabric.h"

namespace clothfit {

/// The thread direction along which a test bends or stretches a fabric.
enum class ThreadDirection { warp, weft };

/// Returns the fabric turned by a right angle: warp and weft exchanged.
MeasuredFabric turned(const MeasuredFabric& fabric);

}  // namespace clothfit
