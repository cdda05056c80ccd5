#pragma once

#include <stdexcept>
#include <string>

namespace clothfit {

/// What the program's exit code tells a script. A mistake in the input (3) arrives as InputError.
enum ExitCode : int {
  kExitGood = 0,
  kExitWrongUsage = 2,
  kExitBadInput = 3,
  kExitNoResult = 4,
  kExitCancelled = 130,
};

/// The input was fine, the numbers did not work out; the message says why. Only verbs and steps
/// throw it: the rooms below return reasons.
class NoResult : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The user asked to stop; nothing is left behind but what `remedy`, where given, names.
class Cancelled : public std::runtime_error {
 public:
  explicit Cancelled(const std::string& remedy = "")
      : std::runtime_error("cancelled; no results were written" +
                           (remedy.empty() ? "" : "; " + remedy)) {}
};

}  // namespace clothfit
