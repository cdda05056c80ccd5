#pragma once

namespace clothfit {

struct TrackOptions {
  /// px per frame, > 0: a tag that is further than this both from where it was before and from
  /// where it is after is rejected. Higher values let wrongly read tags through.
  double max_speed_px = 60;
  /// Grey levels, >= 0: weaker readings of a tag's bits are rejected.
  double min_decision_margin = 20;
  /// 0 to 1: a tag of whose pixels the printed pattern explains less is rejected; a clean one has
  /// 0.9.
  double min_explained = 0.7;
  /// px, > 0: corners that are placed worse are rejected.
  double max_sigma_px = 1;
  /// 0 to 2: readings with more wrong bits are rejected. Families whose codes lie close together
  /// (tag16h5) are never read with more than is safe.
  int max_corrected_bits = 2;
  void validate() const;  ///< throws InputError
};

}  // namespace clothfit
