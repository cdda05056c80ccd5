#include "tests/model/spring_force_variants.h"

namespace clothfit {

#define CLOTHFIT_DECLARE_VARIANT(name)                                                          \
  void add_spring_forces_##name(const SpringNet&, const LaneSprings&, const LaneVectors&,       \
                                const LaneVectors&, LaneVectors&);                              \
  void integrate_euler_##name(const Eigen::VectorXd&, double, const LaneVectors&, LaneVectors&, \
                              LaneVectors&)

#if defined(__x86_64__)
CLOTHFIT_DECLARE_VARIANT(sse2);
CLOTHFIT_DECLARE_VARIANT(avx2);
CLOTHFIT_DECLARE_VARIANT(avx512);
#endif

std::vector<KernelVariant> kernel_variants() {
  const auto everywhere = [] { return true; };
  return {
    {"chosen_here", everywhere, add_spring_forces, integrate_euler},
#if defined(__x86_64__)
        {"sse2", everywhere, add_spring_forces_sse2, integrate_euler_sse2},
        {"avx2",
         [] { return __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0; },
         add_spring_forces_avx2, integrate_euler_avx2},
        {"avx512",
         [] {
           return __builtin_cpu_supports("avx512f") != 0 &&
                  __builtin_cpu_supports("avx512vl") != 0 &&
                  __builtin_cpu_supports("avx512dq") != 0 &&
                  __builtin_cpu_supports("avx512bw") != 0;
         },
         add_spring_forces_avx512, integrate_euler_avx512},
#endif
  };
}

}  // namespace clothfit
