#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "fit/preflight/recorded_motion.h"

namespace clothfit {

/// A direction that gravity may have in place of the declared one.
struct GravityCandidate {
  std::string name;  ///< such as "along -z"
  Eigen::Vector3d m_per_s2;
};

/// Returns what people write in its place: turned round, and along the other axes, of its size.
std::vector<GravityCandidate> gravity_candidates(const Eigen::Vector3d& declared);

/// Returns "[0, 0, -9.81]".
std::string vector_text(const Eigen::Vector3d& v);

/// Returns the beginning of a remedy: "gravity along -z, [0, 0, -9.81],".
std::string gravity_text(const GravityCandidate& candidate);

/// Returns the gravity along which the markers' middle lies from those that are held, in the mean
/// of all frames, where that is not the declared one. It is looked for in 3D tracks.
std::optional<GravityCandidate> hangs_along(const RecordedMotion& motion);

}  // namespace clothfit
