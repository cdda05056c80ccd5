#include "fit/diagnosis/trial.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "fit/diagnosis/adequacy.h"
#include "fit/diagnosis/clearance.h"
#include "fit/diagnosis/criteria.h"
#include "fit/diagnosis/search_context.h"
#include "fit/diagnosis/worth.h"
#include "fit/problem/effects_of.h"

namespace clothfit {
namespace {

/// The criterion by which a trial ends as a trace.
constexpr const char* kMatters = "matters";

class Asked {
 public:
  Asked(const SearchContext& search, const Compared& models) : search_(search), models_(models) {
    trial_.hypothesis = models.score.hypothesis;
    trial_.predicted_decrease = models.score.decrease;
  }

  Trial run() {
    if (!ask({"fitted", Trial::kNotAsked, Trial::kNotAsked, models_.with.usable(),
              "others leave far less, or no fit worked out"}))
      return trial_;
    trial_.hypothesis = models_.with.hypotheses.back();
    trial_.decrease =
        models_.without.chi_square(search_.threshold) - models_.with.chi_square(search_.threshold);
    if (!ask(keeps_its_promise()) || !ask(is_worth_a_name())) return trial_;

    measure_left_out();
    if (!ask(predicts_better())) return trial_;
    measure_clearance();
    if (!ask(is_clear_of_neutral()) || !ask(matters()) || !ask(beats_free_forces())) return trial_;
    if (!ask(beats_corrections())) trial_.on_credit = takes_good_part();
    return trial_;
  }

 private:
  bool ask(Criterion criterion) {
    trial_.criteria.push_back(std::move(criterion));
    return trial_.criteria.back().passed;
  }

  /// Returns how many numbers the data chose. The place of an obstacle comes from them alone.
  Eigen::Index numbers_chosen() const {
    return describe_effect(trial_.hypothesis.effect).touches
               ? static_cast<Eigen::Index>(trial_.hypothesis.number_count())
               : models_.score.amplitude.size();
  }

  Criterion keeps_its_promise() const {
    const double least =
        std::max(least_decrease(numbers_chosen()),
                 models_.scored_elsewhere ? 0 : kCriteria.predicted_share * models_.score.decrease);
    return {"decrease", trial_.decrease, least, !(trial_.decrease < least),
            "the fit gains less than half of what was predicted"};
  }

  Criterion is_worth_a_name() const {
    const double worth = search_.worth(models_.without);
    return {"worth_naming", trial_.decrease, worth, !(trial_.decrease < worth),
            "it takes too little of what is above the noise"};
  }

  void measure_left_out() {
    left_out_ = left_out_of(search_, models_.with);
    trial_.cross_validated = left_out_.mean;
    trial_.without_it = models_.without_left_out.mean;
    trial_.best_trivial =
        std::min(without_physics(models_.without_left_out), models_.without_left_out.free_forces);
  }

  /// It takes runs by the dozen.
  void measure_clearance() {
    const Adequacy structure = judge_adequacy(models_.with, search_.setup.options.loss);
    trial_.clear_of_neutral = describe_effect(trial_.hypothesis.effect).touches
                                  ? clear_by(trial_.decrease, numbers_chosen(), structure)
                                  : clear_of_neutral(models_.with, structure, search_.threshold);
  }

  Criterion predicts_better() const {
    return {"left_out", left_out_.mean, models_.without_left_out.mean,
            left_out_.usable && left_out_.mean < models_.without_left_out.mean,
            "frames that were left out are predicted no better"};
  }

  Criterion is_clear_of_neutral() const {
    const double clear = trial_.clear_of_neutral;
    return {"clear_of_neutral", clear, kCriteria.clear_of_neutral,
            !(clear < kCriteria.clear_of_neutral) ||
                (clear > 0 && takes_good_part() && is_sure_by_blocks()),
            "not clear of its neutral value"};
  }

  /// What a model errs by in an effect that it has looks like a small further one.
  Criterion matters() const {
    double accepted = 0;
    for (const Hypothesis& before : models_.without.hypotheses)
      accepted = std::max(accepted, change_of_prediction(models_.without, before));
    const double least = std::max(kCriteria.trace, kCriteria.trace_of_accepted * accepted);
    const double change = change_of_prediction(models_.with, models_.with.hypotheses.back());
    return {kMatters, change, least, !(change < least),
            "a trace: it changes the prediction by little beside the noise or what was found"};
  }

  Criterion beats_free_forces() const {
    const double forces = models_.without_left_out.free_forces;
    return {"free_forces", left_out_.mean, forces, left_out_.mean < forces || helps_free_forces(),
            "free forces do as well, and no better beside it"};
  }

  Criterion beats_corrections() const {
    const double trivial = without_physics(models_.without_left_out);
    return {"corrections", left_out_.mean, trivial, left_out_.mean < trivial,
            "a correction without physics does as well"};
  }

  /// Tells whether it takes much of what the model leaves of blocks left out, above the noise.
  bool takes_good_part() const {
    const double without = models_.without_left_out.mean;
    return without - left_out_.mean > kCriteria.good_part * (without - 1);
  }

  /// Tells whether a hypothesis is sure without sigmas, because it predicts no block left out
  /// worse. Sigmas say little where a model is far off, for they are those of all that it lacks.
  bool is_sure_by_blocks() const {
    const auto count = static_cast<double>(models_.without.residual_count());
    return models_.without.chi_square(search_.threshold) > kCriteria.far_off * count &&
           models_.without_left_out.mean > kCriteria.far_off &&
           left_out_.block.size() >= static_cast<size_t>(kCriteria.time_blocks) &&
           std::ranges::equal(left_out_.block, models_.without_left_out.block, std::less_equal<>());
  }

  /// Tells whether it takes something from what free forces leave. Free forces take much of all
  /// that is missing, and each of several causes alone leaves more than they do.
  bool helps_free_forces() const {
    const double without = models_.without_left_out.free_forces;
    const double gain = without - left_out_of(search_, models_.with, &search_.coarse).free_forces;
    return gain > kCriteria.free_forces_gain * std::max(0.0, without - 1);
  }

  const SearchContext& search_;
  const Compared& models_;
  Trial trial_;
  CrossValidation left_out_;
};

}  // namespace

double change_of_prediction(const FittedModel& model, const Hypothesis& hypothesis) {
  const EffectDescription effect = describe_effect(hypothesis.effect);
  double square = 0;
  for (size_t n = 0; n < model.parts.size(); ++n) {
    const PooledPart& part = model.parts[n];
    Eigen::VectorXd neutral = part.values;
    for (const std::string& name : hypothesis.amplitudes) {
      const int p = model.problems[n]->space.index(hypothesis.effect + "." + name);
      if (p < 0) continue;
      neutral[p] = std::ranges::find(effect.parameters, name, &EffectParameter::name)->neutral;
    }
    const Eigen::VectorXd without = model.objective(n).residuals({neutral}).front();
    // A run that diverges without the effect is changed by it, however much.
    if (without.size() != part.linear.residual.size())
      return std::numeric_limits<double>::infinity();
    square += (without - part.linear.residual).squaredNorm();
  }
  return std::sqrt(square / static_cast<double>(model.residual_count()));
}

bool Trial::is_trace() const {
  const auto failed = std::ranges::find(criteria, false, &Criterion::passed);
  return failed != criteria.end() && failed->name == kMatters;
}

bool Trial::passed() const {
  return std::ranges::all_of(criteria, &Criterion::passed);
}

std::string Trial::refusal() const {
  const auto failed = std::ranges::find(criteria, false, &Criterion::passed);
  return failed == criteria.end() ? "" : failed->refusal;
}

Trial try_hypothesis(const SearchContext& search, const Compared& models) {
  return Asked(search, models).run();
}

CrossValidation left_out_of(const SearchContext& search, const FittedModel& model,
                            const DiagnosisSetup* forces_mesh) {
  // A recording left out says most where there are enough others.
  const bool whole = static_cast<double>(model.parts.size()) >= kCriteria.whole_recordings;
  return cross_validate(search.setup, model, static_cast<int>(kCriteria.time_blocks),
                        search.threshold, whole, forces_mesh);
}

double without_physics(const CrossValidation& of) {
  return std::min(of.constant_offset, of.last_residual);
}

}  // namespace clothfit
