#pragma once

#include <limits>
#include <string>
#include <vector>

namespace clothfit {

/// An effect that a recording of another program hides.
struct HiddenTruth {
  std::string kind;  ///< as truth.json names it; of a contact with the body: "contact/sphere"
  /// The catalogue's effects that are right about it. A name that ends in * stands for all effects
  /// whose names begin so.
  std::vector<std::string> answers;

  bool is_answered_by(const std::string& effect) const;
  std::string title() const;  ///< "gravity_tilt or world_tilt"
};

/// The kinds of recordings by which a diagnosis is judged.
enum class TruthKind {
  hidden_effects,  ///< it must name them, and nothing else
  nothing_hidden,  ///< it must find the model adequate
  foreign_law      ///< no effect is hidden, but the cloth follows a law that is not the model's
};
std::string to_string(TruthKind kind);

/// What another program simulated, as far as a diagnosis is judged by it.
struct ForeignTruth {
  std::vector<HiddenTruth> hidden;
  bool foreign_law = false;  ///< the cloth's springs follow a law that is not the model's
  /// Floors of the held-out error, as rms distances over the last 30 % of the frames: how much half
  /// as many steps change the simulation. NaN where none is stated.
  double floor_m = std::numeric_limits<double>::quiet_NaN();
  double floor_px = std::numeric_limits<double>::quiet_NaN();  ///< of the first camera

  TruthKind kind() const;
};

/// Reads the text of a truth.json. No diagnosis may see it. Throws InputError, with `where` for its
/// place, also where it hides an effect of a kind that the table of kinds lacks.
ForeignTruth parse_foreign_truth(const std::string& text, const std::string& where);

/// Says whether an effect belongs to the cloth itself: its springs, masses or shape at rest. Every
/// other one acts from outside, or on the measurement.
bool is_inside_cloth(const std::string& effect);

}  // namespace clothfit
