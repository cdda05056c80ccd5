#pragma once

#include <functional>
#include <string>

namespace clothfit {

/// What a long call reports: `done` of `total` units of `stage`. `note` is one short phrase such as
/// the best cost so far. Returning false asks the call to stop soon; it then returns a result that
/// says it was cancelled.
struct Progress {
  std::string stage;
  double done = 0;
  double total = 0;  ///< 0 when unknown
  std::string unit;  ///< "frames", "evaluations"
  std::string note;
};
using ProgressCallback = std::function<bool(const Progress&)>;

}  // namespace clothfit
