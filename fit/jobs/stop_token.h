#pragma once

#include <functional>
#include <utility>

#include "data/progress.h"
#include "data/shared_progress.h"

namespace clothfit {

/// Ends a call that nobody waits for. fit() and diagnose() catch it; it never leaves them.
struct StopRequested {};

/// Ends a search whose time is up. diagnose() catches it and goes on with what was found.
struct TimeIsUp {};

/// Returns a callback that throws StopRequested where `progress` says to stop, and else returns
/// true. Several threads may call it at once, in loops of for_each_index (data/parallel.h). It
/// is empty where there is no `progress`.
inline ProgressCallback stop_token(ProgressCallback progress) {
  if (!progress) return progress;
  return [asked = for_threads(std::move(progress))](const Progress& now) {
    if (!asked(now)) throw StopRequested();
    return true;
  };
}

/// Returns a check for simulations (model/integrate/stop_check.h) that throws StopRequested where
/// `asked` says so. It is empty where nothing asks.
inline std::function<bool()> throwing_check(std::function<bool()> asked) {
  if (!asked) return asked;
  return [asked = std::move(asked)] {
    if (asked()) throw StopRequested();
    return false;
  };
}

/// Reports progress, and throws StopRequested where that says to stop.
inline void report_progress(const ProgressCallback& progress, const Progress& now) {
  if (progress && !progress(now)) throw StopRequested();
}

}  // namespace clothfit
