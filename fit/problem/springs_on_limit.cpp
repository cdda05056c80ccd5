#include "fit/problem/springs_on_limit.h"

namespace clothfit {

SpringsOnLimit springs_on_limit(const Cloth& cloth, const SpringParameters& springs,
                                const std::vector<Eigen::Matrix3Xd>& position_m) {
  SpringsOnLimit count;
  const bool limited = cloth.strain_limit.mode != StrainLimitMode::off;
  for (size_t frame = 1; frame < position_m.size(); ++frame) {
    const Eigen::Matrix3Xd& p = position_m[frame];
    for (size_t type = 0; type < kSpringTypes; ++type) {
      const double limit_m =
          springs.natural_length_m[type] * (1 + kOnLimit * springs.critical_elongation[type]);
      for (const Spring& spring : cloth.springs[type]) {
        ++count.all[type];
        if (limited && (p.col(spring.b) - p.col(spring.a)).norm() >= limit_m) ++count.on[type];
      }
    }
  }
  return count;
}

}  // namespace clothfit
