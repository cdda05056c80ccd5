#pragma once

#include <vector>

#include "model/cloth/effect.h"

namespace clothfit {

/// Returns the three parameters of a vector, which are alike but for their names. They are NAME_x,
/// NAME_y, NAME_z for the given one called NAME.
inline std::vector<EffectParameter> vector_parameter(const EffectParameter& of_each) {
  std::vector<EffectParameter> three(3, of_each);
  three[0].name += "_x";
  three[1].name += "_y";
  three[2].name += "_z";
  return three;
}

}  // namespace clothfit
