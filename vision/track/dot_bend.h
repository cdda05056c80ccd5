#pragma once

#include <Eigen/Core>

#include "vision/track/dot_layout.h"

namespace clothfit {

/// Returns how far the centre of a dot's outline lies from the place of its printed centre, because
/// the map from cloth to picture bends within the dot: by perspective, and by the cloth itself. An
/// outline point of radius r in direction (cos a, sin a) is shifted by (r^2 / 2) h(a),
/// h = x_ss cos^2 a + 2 x_st cos a sin a + x_tt sin^2 a. Fitting an ellipse to these shifts moves
/// its centre by
///
///   J g,  g_s = (r^2 / 2) (3/4 k^s_ss + 1/4 k^s_tt + 1/2 k^t_st),  k = J^-1 x_..,
///
/// and g_t likewise: the part of the shift along the outline's normal, projected on cos a and
/// sin a. `radius` is in spacings. Zero where the map is too flat to be inverted.
Eigen::Vector2d dot_bend_shift_px(const LocalMap& map, double radius);

}  // namespace clothfit
