#include "vision/track/rejection.h"

namespace clothfit {

const std::vector<RejectionReason>& rejection_reasons() {
  static const std::vector<RejectionReason> reasons = {
      {rejection::kLowMargin, "the tag's bits were read with too little contrast"},
      {rejection::kCorrectedBits, "too many of the tag's bits were read wrong to trust its number"},
      {rejection::kTooOblique,
       "the tag is seen so flat, or so folded, that its corners slide along its edges"},
      {rejection::kPatternMismatch, "the printed pattern does not explain the picture of the tag"},
      {rejection::kTouchingBorder, "the corner lies at the border of the picture"},
      {rejection::kCovered, "something hides the corner"},
      {rejection::kUncertain, "the corner's standard deviation is above the limit"},
      {rejection::kDuplicateId, "the same tag was read twice in one picture"},
      {rejection::kJump, "the tag is far from where it was before and from where it is after"},
  };
  return reasons;
}

}  // namespace clothfit
