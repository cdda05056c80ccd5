#include "apps/study/scene/releases.h"

#include <algorithm>

namespace clothfit {

const RecordingInformation& Release::information() const {
  std::call_once(has_information_, [&] {
    information_ =
        std::make_unique<RecordingInformation>(recording_information(scene_, fit_, seed_));
  });
  return *information_;
}

const std::vector<std::vector<Eigen::MatrixXd>>& Release::projected_modes() const {
  const RecordingInformation& own = information();
  std::call_once(has_modes_, [&] { modes_ = clothfit::projected_modes(own); });
  return modes_;
}

std::shared_ptr<const Release> Releases::at(std::uint64_t seed) {
  constexpr size_t kMost = 4;
  const std::scoped_lock lock(mutex_);
  const auto found = std::ranges::find_if(known_, [&](const auto& r) { return r->seed() == seed; });
  if (found != known_.end()) return *found;
  if (known_.size() == kMost) known_.pop_front();
  return known_.emplace_back(std::make_shared<const Release>(scene_, fit_, seed));
}

}  // namespace clothfit
