#include "fit/diagnosis/hypothesis_derivatives.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <tuple>

#include "data/algebra/dense_factors.h"
#include "data/parallel.h"
#include "fit/diagnosis/catalogue.h"
#include "fit/measurement_effects/applicability.h"
#include "fit/measurement_effects/registry.h"
#include "fit/problem/effects_of.h"
#include "model/effects/registry.h"

namespace clothfit {
namespace {

/// Hypotheses differentiated in one run. Each is at its neutral values, so that the run stays as it
/// is.
struct Batch {
  FitProblem problem;
  Eigen::VectorXd values;
  struct Member {
    size_t index = 0;
    std::vector<int> coordinates;
  };
  std::vector<Member> members;
  int amplitudes = 0;
};

/// A change of a motion effect's parameter, as a share of its typical change. It is small enough to
/// be a derivative, and large enough that rounding does not count.
constexpr double kSmall = 1e-5;

void add(Batch& batch, size_t index, const Hypothesis& hypothesis) {
  const EffectDescription effect = describe_effect(hypothesis.effect);
  const MeasurementEffectEntry* entry = measurement_effect_named(hypothesis.effect);
  Batch::Member added{.index = index, .coordinates = {}};
  std::vector<Binding> bindings;
  std::vector<double> neutral;
  for (const EffectParameter& parameter : effect.parameters) {
    Binding binding{.parameter = -1, .constant = parameter.neutral};
    if (const auto shape = hypothesis.shape.find(parameter.name); shape != hypothesis.shape.end())
      binding.constant = shape->second;
    if (const auto one = hypothesis.picked.find(parameter.name); one != hypothesis.picked.end())
      binding.constant = one->second;
    if (std::ranges::find(hypothesis.amplitudes, parameter.name) != hypothesis.amplitudes.end()) {
      binding.parameter = batch.problem.space.size();
      added.coordinates.push_back(binding.parameter);
      batch.problem.space.parameters.push_back(
          {.name = hypothesis.effect + "." + parameter.name + " " + std::to_string(index),
           .unit = parameter.unit,
           .role = entry ? ParameterRole::measurement : ParameterRole::effect,
           .scale = parameter.scale,
           .lower = parameter.lower,
           .upper = parameter.upper,
           .start = parameter.neutral,
           .typical = parameter.typical});
      batch.values.conservativeResize(batch.values.size() + 1);
      batch.values[batch.values.size() - 1] = parameter.neutral;
    }
    neutral.push_back(binding.constant);
    bindings.push_back(binding);
  }
  if (entry) {
    batch.problem.measurement.push_back(
        {.effect = entry->make(), .description = effect, .parameters = std::move(bindings)});
    add_derivative_weights(batch.problem);
  } else {
    const std::shared_ptr<const Effect> made =
        find_effect(hypothesis.effect, hypothesis.effect).make();
    for (size_t k = 0; k < bindings.size(); ++k) {
      if (bindings[k].parameter < 0) continue;
      FitProblem::EmergingTerm term{.parameter = bindings[k].parameter,
                                    .effect = made,
                                    .values = neutral,
                                    .change = kSmall * effect.parameters[k].typical};
      term.values[k] += term.change;
      batch.problem.emerging.push_back(std::move(term));
    }
  }
  batch.amplitudes += static_cast<int>(added.coordinates.size());
  batch.members.push_back(std::move(added));
}

/// Amplitudes of motion effects that share a run. The simulation and what its effects are
/// linearised for are paid once.
constexpr int kMotionAmplitudes = 8 * kLanes;

/// Differentiates one recording's residuals.
std::vector<Eigen::MatrixXd> derivatives_in(const FitProblem& problem, const PooledPart& part,
                                            std::span<const Hypothesis> hypotheses) {
  int measured = 0;
  for (const FitProblem::MeasurementTerm& term : problem.measurement)
    for (const Binding& binding : term.parameters) measured += binding.parameter >= 0 ? 1 : 0;
  std::vector<Batch> batches;
  // Effects that only add forces cost least. Those of the measurement need no derivatives of runs.
  enum class Kind { adds_forces, changes_runs, measures };
  const auto kind_of = [](const Hypothesis& hypothesis) {
    if (measurement_effect_named(hypothesis.effect) != nullptr) return Kind::measures;
    const std::unique_ptr<Effect> effect = find_effect(hypothesis.effect, hypothesis.effect).make();
    return effect->changes_force() || effect->shifts_supports() ? Kind::changes_runs
                                                                : Kind::adds_forces;
  };
  std::vector<Kind> kinds;
  for (const Hypothesis& hypothesis : hypotheses) kinds.push_back(kind_of(hypothesis));
  for (const Kind kind : {Kind::adds_forces, Kind::changes_runs, Kind::measures}) {
    const int most = kind == Kind::measures ? kMeasurementParameters - measured : kMotionAmplitudes;
    bool begun = false;
    for (size_t n = 0; n < hypotheses.size(); ++n) {
      if (kinds[n] != kind) continue;
      const MeasurementEffectEntry* entry = measurement_effect_named(hypotheses[n].effect);
      if (entry && why_inapplicable(*entry->make(), measurement_setting(problem))) continue;
      const auto more = static_cast<int>(hypotheses[n].amplitudes.size());
      if (more > most) continue;
      if (!begun || batches.back().amplitudes + more > most)
        batches.push_back({.problem = problem, .values = part.values, .members = {}});
      begun = true;
      add(batches.back(), n, hypotheses[n]);
    }
  }

  std::vector<Eigen::MatrixXd> result(hypotheses.size());
  for_each_index(batches.size(), [&](size_t b) {
    const Batch& batch = batches[b];
    std::vector<int> all;
    for (const Batch::Member& member : batch.members)
      all.insert(all.end(), member.coordinates.begin(), member.coordinates.end());
    const TrajectoryObjective objective(batch.problem, part.frames, part.steps);
    const Linearisation linear = objective.linearise_by(batch.values, all);
    if (!linear.usable) return;
    const Eigen::VectorXd slope = batch.problem.space.value_by_coordinate(batch.values);
    Eigen::Index first = 0;
    for (const Batch::Member& member : batch.members) {
      const auto count = static_cast<Eigen::Index>(member.coordinates.size());
      result[member.index] = linear.residual_by_coordinate.middleCols(first, count) *
                             slope(member.coordinates).cwiseInverse().asDiagonal();
      first += count;
    }
  });
  return result;
}

/// Differentiates by each hypothesis by itself.
std::vector<Columns> derivatives_of_each(const FittedModel& model,
                                         std::span<const Hypothesis> hypotheses) {
  const size_t recordings = model.parts.size();
  std::vector<std::vector<Eigen::MatrixXd>> of_recording(recordings);
  for_each_index(recordings, [&](size_t n) {
    of_recording[n] = derivatives_in(*model.problems[n], model.parts[n], hypotheses);
  });
  std::vector<Columns> result(hypotheses.size());
  for (size_t k = 0; k < hypotheses.size(); ++k) {
    if (std::ranges::any_of(of_recording, [&](const auto& of) { return of[k].cols() == 0; }))
      continue;
    const bool own = measurement_effect_named(hypotheses[k].effect) != nullptr;
    const Eigen::Index each = of_recording.front()[k].cols();
    for (size_t n = 0; n < recordings; ++n) {
      Eigen::MatrixXd& of = of_recording[n][k];
      if (own && recordings > 1) {
        Eigen::MatrixXd wide =
            Eigen::MatrixXd::Zero(of.rows(), each * static_cast<Eigen::Index>(recordings));
        wide.middleCols(each * static_cast<Eigen::Index>(n), each) = of;
        of = std::move(wide);
      }
      result[k].push_back(std::move(of));
    }
  }
  return result;
}

}  // namespace

std::vector<Columns> hypothesis_derivatives(const FittedModel& model,
                                            std::span<const Hypothesis> hypotheses) {
  // Derivatives of a harmonic at any phase are combinations of those at two.
  constexpr size_t kPhases = 2;
  using Key = std::tuple<std::string, std::string, std::map<std::string, int>, double>;
  std::map<Key, std::vector<size_t>> harmonics;
  for (size_t k = 0; k < hypotheses.size(); ++k)
    if (is_harmonic(hypotheses[k]))
      harmonics[{hypotheses[k].effect, hypotheses[k].mode, hypotheses[k].picked,
                 hypotheses[k].shape.at("frequency")}]
          .push_back(k);
  std::erase_if(harmonics, [](const auto& known) { return known.second.size() <= kPhases; });

  std::vector<bool> combined(hypotheses.size(), false);
  std::vector<Hypothesis> each;
  for (const auto& [key, phases] : harmonics) {
    for (const size_t k : phases) combined[k] = true;
    for (const double phase : {0.0, 0.25}) {
      each.push_back(hypotheses[phases.front()]);
      each.back().shape["phase"] = phase;
    }
  }
  for (size_t k = 0; k < hypotheses.size(); ++k)
    if (!combined[k]) each.push_back(hypotheses[k]);

  std::vector<Columns> found = derivatives_of_each(model, each), result(hypotheses.size());
  size_t next = 0;
  for (const auto& [key, phases] : harmonics) {
    const Columns &in_phase = found[next], &quarter_on = found[next + 1];
    next += kPhases;
    if (in_phase.empty() || quarter_on.empty()) continue;
    for (const size_t k : phases) {
      const double angle = 2 * std::numbers::pi * hypotheses[k].shape.at("phase");
      for (size_t n = 0; n < in_phase.size(); ++n)
        result[k].push_back(std::cos(angle) * in_phase[n] + std::sin(angle) * quarter_on[n]);
    }
  }
  for (size_t k = 0; k < hypotheses.size(); ++k)
    if (!combined[k]) result[k] = std::move(found[next++]);
  return result;
}

double squared_multiple_correlation(const Eigen::VectorXd& of, const Eigen::MatrixXd& columns) {
  const double all = of.squaredNorm();
  if (columns.cols() == 0 || all == 0) return 0;
  // Columns are scaled to one, for hypotheses come in units of their own.
  Eigen::MatrixXd scaled = columns;
  for (Eigen::Index k = 0; k < scaled.cols(); ++k)
    if (const double norm = scaled.col(k).norm(); norm > 0) scaled.col(k) /= norm;
  const PivotedQr qr(scaled);
  const Eigen::VectorXd turned = qr.times_q_transposed(of);
  return std::min(1.0, turned.head(qr.rank()).squaredNorm() / all);
}

}  // namespace clothfit
