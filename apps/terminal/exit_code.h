#pragma once

#include <stdexcept>
#include <string>

namespace clothfit {

/// The meaning of the program's exit code to a script. A mistake in the input (3) arrives as
/// InputError.
enum ExitCode : int {
  kExitGood = 0,
  kExitWrongUsage = 2,
  kExitBadInput = 3,
  kExitNoResult = 4,
  kExitCancelled = 130,
};

/// Says that the input was fine but the numbers did not work out; the message says why. Only verbs
/// and steps throw it: the rooms below return reasons.
class NoResult : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Says that the user asked to stop. Nothing is left behind but what `remedy`, where given, names.
class Cancelled : public std::runtime_error {
 public:
  explicit Cancelled(const std::string& remedy = "")
      : std::runtime_error("cancelled; no results were written" +
                           (remedy.empty() ? "" : "; " + remedy)) {}
};

}  // namespace clothfit
