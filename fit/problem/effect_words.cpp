#include "fit/problem/effect_words.h"

#include "data/median.h"
#include "fit/problem/cloth_setup.h"
#include "fit/problem/effects_of.h"

namespace clothfit {
namespace {

/// Adds a held point's place; of an edge, that of each of its vertices, as the cloth has them.
void add_places(const HeldPoint& point, const Mesh& mesh,
                std::vector<FittedEffect::HeldPlace>& places) {
  if (!point.edge) {
    places.push_back({.at_m = point.at_m, .driven = point.motion != HeldMotion::fixed});
    return;
  }
  const bool along_s = point.edge == ClothEdge::top || point.edge == ClothEdge::bottom;
  const bool far = point.edge == ClothEdge::bottom || point.edge == ClothEdge::right;
  for (int n = 0; n < (along_s ? mesh.columns : mesh.rows); ++n)
    places.push_back(
        {.at_m = along_s ? Eigen::Vector2d(n * mesh.spacing_s_m(), far ? mesh.height_m : 0.0)
                         : Eigen::Vector2d(far ? mesh.width_m : 0.0, n * mesh.spacing_t_m())});
}

/// Returns the values of all parameters of an effect, whether they were fitted or given.
std::map<std::string, double> values_of(const EffectDescription& effect, const FitResult& result) {
  std::map<std::string, double> values;
  for (const EffectParameter& parameter : effect.parameters)
    values[parameter.name] = parameter.neutral;
  for (const EffectEstimate& estimate : result.effects)
    if (estimate.name == effect.name)
      for (const ParameterEstimate& parameter : estimate.parameters)
        values[parameter.name] = parameter.value;
  for (const ParameterEstimate& parameter : result.nuisance)
    if (parameter.name.starts_with(effect.name + "."))
      values[parameter.name.substr(effect.name.size() + 1)] = parameter.value;
  return values;
}

}  // namespace

FittedEffect fitted_effect(const Hypothesis& hypothesis, const FitReport& report) {
  const ModelDescription& model = report.model;
  const Mesh mesh{model.mesh_columns, model.mesh_rows, model.cloth.width_m, model.cloth.height_m};
  FittedEffect found{
      .mode = hypothesis.mode,
      .values = values_of(describe_effect(hypothesis.effect), report.result),
      .mesh = mesh,
      .mass_kg = make_cloth(model.cloth, mesh, model.cloth.mass_kg.value_or(0)).mass_kg,
      .gravity_m_per_s2 = model.gravity_m_per_s2};
  for (const ModelHeldPoint& held : model.held) add_places(held.point, mesh, found.held);
  std::vector<double> interval_s;
  for (size_t f = 1; f < model.frame_time_s.size(); ++f)
    interval_s.push_back(model.frame_time_s[f] - model.frame_time_s[f - 1]);
  if (interval_s.empty()) return found;
  found.begin_s = model.frame_time_s.front();
  found.end_s = model.frame_time_s.back();
  found.frame_interval_s = median(interval_s);
  return found;
}

std::string words_of(const Hypothesis& hypothesis, const FitReport& report) {
  const auto in_words = describe_effect(hypothesis.effect).in_words;
  if (in_words == nullptr || report.model.mesh_columns == 0) return "";
  return in_words(fitted_effect(hypothesis, report));
}

}  // namespace clothfit
