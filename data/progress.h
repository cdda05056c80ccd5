#pragma once

#include <functional>
#include <string>

namespace clothfit {

/// A report of a long call: `done` of `total` units of `stage`. `note` is one short phrase such as
/// the best cost so far. If the callback returns false, the call stops soon; its result then says
/// that it was cancelled.
struct Progress {
  std::string stage;
  double done = 0;
  double total = 0;  ///< 0 when unknown
  std::string unit;  ///< "frames", "evaluations"
  std::string note;
};
using ProgressCallback = std::function<bool(const Progress&)>;

}  // namespace clothfit
