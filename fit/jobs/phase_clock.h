#pragma once

#include <chrono>
#include <string>
#include <vector>

namespace clothfit {

/// The clock time that a phase of a long call took, all its turns together.
struct PhaseTime {
  std::string name;
  double seconds = 0;
};

/// Adds up clock time by phase. One thread says where the call is.
class PhaseClock {
 public:
  /// Ends the phase that runs, and begins or goes on with another.
  void enter(const std::string& phase) {
    const auto now = std::chrono::steady_clock::now();
    if (!phases_.empty())
      phases_[current_].seconds += std::chrono::duration<double>(now - since_).count();
    since_ = now;
    for (current_ = 0; current_ < phases_.size(); ++current_)
      if (phases_[current_].name == phase) return;
    phases_.push_back({.name = phase});
  }

  /// Returns the phases in the order in which they began. The one that runs counts up to now.
  std::vector<PhaseTime> times() {
    if (!phases_.empty()) enter(std::string(phases_[current_].name));
    return phases_;
  }

 private:
  std::vector<PhaseTime> phases_;
  size_t current_ = 0;
  std::chrono::steady_clock::time_point since_;
};

}  // namespace clothfit
