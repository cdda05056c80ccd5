#include "fit/diagnosis/score.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "data/algebra/dense_factors.h"
#include "fit/jobs/stop_token.h"
#include "fit/problem/effects_of.h"

namespace clothfit {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// Hypotheses that are differentiated at once: as many as keep all cores at work.
constexpr size_t kAtOnce = 64;

/// Tells whether a model has an amplitude of the hypothesis by another mode of its effect. All held
/// points alike and single ones are such modes. An effect has one number for both.
bool is_taken(const Hypothesis& hypothesis, const std::vector<Hypothesis>& model) {
  return std::ranges::any_of(model, [&](const Hypothesis& own) {
    return own.effect == hypothesis.effect && own.mode != hypothesis.mode &&
           std::ranges::find_first_of(own.amplitudes, hypothesis.amplitudes) !=
               own.amplitudes.end();
  });
}

Score judge(const Hypothesis& hypothesis, const ModelProjection& projection, Columns columns) {
  const EffectDescription effect = describe_effect(hypothesis.effect);
  const Eigen::Index count = columns.front().cols();
  const auto each = static_cast<Eigen::Index>(hypothesis.amplitudes.size());
  Eigen::VectorXd down(count), up(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const auto parameter =
        std::ranges::find(effect.parameters, hypothesis.amplitudes[static_cast<size_t>(k % each)],
                          &EffectParameter::name);
    down[k] = parameter->lower - parameter->neutral;
    up[k] = parameter->upper - parameter->neutral;
  }
  const Explained explained = explain(projection.residual(), projection.columns(columns), down, up);
  Score result{.hypothesis = hypothesis,
               .amplitude = explained.amplitude,
               .sigma = Eigen::VectorXd::Constant(count, kInfinite),
               .decrease = explained.decrease,
               .columns = std::move(columns)};
  // Amplitudes come in units of their own.
  const Eigen::VectorXd size = explained.information.diagonal().cwiseSqrt();
  if (size.minCoeff() > 0) {
    const Eigen::VectorXd unit = size.cwiseInverse();
    const SymmetricFactors information(
        Eigen::MatrixXd(unit.asDiagonal() * explained.information * unit.asDiagonal()));
    if (information.is_positive_definite())
      result.sigma = information.solve(Eigen::MatrixXd::Identity(count, count))
                         .diagonal()
                         .cwiseSqrt()
                         .cwiseProduct(unit);
  }
  return result;
}

}  // namespace

std::string Score::amplitude_name(Eigen::Index k) const {
  const auto each = static_cast<Eigen::Index>(hypothesis.amplitudes.size());
  const std::string& name = hypothesis.amplitudes[static_cast<size_t>(k % each)];
  return amplitude.size() > each ? name + " (recording " + std::to_string(k / each + 1) + ")"
                                 : name;
}

std::vector<Score> score_hypotheses(const FittedModel& model, const ModelProjection& projection,
                                    const std::vector<ShapeCandidates>& hypotheses,
                                    const ProgressCallback& progress) {
  std::vector<Hypothesis> tests;
  std::vector<size_t> mode_of_test;
  for (size_t mode = 0; mode < hypotheses.size(); ++mode) {
    for (const Hypothesis& hypothesis : hypotheses[mode]) {
      if (is_taken(hypothesis, model.hypotheses)) continue;
      tests.push_back(hypothesis);
      mode_of_test.push_back(mode);
    }
  }
  const double free = std::max(1.0, projection.weights() - projection.taken());
  // An excess below chi-square's own standard deviation is not known to be there.
  const double above = std::max(projection.residual().squaredNorm() - free, std::sqrt(2 * free));
  std::vector<Score> best;
  size_t mode_of_best = 0;
  for (size_t first = 0; first < tests.size(); first += kAtOnce) {
    report_progress(progress, {.stage = "scoring modes",
                               .done = static_cast<double>(first),
                               .total = static_cast<double>(tests.size()),
                               .unit = "modes",
                               .note = ""});
    const std::span<const Hypothesis> some =
        std::span(tests).subspan(first, std::min(kAtOnce, tests.size() - first));
    std::vector<Columns> columns = hypothesis_derivatives(model, some);
    for (size_t k = 0; k < some.size(); ++k) {
      if (columns[k].empty()) continue;
      Score score = judge(some[k], projection, std::move(columns[k]));
      score.share = score.decrease / above;
      const size_t mode = mode_of_test[first + k];
      if (best.empty() || mode_of_best != mode)
        best.push_back(std::move(score));
      else if (score.decrease > best.back().decrease)
        best.back() = std::move(score);
      mode_of_best = mode;
    }
  }
  return best;
}

}  // namespace clothfit
