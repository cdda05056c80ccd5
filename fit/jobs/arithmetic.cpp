#include "fit/jobs/arithmetic.h"

#include <gnu/libc-version.h>

namespace clothfit {

std::string arithmetic_name() {
  // The library takes its fused functions where both are there.
  const bool is_fused = __builtin_cpu_supports("fma") && __builtin_cpu_supports("avx2");
  return std::string("glibc ") + gnu_get_libc_version() +
         (is_fused ? " with fused multiply-add" : " without fused multiply-add");
}

}  // namespace clothfit
