#pragma once

#include <map>
#include <string>
#include <vector>

namespace clothfit {

/// An effect, by one of its modes, that a model has beside those its recording declares.
struct Hypothesis {
  std::string effect;
  std::string mode;                     ///< empty where the effect has only one
  std::vector<std::string> amplitudes;  ///< parameters that are fitted
  std::map<std::string, double> shape;  ///< parameters beside the amplitudes; others are neutral
  /// Standard deviations of the shape's prior, from the spacing of its grid.
  std::map<std::string, double> shape_sigma;
  bool fits_shape = false;  ///< says whether the shape is fitted too
  /// Whole numbers that pick what it acts on, such as a held point (EffectParameter::picks). They
  /// are given, and never fitted or moved.
  std::map<std::string, int> picked = {};
  /// Effects of which a model must have one for it to be asked (EffectMode::beside).
  std::vector<std::string> beside = {};

  std::string title() const;  ///< "nonuniform_mass (hem)", "support_drift (single, held point 1)"
  /// Names of the amplitudes in the space of a fit, EFFECT.PARAMETER.
  std::vector<std::string> parameters() const;
  /// Returns how many numbers the data choose: amplitudes and shapes.
  size_t number_count() const { return amplitudes.size() + shape.size(); }
  bool same_mode(const Hypothesis& other) const {
    return effect == other.effect && mode == other.mode;
  }
};

/// Returns "wind (pressure) + gravity_tilt"; "base" for none.
std::string title(const std::vector<Hypothesis>& hypotheses);

/// Says whether two hypotheses are of one effect and share a number of their shapes.
bool share_shape(const Hypothesis& one, const Hypothesis& other);

}  // namespace clothfit
