#include "model/laboratory/thread_direction.h"

#include <utility>

namespace clothfit {

MeasuredFabric turned(const MeasuredFabric& fabric) {
  MeasuredFabric result = fabric;
  std::swap(result.tension_warp_n_per_m, result.tension_weft_n_per_m);
  std::swap(result.bending_warp_n_m, result.bending_weft_n_m);
  return result;
}

}  // namespace clothfit
