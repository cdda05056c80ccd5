#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "data/median.h"
#include "fit/measurement_effects/registry.h"
#include "fit/preflight/checks.h"
#include "fit/preflight/criteria.h"
#include "fit/problem/effects_of.h"

namespace clothfit {
namespace {

void check_mass(const Recording& recording, CheckList& list) {
  const ClothDescription& cloth = recording.cloth;
  if (!cloth.mass_kg) return;
  const double density = *cloth.mass_kg / (cloth.width_m * cloth.height_m);
  const auto plausible = [](double value) {
    return value >= kPreflight.least_areal_density && value <= kPreflight.most_areal_density;
  };
  if (plausible(density))
    return list.pass("mass", fmt::format("{:.3g} kg on {:.3g} m2: {:.3g} kg/m2", *cloth.mass_kg,
                                         cloth.width_m * cloth.height_m, density));
  const char* remedy = plausible(1e-3 * density)  ? "is it in grams? give kilograms"
                       : plausible(1e6 * density) ? "is the size in millimetres? give metres"
                       : plausible(1e4 * density)
                           ? "is the size in centimetres? give metres"
                           : "weigh the dry cloth in kilograms, and measure it in metres";
  list.refuse("mass",
              fmt::format("mass {:.4g} on {:.4g} m2 is {:.3g} kg/m2", *cloth.mass_kg,
                          cloth.width_m * cloth.height_m, density),
              fmt::format("{:g} to {:g} kg/m2, as cloth has", kPreflight.least_areal_density,
                          kPreflight.most_areal_density),
              remedy);
}

void check_gravity_size(const Recording& recording, CheckList& list) {
  const double size = recording.gravity_m_per_s2.norm();
  if (size >= kPreflight.least_on_ground && size <= kPreflight.most_on_ground) return;
  const bool in_millimetres = size > 5e3 && size < 2e4, in_g = std::abs(size - 1) < 0.02;
  const char* remedy = in_millimetres ? "is it in mm/s2?" : in_g ? "is it in units of g?" : "";
  const std::string found = fmt::format("gravity is {:.4g} m/s2", size);
  const std::string expected = "9.81 m/s2 on the ground";
  // Less weight is possible, on a slope or elsewhere; much more is not.
  if (size > kPreflight.most_gravity || in_g)
    list.refuse("gravity", found, expected, remedy);
  else
    list.warn("gravity", found, expected, "give [0, 0, -9.81], or what it is");
}

void check_intervals(const Recording& recording, CheckList& list) {
  std::vector<double> intervals_s;
  for (size_t f = 1; f < recording.times_s.size(); ++f)
    intervals_s.push_back(recording.times_s[f] - recording.times_s[f - 1]);
  if (recording.frame_rate_hz) intervals_s.push_back(1 / *recording.frame_rate_hz);
  if (intervals_s.empty()) return;
  const double usual_s = median(intervals_s);
  const std::string source = recording.frame_rate_hz ? "frame_rate" : "the times";
  if (usual_s > kPreflight.longest_interval)
    return list.refuse("time", fmt::format("by {}, frames are {:.4g} s apart", source, usual_s),
                       fmt::format("at most {:g} s, for moving cloth", kPreflight.longest_interval),
                       recording.frame_rate_hz
                           ? "frame_rate is in frames per second, not the interval"
                           : "are the times in milliseconds, or numbers of frames?");
  if (usual_s > kPreflight.slow_interval)
    list.warn("time", fmt::format("by {}, frames are {:.4g} s apart", source, usual_s),
              fmt::format("less than {:g} s, in which cloth swings", kPreflight.slow_interval),
              "are they numbers of frames, or milliseconds?");
  if (usual_s < kPreflight.shortest_interval)
    list.warn("time", fmt::format("by {}, frames are {:.3g} s apart", source, usual_s),
              fmt::format("more than {:g} s", kPreflight.shortest_interval),
              "times are in seconds, a frame rate in frames per second");
}

void check_cells(const Recording& recording, CheckList& list) {
  const ClothDescription& cloth = recording.cloth;
  const double along_s_m = cloth.width_m / (cloth.mesh_columns - 1),
               along_t_m = cloth.height_m / (cloth.mesh_rows - 1);
  const double ratio = std::max(along_s_m / along_t_m, along_t_m / along_s_m);
  if (ratio <= kPreflight.cells_alike) return;
  const double exchanged =
      (cloth.width_m / (cloth.mesh_rows - 1)) / (cloth.height_m / (cloth.mesh_columns - 1));
  const bool fits_exchanged = std::max(exchanged, 1 / exchanged) < 0.5 * ratio;
  list.warn(
      "mesh",
      fmt::format("cells of the mesh are {:.3g} by {:.3g} mm", 1e3 * along_s_m, 1e3 * along_t_m),
      "cells about as wide as high",
      fits_exchanged ? "columns run along s (the width), rows along t: are they exchanged?" : "");
}

void check_parameters(const Recording& recording, CheckList& list) {
  for (const DeclaredEffect& declared : recording.declared) {
    const std::string where =
        declared.line > 0 ? fmt::format("{}:{}", list.file(), declared.line) : list.file();
    require_effect(declared.name, where);
    const EffectDescription effect = describe_effect(declared.name);
    for (const EffectParameter& parameter : effect.parameters) {
      const auto given = declared.parameters.find(parameter.name);
      if (given == declared.parameters.end() || given->second.size() != 1 || parameter.picks)
        continue;
      const double value = given->second.front();
      if (value >= parameter.lower && value <= parameter.upper) continue;
      list.add("effects", FindingState::warning, where,
               fmt::format("{}.{} = {:g} {}", declared.name, parameter.name, value, parameter.unit),
               fmt::format("{:g} to {:g} {}, where a fit would look", parameter.lower,
                           parameter.upper, parameter.unit),
               "look at the unit");
    }
  }
}

}  // namespace

bool moves_by_effects(const Recording& recording) {
  return std::ranges::any_of(recording.declared, [](const DeclaredEffect& effect) {
    return measurement_effect_named(effect.name) == nullptr;
  });
}

void check_declarations(const Recording& recording, CheckList& list) {
  check_mass(recording, list);
  check_gravity_size(recording, list);
  check_intervals(recording, list);
  check_cells(recording, list);
  check_parameters(recording, list);
}

}  // namespace clothfit
