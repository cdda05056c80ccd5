#include "fit/diagnosis/law_score.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>

#include "fit/measurement_effects/applicability.h"
#include "fit/measurement_effects/registry.h"
#include "fit/prior_cost.h"
#include "fit/uncertainty.h"

namespace clothfit {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// Laws that are tested in one run: a problem that has each of them once more, at its neutral
/// values, so that the run stays as it is and only its derivatives are more.
class Bundle {
 public:
  explicit Bundle(const ModelFit& model) : problem_(*model.problem), values_(model.values) {
    for (const FitProblem::MeasurementTerm& term : problem_.measurement)
      for (const Binding& binding : term.parameters) of_measurement_ += binding.parameter >= 0;
  }

  /// Whether so many more amplitudes go with those there are: of motion as many as are
  /// differentiated side by side, of the measurement as many as a predictor knows.
  bool has_room(const Term& term) const {
    const auto more = static_cast<int>(term.amplitudes.size());
    return of_motion_ + more <= kLanes && of_measurement_ + more <= kMeasurementParameters;
  }

  /// Nothing is added where the effect does not go with the recording.
  bool add(size_t test, const Term& term) {
    const EffectDescription effect = describe_effect(term.effect);
    const MeasurementEffectEntry* entry = measurement_effect_named(term.effect);
    const std::shared_ptr<const MeasurementEffect> measurement = entry ? entry->make() : nullptr;
    if (measurement && why_inapplicable(*measurement, problem_)) return false;
    std::vector<Binding> bindings;
    std::vector<int> coordinates;
    for (const EffectParameter& parameter : effect.parameters) {
      Binding binding{.parameter = -1, .constant = parameter.neutral};
      if (const auto shape = term.shape.find(parameter.name); shape != term.shape.end())
        binding.constant = shape->second;
      if (std::ranges::find(term.amplitudes, parameter.name) != term.amplitudes.end()) {
        binding.parameter = problem_.space.size();
        coordinates.push_back(binding.parameter);
        problem_.space.parameters.push_back(
            {.name = fmt::format("{}.{} {}", term.effect, parameter.name, test),
             .unit = parameter.unit,
             .role = measurement ? ParameterRole::measurement : ParameterRole::effect,
             .scale = parameter.scale,
             .lower = parameter.lower,
             .upper = parameter.upper,
             .start = parameter.neutral,
             .typical = parameter.typical});
        values_.conservativeResize(values_.size() + 1);
        values_[values_.size() - 1] = parameter.neutral;
      }
      bindings.push_back(binding);
    }
    if (measurement) {
      problem_.measurement.push_back(
          {.effect = measurement, .description = effect, .parameters = std::move(bindings)});
      of_measurement_ += static_cast<int>(coordinates.size());
      add_slope_weights(problem_);
    } else {
      problem_.cloth.add_effect(term.effect, term.effect);
      problem_.effects.push_back(std::move(bindings));
      of_motion_ += static_cast<int>(coordinates.size());
    }
    tests_.push_back({.index = test, .term = &term, .coordinates = std::move(coordinates)});
    return true;
  }

  /// The score of each law, into its place among all.
  void score(const ModelFit& model, const Projection& projection,
             std::vector<LawScore>& scores) const {
    std::vector<int> all;
    for (const Test& test : tests_)
      all.insert(all.end(), test.coordinates.begin(), test.coordinates.end());
    const TrajectoryObjective objective(problem_, model.frames, model.steps);
    const Linearisation linear = objective.linearise_by(values_, all);
    if (!linear.usable) return;
    const ParameterSpace& space = problem_.space;
    Eigen::VectorXd lower(values_.size()), upper(values_.size());
    for (int p = 0; p < space.size(); ++p) {
      lower[p] = space.parameters[static_cast<size_t>(p)].lower;
      upper[p] = space.parameters[static_cast<size_t>(p)].upper;
    }
    const Eigen::VectorXd here = space.coordinates(values_);
    const Eigen::VectorXd down = space.coordinates(lower) - here;
    const Eigen::VectorXd up = space.coordinates(upper) - here;
    const Eigen::VectorXd slope = space.value_by_coordinate(values_);
    Eigen::Index first = 0;
    for (const Test& test : tests_) {
      const auto count = static_cast<Eigen::Index>(test.coordinates.size());
      const Eigen::MatrixXd columns = linear.residual_by_coordinate.middleCols(first, count);
      first += count;
      scores[test.index] = judge(*test.term, projection, columns, down(test.coordinates),
                                 up(test.coordinates), slope(test.coordinates));
    }
  }

 private:
  struct Test {
    size_t index = 0;
    const Term* term = nullptr;
    std::vector<int> coordinates;
  };

  static LawScore judge(const Term& term, const Projection& projection,
                        const Eigen::MatrixXd& columns, const Eigen::VectorXd& down,
                        const Eigen::VectorXd& up, const Eigen::VectorXd& slope) {
    LawScore result{.term = term, .amount = {}, .sigma = {}};
    const Explained explained =
        explain(projection.residual(), projection.columns(columns), down, up);
    result.amount = explained.amount.cwiseProduct(slope);
    result.fall = explained.fall;
    result.sigma = Eigen::VectorXd::Constant(slope.size(), kInfinite);
    const Eigen::LDLT<Eigen::MatrixXd> information(explained.information);
    if (information.isPositive() && information.vectorD().minCoeff() > 0) {
      const Eigen::MatrixXd covariance =
          information.solve(Eigen::MatrixXd::Identity(slope.size(), slope.size()));
      result.sigma = covariance.diagonal().cwiseSqrt().cwiseProduct(slope);
    }
    return result;
  }

  FitProblem problem_;
  Eigen::VectorXd values_;
  int of_motion_ = 0, of_measurement_ = 0;
  std::vector<Test> tests_;
};

}  // namespace

Projection project(const DiagnosisSetup& setup, const ModelFit& model,
                   const Eigen::MatrixXd& unit_directions) {
  const TrajectoryObjective objective = model.objective();
  const Eigen::VectorXd& residual = model.linear.residual;
  const double threshold = setup.options.loss == Loss::huber
                               ? kHuberScales * std::max(1.0, robust_scale(residual))
                               : kInfinite;
  const PriorCost prior = prior_cost(*model.problem, model.values);
  return {model.linear.residual_by_coordinate,
          prior.information,
          prior.gradient,
          unit_directions,
          huber_weights(objective, residual, threshold),
          residual};
}

std::vector<LawScore> score_laws(const ModelFit& model, const Projection& projection,
                                 const std::vector<LawShapes>& laws,
                                 const ProgressCallback& progress) {
  std::vector<const Term*> tests;
  std::vector<size_t> law_of_test;
  for (size_t law = 0; law < laws.size(); ++law) {
    for (const Term& term : laws[law]) {
      tests.push_back(&term);
      law_of_test.push_back(law);
    }
  }
  // Effects of motion and of the measurement apart: only the former cost derivatives of runs.
  std::vector<Bundle> bundles;
  for (const bool of_measurement : {false, true}) {
    std::vector<Bundle> own;
    for (size_t n = 0; n < tests.size(); ++n) {
      if ((measurement_effect_named(tests[n]->effect) != nullptr) != of_measurement) continue;
      if (own.empty() || !own.back().has_room(*tests[n])) own.emplace_back(model);
      if (!own.back().has_room(*tests[n])) continue;  // the model has too many of its own
      own.back().add(n, *tests[n]);
    }
    std::ranges::move(own, std::back_inserter(bundles));
  }

  std::vector<LawScore> scores(tests.size());
  std::mutex one_at_a_time;
  int done = 0;
  std::atomic<bool> cancelled = false;
  tbb::parallel_for(size_t{0}, bundles.size(), [&](size_t n) {
    if (cancelled) return;
    bundles[n].score(model, projection, scores);
    const std::scoped_lock lock(one_at_a_time);
    ++done;
    if (progress && !progress({.stage = "scoring laws",
                               .done = static_cast<double>(done),
                               .total = static_cast<double>(bundles.size()),
                               .unit = "runs",
                               .note = ""}))
      cancelled = true;
  });
  if (cancelled) return {};

  const double above =
      projection.residual().squaredNorm() - (projection.weights() - projection.taken());
  std::vector<LawScore> best;
  std::vector<size_t> law_of_best;
  for (size_t n = 0; n < tests.size(); ++n) {
    if (scores[n].amount.size() == 0) continue;
    if (best.empty() || law_of_best.back() != law_of_test[n]) {
      best.push_back(std::move(scores[n]));
      law_of_best.push_back(law_of_test[n]);
    } else if (scores[n].fall > best.back().fall) {
      best.back() = std::move(scores[n]);
    }
  }
  for (LawScore& law : best) law.share = above > 0 ? law.fall / above : 0;
  return best;
}

}  // namespace clothfit
