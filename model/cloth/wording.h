#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "model/cloth/fitted_effect.h"

namespace clothfit {

/// These functions write the pieces of EffectDescription::in_words.

/// The density of air at 20 degrees (kg/m3).
inline constexpr double kAirDensity_kg_per_m3 = 1.2;

/// Writes a number to three digits, never with an exponent; "0" for nothing.
std::string rounded(double value);

/// Writes a length in metres as "12.3 mm".
std::string millimetres(double length_m);

/// Writes "1.40 % longer" for 0.014, "1.40 % shorter" for -0.014, with the words given.
std::string percent(double share, const char* more, const char* less);

/// Writes the direction of a vector as "(0.36, 0.93, 0.01)".
std::string unit_vector(const Eigen::Vector3d& v);

/// Writes a place in the world as "(0.100, -0.250, 0.400) m".
std::string world_place(const Eigen::Vector3d& place_m);

/// Returns the angle (degrees) of Cayley's rotation by a rotation vector w (rad), 2 atan(|w| / 2).
double turn_degrees(const Eigen::Vector3d& turn_rad);

/// Writes a way over the cloth as "3.00 mm to the right and 1.20 mm down", as seen from its printed
/// side. A part below a hundredth of the other is left out; "" for no way.
std::string way_over_cloth(const Eigen::Vector2d& way_m);

/// Writes a place on the cloth as "60.0 mm from the left, 120 mm from the top".
std::string place_on_cloth(const Eigen::Vector2d& at_m);

/// Writes "at held point 1 (top left corner)"; "at every held point" for the number 0.
std::string at_held_point(const FittedEffect& found, double number);

/// Joins texts by ", ", without those that are empty.
std::string listed(const std::vector<std::string>& texts);

}  // namespace clothfit
