#pragma once

namespace clothfit {

struct TrackOptions {
  /// px per frame, > 0: a tag is rejected if it is further than this both from its place before and
  /// from its place after. Higher values let wrongly read tags through.
  double max_speed_px = 60;
  /// Grey levels, >= 0: weaker readings of a tag's bits are rejected. They are those of a tag whose
  /// white is 160 above its black or more, and in proportion less on a darker one. This and
  /// `min_explained` count where a whole picture was searched; the cells speak for predicted tags.
  double min_decision_margin = 20;
  /// 0 to 1: a tag is rejected if the printed pattern explains less of its pixels. A clean one has
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
