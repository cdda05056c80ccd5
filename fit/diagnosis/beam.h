#pragma once

#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include "fit/diagnosis/fitted_model.h"
#include "fit/diagnosis/score.h"
#include "fit/diagnosis/trial.h"

namespace clothfit {

/// The way in which an entry's model came to its basin.
enum class BasinOrigin {
  of_parent,     ///< refined from the entry that it extends
  from_scratch,  ///< identified as if nothing were known
  changed        ///< led there by a hypothesis that it does not have
};

/// An entry of the beam: a model, and the trials of the hypotheses that led to it.
struct BeamEntry {
  static constexpr double kNothing = std::numeric_limits<double>::infinity();

  FittedModel model;
  std::vector<AcceptedEffect> accepted;
  double cost = 0;
  /// Chi-square per number left out, of a correction that did as well as one of the hypotheses. The
  /// correction has no physics. The entry is no result before it leaves less.
  double must_still_beat = kNothing;
  BasinOrigin basin = BasinOrigin::of_parent;
  bool finished = false;       ///< it was extended, or cannot be
  std::vector<Score> last;     ///< scores in its model, over all frames
  std::vector<Trial> refused;  ///< when it was extended

  /// Tells whether it may be a result.
  bool is_sound() const { return must_still_beat == kNothing; }
};

/// Searches entries best first and keeps only the cheapest [lowerre1976]. It knows their costs, but
/// neither how they are extended nor what a cost is made of.
class Beam {
 public:
  Beam(BeamEntry first, size_t width, size_t most_effects);

  /// Returns the cheapest unfinished entry that has room for one more effect. Where there is none
  /// and the best entry is not sound, the cheapest sound one takes the place of all. Null when
  /// done.
  BeamEntry* next();

  BeamEntry& best() { return entries_.front(); }
  std::vector<BeamEntry> release() { return std::move(entries_); }
  /// Gives away the cheapest sound entry, as the result of a search that ends early.
  BeamEntry release_best_sound();

  /// Adds extensions of an entry. Of entries with the same hypotheses the cheapest stays. An entry
  /// is dropped that gained far less than the best one, counted from `base_cost`, or for which the
  /// beam is not wide enough. Of those dropped the cheapest sound one is kept to fall back on.
  void add(std::vector<BeamEntry> children, double base_cost);

 private:
  void drop_repeated();
  /// Puts first, of the entries that cannot be told from the cheapest, the one with the fewest
  /// numbers. A gust that hardly changes is a wind.
  void put_simplest_first();
  void drop_far_behind(double base_cost);

  std::vector<BeamEntry> entries_;  ///< by cost, but for the first
  std::vector<BeamEntry> dropped_;
  size_t width_, most_effects_;
};

}  // namespace clothfit
