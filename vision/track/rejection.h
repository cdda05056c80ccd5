#pragma once

#include <string>
#include <vector>

namespace clothfit {

/// A reason that keeps a detected point out of every fit. `code` follows `rejected:` in tracks
/// files.
struct RejectionReason {
  std::string code;
  std::string meaning;  ///< one sentence for a person
};

/// Returns every reason that tracking gives, in the order in which they are tried.
const std::vector<RejectionReason>& rejection_reasons();

/// The codes, one name each.
namespace rejection {
inline constexpr const char* kLowMargin = "low_margin";
inline constexpr const char* kCorrectedBits = "corrected_bits";
inline constexpr const char* kPatternMismatch = "pattern_mismatch";
inline constexpr const char* kCovered = "covered";
inline constexpr const char* kUncertain = "uncertain";
inline constexpr const char* kTouchingBorder = "touching_border";
inline constexpr const char* kTooOblique = "too_oblique";
inline constexpr const char* kDuplicateId = "duplicate_id";
inline constexpr const char* kJump = "jump";
}  // namespace rejection

}  // namespace clothfit
