#pragma once

#include <hwy/targets.h>

#include <string>
#include <vector>

namespace clothfit {

/// An instruction set that the kernels are compiled for and this machine has.
struct InstructionSet {
  int64_t highway_target;
  std::string name() const { return hwy::TargetName(highway_target); }
};

inline std::ostream& operator<<(std::ostream& out, const InstructionSet& set) {
  return out << set.name();
}

inline std::vector<InstructionSet> instruction_sets() {
  std::vector<InstructionSet> sets;
  for (const int64_t target : {HWY_AVX3, HWY_AVX2, HWY_SSE4})
    if ((hwy::SupportedTargets() & target) != 0) sets.push_back({target});
  sets.push_back({HWY_STATIC_TARGET});  // every processor of this kind runs these
  return sets;
}

/// Makes the kernels run on one instruction set while it lives.
class OnInstructionSet {
 public:
  explicit OnInstructionSet(const InstructionSet& set) {
    hwy::GetChosenTarget().Update(set.highway_target);
  }
  ~OnInstructionSet() { hwy::GetChosenTarget().Update(hwy::SupportedTargets()); }
  OnInstructionSet(const OnInstructionSet&) = delete;
  OnInstructionSet& operator=(const OnInstructionSet&) = delete;
};

}  // namespace clothfit
