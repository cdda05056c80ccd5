#include "fit/diagnosis/catalogue.h"

#include <algorithm>
#include <cmath>

#include "fit/measurement_effects/registry.h"
#include "fit/observe/held_tracks.h"
#include "fit/problem/effects_of.h"
#include "model/effects/harmonic.h"
#include "model/effects/registry.h"

namespace clothfit {
namespace {

/// Returns how far a grid's value lies from the furthest of its neighbours. For a lone value it is
/// half of the value.
double spacing(const std::vector<double>& values, double at) {
  double below = 0, above = 0;
  for (const double value : values) {
    if (value < at) below = below == 0 ? at - value : std::min(below, at - value);
    if (value > at) above = above == 0 ? value - at : std::min(above, value - at);
  }
  const double wider = std::max(below, above);
  return wider > 0 ? wider : 0.5 * std::abs(at);
}

/// Returns the numbers of the held points that an effect is asked of one by one. There are none
/// where it acts on fewer than two. An edge is held at each of its vertices, and the recording
/// numbers none of these.
std::vector<int> single_points(const Recording& recording, const EffectDescription& effect) {
  std::vector<int> numbers;
  for (size_t n = 0; n < recording.held.size(); ++n) {
    const HeldPoint& point = recording.held[n];
    if (point.edge) return {};
    if (effect.driven_points.first == 0 || point.motion != HeldMotion::fixed)
      numbers.push_back(static_cast<int>(n) + 1);
  }
  return numbers.size() < 2 ? std::vector<int>() : numbers;
}

/// Returns the candidates, each at each of the numbers that a parameter picks by.
ShapeCandidates at_each_number(const ShapeCandidates& narrow, const std::string& parameter,
                               const std::vector<int>& numbers) {
  ShapeCandidates wider;
  for (const Hypothesis& hypothesis : narrow) {
    for (const int number : numbers) {
      wider.push_back(hypothesis);
      wider.back().picked[parameter] = number;
    }
  }
  return wider;
}

Hypothesis without_shape(const EffectDescription& effect, const EffectMode& mode) {
  return {.effect = effect.name,
          .mode = mode.name,
          .amplitudes = mode.amplitudes,
          .shape = {},
          .shape_sigma = {},
          .beside = mode.beside};
}

/// Returns all combinations of the values that a mode's shapes are tried at.
ShapeCandidates shapes_of(const Recording& recording, const EffectDescription& effect,
                          const EffectMode& mode, double duration_s) {
  const Hypothesis hypothesis = without_shape(effect, mode);
  ShapeCandidates result{hypothesis};
  for (const ShapeGrid& grid : mode.shapes) {
    if (grid.per_held_point) {
      result = at_each_number(result, grid.parameter, single_points(recording, effect));
      continue;
    }
    const auto parameter =
        std::ranges::find(effect.parameters, grid.parameter, &EffectParameter::name);
    const double in_unit_per_value = grid.per_duration  ? 1 / duration_s
                                     : grid.of_duration ? duration_s
                                                        : 1;
    ShapeCandidates wider;
    for (const Hypothesis& narrow : result) {
      for (const double value : grid.values) {
        const double in_unit = value * in_unit_per_value;
        if (in_unit < parameter->lower || in_unit > parameter->upper) continue;
        wider.push_back(narrow);
        wider.back().shape[grid.parameter] = in_unit;
        wider.back().shape_sigma[grid.parameter] = spacing(grid.values, value) * in_unit_per_value;
      }
    }
    result = std::move(wider);
  }
  return result;
}

std::vector<EffectMode> modes_of(const EffectDescription& effect) {
  if (!effect.modes.empty()) return effect.modes;
  EffectMode all{.name = "", .amplitudes = {}, .shapes = {}};
  for (const EffectParameter& parameter : effect.parameters)
    all.amplitudes.push_back(parameter.name);
  return {all};
}

/// Tells whether a recording has what an effect of motion acts on.
bool acts_on(const Recording& recording, const EffectDescription& effect) {
  const auto driven = std::ranges::count_if(
      recording.held, [](const HeldPoint& point) { return point.motion != HeldMotion::fixed; });
  const auto [least, most] = effect.driven_points;
  return driven >= least && driven <= most;
}

/// Returns the effects that a model has anyway.
std::vector<std::string> present_effects(const FitInput& input, const FitOptions& options) {
  std::vector<std::string> present = options.effects;
  for (const DeclaredEffect& effect : input.recording.declared) present.push_back(effect.name);
  return present;
}

}  // namespace

ShapeCandidates at_shapes_of(const std::vector<Hypothesis>& hypotheses,
                             const std::map<std::string, double>& values,
                             const ShapeCandidates& shapes) {
  ShapeCandidates result;
  for (Hypothesis one : shapes) {
    for (const Hypothesis& own : hypotheses) {
      if (own.effect != one.effect) continue;
      for (const auto& [parameter, value] : own.shape) {
        if (!one.shape.contains(parameter)) continue;
        const auto fitted = values.find(own.effect + "." + parameter);
        one.shape[parameter] = fitted == values.end() ? value : fitted->second;
      }
    }
    const bool known = std::ranges::any_of(result, [&](const Hypothesis& other) {
      return other.shape == one.shape && other.picked == one.picked;
    });
    if (!known) result.push_back(std::move(one));
  }
  return result;
}

bool is_harmonic(const Hypothesis& hypothesis) {
  const EffectDescription effect = describe_effect(hypothesis.effect);
  const auto own = std::ranges::find(effect.modes, hypothesis.mode, &EffectMode::name);
  return own != effect.modes.end() && Harmonic::is_followed_by(*own);
}

bool is_over_cloth(const Hypothesis& hypothesis) {
  const EffectDescription effect = describe_effect(hypothesis.effect);
  const auto own = std::ranges::find(effect.modes, hypothesis.mode, &EffectMode::name);
  return own != effect.modes.end() && std::ranges::any_of(own->shapes, &ShapeGrid::over_cloth);
}

ShapeCandidates shapes_around(const Hypothesis& hypothesis, double part) {
  const EffectDescription effect = describe_effect(hypothesis.effect);
  ShapeCandidates around;
  for (const auto& [name, value] : hypothesis.shape) {
    const EffectParameter& parameter =
        *std::ranges::find(effect.parameters, name, &EffectParameter::name);
    for (const double way : {-part, part}) {
      const double moved = value + way * hypothesis.shape_sigma.at(name);
      if (moved < parameter.lower || moved > parameter.upper) continue;
      around.push_back(hypothesis);
      around.back().shape[name] = moved;
    }
  }
  return around;
}

std::vector<Hypothesis> empirical_hypotheses(const FitInput& input, const FitOptions& options) {
  const std::vector<std::string> present = present_effects(input, options);
  std::vector<Hypothesis> result;
  for (const EffectEntry& entry : effect_registry()) {
    const EffectDescription effect = entry.describe();
    if (!effect.empirical || std::ranges::find(present, effect.name) != present.end()) continue;
    for (const EffectMode& mode : modes_of(effect)) result.push_back(without_shape(effect, mode));
  }
  return result;
}

std::vector<Hypothesis> contacts_to_test(const FitInput& input, const FitOptions& options) {
  const std::vector<std::string> present = present_effects(input, options);
  std::vector<Hypothesis> result;
  for (const EffectEntry& entry : effect_registry()) {
    const EffectDescription effect = entry.describe();
    if (std::ranges::find(present, effect.name) != present.end()) continue;
    for (const EffectMode& mode : effect.modes)
      if (std::ranges::any_of(mode.shapes, &ShapeGrid::from_pushes))
        result.push_back(without_shape(effect, mode));
  }
  return result;
}

std::vector<ShapeCandidates> hypotheses_to_test(const FitInput& input, const FitOptions& options,
                                                double duration_s) {
  const std::vector<std::string> present = present_effects(input, options);
  std::vector<std::string> names;
  for (const EffectEntry& entry : effect_registry()) {
    const EffectDescription effect = entry.describe();
    if (!effect.empirical && acts_on(input.recording, effect)) names.push_back(effect.name);
  }
  if (!follows_markers(input.recording))
    for (const MeasurementEffectEntry& entry : measurement_effect_registry())
      names.emplace_back(entry.name);

  std::vector<ShapeCandidates> result;
  for (const std::string& name : names) {
    if (std::ranges::find(present, name) != present.end()) continue;
    const EffectDescription effect = describe_effect(name);
    if (effect.test == EffectTest::finite && effect.modes.empty()) continue;
    for (const EffectMode& mode : modes_of(effect)) {
      ShapeCandidates shapes = shapes_of(input.recording, effect, mode, duration_s);
      if (!shapes.empty()) result.push_back(std::move(shapes));
    }
  }
  return result;
}

}  // namespace clothfit
