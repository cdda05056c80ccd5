#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <vector>

#include "apps/study/scene/hidden_mode.h"

namespace clothfit {

/// The information of one release's recordings on modes. The first thread that asks for it computes
/// it.
class Release {
 public:
  Release(const SyntheticScene& scene, const FitOptions& fit, std::uint64_t seed)
      : scene_(scene), fit_(fit), seed_(seed) {}

  std::uint64_t seed() const { return seed_; }
  const RecordingInformation& information() const;
  const std::vector<std::vector<Eigen::MatrixXd>>& projected_modes() const;

 private:
  const SyntheticScene& scene_;
  const FitOptions& fit_;
  std::uint64_t seed_;
  mutable std::once_flag has_information_, has_modes_;
  mutable std::unique_ptr<RecordingInformation> information_;
  mutable std::vector<std::vector<Eigen::MatrixXd>> modes_;
};

/// The releases that were asked for last: each is some tens of megabytes.
class Releases {
 public:
  /// Both arguments must outlive the object.
  Releases(const SyntheticScene& scene, const FitOptions& fit) : scene_(scene), fit_(fit) {}
  std::shared_ptr<const Release> at(std::uint64_t seed);

 private:
  const SyntheticScene& scene_;
  const FitOptions& fit_;
  std::mutex mutex_;
  std::deque<std::shared_ptr<const Release>> known_;
};

}  // namespace clothfit
