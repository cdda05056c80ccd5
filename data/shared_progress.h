#pragma once

#include <memory>
#include <mutex>
#include <utility>

#include "data/progress.h"

namespace clothfit {

/// Wraps a callback so that several threads may call it at once. They wait for each other, and once
/// it has said to stop it is not asked again. Empty where `progress` is.
inline ProgressCallback for_threads(ProgressCallback progress) {
  if (!progress) return progress;
  struct State {
    std::mutex mutex;
    bool stopped = false;
  };
  return [progress = std::move(progress), state = std::make_shared<State>()](const Progress& now) {
    const std::scoped_lock lock(state->mutex);
    state->stopped = state->stopped || !progress(now);
    return !state->stopped;
  };
}

}  // namespace clothfit
