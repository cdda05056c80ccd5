#include "fit/preflight/gravity_candidates.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>

namespace clothfit {

std::vector<GravityCandidate> gravity_candidates(const Eigen::Vector3d& declared) {
  constexpr double kAlike = 0.9;  // cosine from which an axis is the declared direction
  const double size = declared.norm();
  std::vector<GravityCandidate> candidates{{"turned round", -declared}};
  constexpr std::array kAxes{"x", "y", "z"};
  for (int axis = 0; axis < 3; ++axis)
    for (const int sign : {-1, 1}) {
      const Eigen::Vector3d g = sign * size * Eigen::Vector3d::Unit(axis);
      if (std::abs(g.normalized().dot(declared.normalized())) < kAlike)
        candidates.push_back(
            {fmt::format("along {}{}", sign > 0 ? "+" : "-", kAxes[static_cast<size_t>(axis)]), g});
    }
  return candidates;
}

std::string vector_text(const Eigen::Vector3d& v) {
  const auto shown = [](double number) { return std::round(100 * number) / 100 + 0.0; };
  return fmt::format("[{:g}, {:g}, {:g}]", shown(v.x()), shown(v.y()), shown(v.z()));
}

std::string gravity_text(const GravityCandidate& candidate) {
  return fmt::format("gravity {}, {},", candidate.name, vector_text(candidate.m_per_s2));
}

}  // namespace clothfit
