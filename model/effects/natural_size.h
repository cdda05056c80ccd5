#pragma once

#include <memory>

#include "model/cloth/effect.h"

/// Gives the fabric's springs another size at rest than the stated one. The cloth may have shrunk,
/// or its markers may have been placed by a wrong scale:
///
///   tension -= k l0 e,   e = warp  along the warp (types 0 and 4)
///                        e = weft  along the weft (types 1 and 5)
///                        e = (warp + weft) / 2  between them (types 2 and 3)
///
/// so that the natural length is l0 (1 + e) in place of l0. Where cells are square, the diagonal's
/// is that of a cell with such sides to the first order in warp - weft. Parameters: warp, weft
/// (ratios), neutral at 0. Ours.
namespace clothfit::natural_size {

EffectDescription describe();
std::unique_ptr<Effect> make();

}  // namespace clothfit::natural_size
