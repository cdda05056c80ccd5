#pragma once

#include <string>

#include "apps/study/louchet1995/study.h"

namespace clothfit {

/// Draws figure 2: the cloth at the end of its motion.
std::string hanging_cloth_svg(const Louchet1995Study& study);

/// Draws figures 3 and 4: both costs over K and tau, for the motion of one reference elongation.
std::string landscapes_svg(const Louchet1995Study& study, double reference_elongation);

/// Draws figure 5: the original, the printed good and the printed bad reconstruction at some
/// instants.
std::string reconstructions_svg(const Louchet1995Study& study);

/// Draws the distance of each reconstruction over the motion.
std::string distances_svg(const Louchet1995Study& study);

/// Draws costs of the strategy's best individuals, sorted, before and after refinement.
std::string cost_distribution_svg(const Louchet1995Study& study);

/// Draws the median best cost of each search against the number of costs computed.
std::string races_svg(const Louchet1995Study& study);

/// Draws the relative sigma of each parameter from one transition, along the motion.
std::string places_svg(const Louchet1995Study& study);

}  // namespace clothfit
