#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "fit/diagnosis/fitted_model.h"
#include "fit/diagnosis/score.h"
#include "fit/diagnosis/trial.h"

namespace clothfit {

/// How an entry's model came to the basin that it stands in.
enum class BasinOrigin {
  of_parent,     ///< refined from the entry that it extends
  from_scratch,  ///< identified as if nothing were known
  changed        ///< where a hypothesis led to, which it does not have
};

/// An entry of the beam: a model, and what was said of the hypotheses that led to it.
struct BeamEntry {
  static constexpr double kNothing = std::numeric_limits<double>::infinity();

  FittedModel model;
  std::vector<AcceptedEffect> accepted;
  double cost = 0;
  /// Chi-square per number left out, of corrections without physics that did as well as one of its
  /// hypotheses. It is no result before it leaves less.
  double must_still_beat = kNothing;
  BasinOrigin basin = BasinOrigin::of_parent;
  bool finished = false;       ///< it was extended, or cannot be
  std::vector<Score> last;     ///< what its model would still show, over all frames
  std::vector<Trial> refused;  ///< when it was extended

  /// Whether it may be a result.
  bool is_sound() const { return must_still_beat == kNothing; }
};

/// Best-first search over entries, of which only the cheapest are kept [lowerre1976]. It knows
/// their costs, and neither how they are extended nor what a cost is.
class Beam {
 public:
  Beam(BeamEntry first, size_t width, size_t most_effects);

  /// The cheapest entry that is not finished and has room for one more effect. Where there is none
  /// and the best entry is not sound, the cheapest sound one takes the place of all. Null when
  /// done.
  BeamEntry* next();

  BeamEntry& best() { return entries_.front(); }

  /// Adds extensions of an entry. Of entries with the same hypotheses the cheapest stays. Those
  /// that have gained far less than the best one, from `base_cost` on, are not followed, nor more
  /// than the beam is wide; of them the cheapest sound one is kept to fall back on.
  void add(std::vector<BeamEntry> children, double base_cost);

 private:
  void drop_repeated();
  void drop_far_behind(double base_cost);

  std::vector<BeamEntry> entries_;  ///< by cost
  std::vector<BeamEntry> dropped_;
  size_t width_, most_effects_;
};

}  // namespace clothfit
