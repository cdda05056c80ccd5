#include "fit/diagnosis/refit.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <numeric>

#include "fit/diagnosis/discretisation.h"
#include "fit/diagnosis/horizons.h"
#include "fit/fit.h"

namespace clothfit {
namespace {

/// Of the fall that was foreseen; less than that asks for another way to the optimum,
constexpr double kKeptPromise = 0.8;
/// unless hardly more than noise is left: chi-square per residual.
constexpr double kHardlyMore = 1.1;

/// A share of the frames over which most of what is missing has shown, and little has grown.
constexpr double kShortHorizon = 0.4;

/// A start at half of what a linear model foresees is on the right side, and not too far.
constexpr double kCautious = 0.5;

/// The model with a law more at a share of what its score foresees. Not linearised.
ModelFit cautious_start(const DiagnosisSetup& setup, const ModelFit& model, const LawScore& score) {
  std::vector<Term> terms = model.terms;
  terms.push_back(score.term);
  std::vector<NamedValues> start = model.values();
  const EffectDescription effect = describe_effect(score.term.effect);
  const size_t each = score.term.amplitudes.size();
  for (size_t n = 0; n < start.size(); ++n) {
    for (size_t k = 0; k < each; ++k) {
      const std::string& name = score.term.amplitudes[k];
      const auto own = static_cast<size_t>(score.amount.size()) > each ? n * each + k : k;
      start[n][score.term.effect + "." + name] =
          std::ranges::find(effect.parameters, name, &EffectParameter::name)->neutral +
          kCautious * score.amount[static_cast<Eigen::Index>(own)];
    }
  }
  return model_at(setup, terms, start);
}

/// Moves a model, whose frames are all, to its optimum over a share of them; the model over these.
/// Over all of them its own discretisation may err as `from` does.
ModelFit refined_over(const DiagnosisSetup& setup, ModelFit& whole, const ModelFit& from,
                      double share, const ProgressCallback& progress) {
  ModelFit fitted = share < 1 ? shortened(whole, share) : whole;
  StageOptions stage;
  if (share < 1) {
    stage.rounds = 1;
    stage.least_fall = 0;
    for (size_t n = 0; n < fitted.parts.size(); ++n)
      stage.least_fall += kRough * fitted.objective(n).residual_count();
  }
  for (size_t n = 0; n < fitted.parts.size(); ++n) {
    PooledPart& part = fitted.parts[n];
    part.linear = {};
    if (share < 1) continue;
    part.correction = from.parts[n].correction;
    part.directions = from.parts[n].directions;
    part.amounts = from.parts[n].amounts;
  }
  refine_model(fitted, setup, stage, progress);
  for (size_t n = 0; fitted.usable && n < whole.parts.size(); ++n)
    whole.parts[n].values = fitted.parts[n].values;
  return fitted;
}

/// From where the model stands, over all frames.
ModelFit fit_from_here(const DiagnosisSetup& setup, const ModelFit& model, const LawScore& score,
                       const StageOptions& stage, const ProgressCallback& progress) {
  std::vector<Term> terms = model.terms;
  terms.push_back(score.term);
  ModelFit fitted = with_terms(setup, model, terms, score.columns);
  refine_model(fitted, setup, stage, progress);
  return fitted;
}

/// A model fitted over a share of the frames, after the fit over the shorter one.
using FitOver = std::function<ModelFit(size_t model, double share, const ModelFit& shorter)>;

/// Models fitted side by side over growing horizons. Those that leave far more than the best one
/// fall out, and are not usable.
std::vector<ModelFit> race(size_t models, double first_share, double threshold,
                           const FitOver& fit_over) {
  // What is left above the noise: times the best one's, or times a share of the noise.
  constexpr double kFarMore = 10, kOfNoise = 0.2;
  std::vector<ModelFit> fitted(models);
  std::vector<size_t> running(models);
  std::iota(running.begin(), running.end(), size_t{0});
  for (const double share : shares_from(first_share)) {
    double least = std::numeric_limits<double>::infinity();
    tbb::parallel_for(size_t{0}, running.size(), [&](size_t n) {
      const size_t k = running[n];
      fitted[k] = fit_over(k, share, fitted[k]);
    });
    for (const size_t k : running) {
      if (fitted[k].cancelled) return fitted;
      if (fitted[k].usable) least = std::min(least, fitted[k].chi_square(threshold));
    }
    if (share == 1) break;
    std::erase_if(running, [&](size_t k) {
      if (!fitted[k].usable) return true;
      const auto count = static_cast<double>(fitted[k].residual_count());
      const double above = fitted[k].chi_square(threshold) - count;
      fitted[k].usable = above <= kFarMore * std::max(least - count, kOfNoise * count);
      return !fitted[k].usable;
    });
  }
  return fitted;
}

/// Laws beside a model, from where `early` stands.
std::vector<ModelFit> race_laws(const DiagnosisSetup& setup, const ModelFit& model,
                                const ModelFit& early, const std::vector<const LawScore*>& scores,
                                double first_share, double threshold,
                                const ProgressCallback& progress) {
  std::vector<ModelFit> whole;
  for (const LawScore* score : scores) whole.push_back(cautious_start(setup, early, *score));
  return race(scores.size(), first_share, threshold, [&](size_t k, double share, const ModelFit&) {
    return refined_over(setup, whole[k], model, share, progress);
  });
}

/// From where a rough fit stands; where that does not bring what was foreseen, over growing
/// horizons.
ModelFit fit_from_rough(const DiagnosisSetup& setup, const ModelFit& model, const LawScore& score,
                        ModelFit near, double threshold, const ProgressCallback& progress) {
  refine_model(near, setup, {}, progress);
  if (near.cancelled) return near;
  if (near.usable) {
    const double left = near.chi_square(threshold);
    const double fall = model.chi_square(threshold) - left;
    if (fall > kKeptPromise * score.fall ||
        left < kHardlyMore * static_cast<double>(near.residual_count()))
      return near;
  }
  ModelFit far =
      race_laws(setup, model, model, {&score}, kShortHorizon, threshold, progress).front();
  if (far.cancelled || !near.usable) return far;
  return far.usable && far.chi_square(threshold) < near.chi_square(threshold) ? far : near;
}

/// All laws roughly, from where the model stands along the derivatives of the score; then, exactly,
/// those that gain half as much as the best one, or less than was foreseen.
std::vector<ModelFit> fit_near(const DiagnosisSetup& setup, const ModelFit& model,
                               const std::vector<const LawScore*>& scores, double threshold,
                               const ProgressCallback& progress) {
  constexpr double kOfBest = 0.5;
  const double without = model.chi_square(threshold);
  std::vector<ModelFit> fitted(scores.size());
  std::vector<double> fall(scores.size(), 0);
  tbb::parallel_for(size_t{0}, scores.size(), [&](size_t k) {
    fitted[k] = fit_from_here(setup, model, *scores[k], {.rounds = 1, .rough = true}, progress);
    if (fitted[k].usable) fall[k] = without - fitted[k].chi_square(threshold);
  });
  if (fitted.empty() || std::ranges::any_of(fitted, &ModelFit::cancelled)) return fitted;
  const double enough = kOfBest * *std::ranges::max_element(fall);
  tbb::parallel_for(size_t{0}, scores.size(), [&](size_t k) {
    if (fall[k] < enough && fall[k] > kKeptPromise * scores[k]->fall) return;
    fitted[k] = fit_from_rough(setup, model, *scores[k], std::move(fitted[k]), threshold, progress);
  });
  return fitted;
}

}  // namespace

double least_fall(Eigen::Index amplitudes) {
  return 25 + 3.6 * static_cast<double>(amplitudes - 1);
}

ModelFit with_terms(const DiagnosisSetup& setup, const ModelFit& model,
                    const std::vector<Term>& terms, const Columns& columns) {
  ModelFit result = model_at(setup, terms, model.values());
  const std::vector<std::string> added =
      terms.empty() ? std::vector<std::string>() : terms.back().parameters();
  for (size_t n = 0; n < result.parts.size(); ++n) {
    const PooledPart& from = model.parts[n];
    PooledPart& part = result.parts[n];
    part.frames = from.frames;
    part.correction = from.correction;
    part.directions = from.directions;
    part.amounts = from.amounts;
    // Where a term is dropped the run is another one.
    const std::vector<FitParameter>& before = model.problems[n]->space.parameters;
    const bool kept_all = std::ranges::all_of(before, [&](const FitParameter& parameter) {
      return result.problems[n]->space.index(parameter.name) >= 0;
    });
    if (!from.linear.usable || !kept_all) continue;
    part.steps = from.steps;
    const ParameterSpace& space = result.problems[n]->space;
    const Eigen::VectorXd slope = space.value_by_coordinate(part.values);
    Eigen::MatrixXd& jacobian = part.linear.residual_by_coordinate;
    jacobian.resize(from.linear.residual.size(), space.size());
    std::vector<int> unknown;
    for (int p = 0; p < space.size(); ++p) {
      const std::string& name = space.parameters[static_cast<size_t>(p)].name;
      const auto known = model.problems[n]->space.index(name);
      const auto scored = std::ranges::find(added, name);
      if (known >= 0) {
        jacobian.col(p) = from.linear.residual_by_coordinate.col(known);
      } else if (!columns.empty() && scored != added.end()) {
        // A recording's own amplitudes have columns of their own.
        const auto count = static_cast<Eigen::Index>(added.size());
        const Eigen::Index first =
            columns[n].cols() > count ? static_cast<Eigen::Index>(n) * count : 0;
        jacobian.col(p) = columns[n].col(first + (scored - added.begin())) * slope[p];
      } else {
        unknown.push_back(p);
      }
    }
    part.linear.residual = from.linear.residual;
    part.linear.usable = true;
    part.borrowed = true;
    if (unknown.empty()) continue;
    const Linearisation rest = result.objective(n).linearise_by(part.values, unknown);
    part.linear.usable = rest.usable;
    if (rest.usable) jacobian(Eigen::all, unknown) = rest.residual_by_coordinate;
  }
  return result;
}

std::vector<ModelFit> fit_with_laws(const DiagnosisSetup& setup, const ModelFit& model,
                                    const ModelFit& early,
                                    const std::vector<const LawScore*>& scores, double first_share,
                                    double threshold, const ProgressCallback& progress) {
  if (first_share == 1) return fit_near(setup, model, scores, threshold, progress);
  std::vector<ModelFit> fitted =
      race_laws(setup, model, early, scores, first_share, threshold, progress);
  // Growing horizons can lead astray where no single law brings the model near the cloth.
  const double without = model.chi_square(threshold);
  for (size_t k = 0; k < fitted.size(); ++k) {
    if (fitted[k].cancelled) return fitted;
    if (!fitted[k].usable || fitted[k].chi_square(threshold) < without) continue;
    fitted[k] = fit_from_here(setup, model, *scores[k], {}, progress);
  }
  return fitted;
}

std::vector<ModelFit> race_on_mesh(const DiagnosisSetup& other, const std::vector<ModelFit>& models,
                                   double threshold, const ProgressCallback& progress) {
  return race(models.size(), kFirstOnMesh, threshold,
              [&](size_t k, double share, const ModelFit& shorter) {
                return lead_to_mesh(other, models[k], share, shorter, progress);
              });
}

ModelFit fitted_anew(const DiagnosisSetup& setup, const std::vector<Term>& terms,
                     const ProgressCallback& progress) {
  // Of a start in motion there are hundreds of numbers more: minutes, where a fit from a known
  // model takes seconds.
  if (std::ranges::any_of(setup.inputs, [](const FitInput& input) {
        return input.recording.start == StartKind::unknown;
      }))
    return {};
  FitOptions options = options_with(setup, terms, 0);
  options.mesh_columns = setup.columns;
  options.mesh_rows = setup.rows;
  const FitReport first = fit(with_terms(setup.inputs.front(), terms), options, progress);
  if (!first.usable()) return {};
  ModelFit fitted =
      model_at(setup, terms, std::vector<NamedValues>(setup.inputs.size(), first.values));
  if (setup.inputs.size() > 1) return fit_on_mesh(setup, fitted, progress);
  linearise_model(fitted);
  return fitted;
}

}  // namespace clothfit
