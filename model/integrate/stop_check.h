#pragma once

#include <algorithm>
#include <functional>

namespace clothfit {

/// Asked whether a long call is to end. True ends it: its result then says that it was cancelled.
/// What the check throws leaves the call. Several threads may ask at once. Empty: never.
using StopCheck = std::function<bool()>;

/// Asks a StopCheck in a loop over time steps, every few milliseconds of work. It counts
/// spring-steps, which costs nothing beside them, and no clock is looked at.
class StopAsker {
 public:
  /// `springs`: what one step moves. `check` must outlive the asker.
  StopAsker(const StopCheck& check, size_t springs)
      : check_(check),
        steps_(static_cast<int>(std::max(1.0, kAskedEvery / (static_cast<double>(springs) + 1)))) {}

  /// Says after a step whether the call is to end.
  bool ends() {
    if (!check_ || ++taken_ < steps_) return false;
    taken_ = 0;
    return check_();
  }

 private:
  /// Spring-steps between two questions: a millisecond of a plain run, some dozens of one with
  /// many derivatives.
  static constexpr double kAskedEvery = 1e5;

  const StopCheck& check_;
  int steps_ = 1;
  int taken_ = 0;
};

}  // namespace clothfit
