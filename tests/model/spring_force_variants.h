#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "model/kernels/spring_force.h"

namespace clothfit {

/// The kernels compiled for one instruction set. The program picks one when it starts; here the
/// same source is compiled once more for each (CMakeLists.txt), so that a machine checks all the
/// instruction sets that it has.
struct KernelVariant {
  std::string name;
  bool (*runs_here)();
  decltype(&clothfit::add_spring_forces) add_forces;
  decltype(&clothfit::integrate_euler) integrate;
};

inline std::ostream& operator<<(std::ostream& out, const KernelVariant& variant) {
  return out << variant.name;
}

std::vector<KernelVariant> kernel_variants();

}  // namespace clothfit
