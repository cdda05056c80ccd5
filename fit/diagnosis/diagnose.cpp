#include "fit/diagnosis/diagnose.h"

#include <tbb/global_control.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "data/input_error.h"
#include "fit/cost/huber.h"
#include "fit/diagnosis/clearance.h"
#include "fit/diagnosis/discretisation.h"
#include "fit/diagnosis/refit.h"
#include "fit/fit.h"
#include "fit/jobs/draws.h"
#include "fit/measurement_effects/registry.h"
#include "fit/observe/held_tracks.h"
#include "fit/problem/parameterised_model.h"
#include "fit/uncertainty/uncertainty.h"

namespace clothfit {
namespace {

/// Frames that a residual force is taken from, as a share, at least.
constexpr double kForceShare = 0.28;

/// The fitted model on the mesh that is analysed: twice the cells a side where that leaves clearly
/// less, for derivatives of a mesh that cannot follow the cloth mistake one effect for another.
/// `setup` is given that mesh.
ModelFit on_analysed_mesh(ModelFit own, DiagnosisSetup& setup, const ProgressCallback& progress) {
  constexpr double kClearlyLess = 0.05;  // of chi-square, per residual
  if (setup.options.spring_set != SpringSet::fabric) return own;
  const DiagnosisSetup other = with_other_mesh(setup);
  if (other.columns < setup.columns) return own;
  // From where the declared mesh's optimum lies a fit can end in another valley.
  ModelFit finer;
  if (other.inputs.size() == 1) finer = fitted_anew(other, {}, progress);
  if (!finer.usable) {
    finer = fit_on_mesh(other, own, progress);
    if (finer.usable && finer.rough) {
      // Optima are compared, not what updated derivatives stop short of.
      for (PooledPart& part : finer.parts) part.linear = {};
      refine_model(finer, other, {}, progress);
    }
    if (finer.usable) linearise_model(finer);
  }
  const double least_gain = kClearlyLess * static_cast<double>(own.residual_count());
  if (!finer.usable || own.residual().squaredNorm() - finer.residual().squaredNorm() < least_gain)
    return own;
  setup.columns = other.columns;
  setup.rows = other.rows;
  return finer;
}

/// Gives observations that state no sigma the one that a problem has found for them; not those of
/// markers that drive held points.
void state_noise(const FitProblem& problem, FitInput& input) {
  for (const ObservationSet& set : problem.observations) {
    std::set<int> observed;
    for (const Observation& row : set.rows) observed.insert(row.marker);
    if (!set.camera) {
      for (Position3d& row : input.tracks3d)
        if (!(row.sigma_m > 0) && observed.contains(row.marker)) row.sigma_m = set.noise;
    } else {
      for (Position2d& row : input.tracks2d.at(set.kind))
        if (!(row.sigma_px > 0) && observed.contains(row.marker)) row.sigma_px = set.noise;
    }
  }
}

/// `least`: sigmas from which on an amplitude would be accepted. Of amplitudes that each recording
/// has for itself, those of the recording that sees them best.
std::vector<DetectionLimit> limits_of(const std::vector<LawScore>& scores, double least) {
  std::vector<DetectionLimit> limits;
  for (const LawScore& score : scores) {
    DetectionLimit limit{.term = score.term,
                         .parameter = score.term.amplitudes,
                         .unit = {},
                         .limit = {},
                         .found = {},
                         .fall = score.fall};
    const auto each = static_cast<Eigen::Index>(score.term.amplitudes.size());
    limit.limit = least * score.sigma.head(each);
    limit.found = score.amount.head(each);
    for (Eigen::Index k = each; k < score.sigma.size(); ++k) {
      if (!(least * score.sigma[k] < limit.limit[k % each])) continue;
      limit.limit[k % each] = least * score.sigma[k];
      limit.found[k % each] = score.amount[k];
    }
    const EffectDescription effect = describe_effect(score.term.effect);
    for (const std::string& name : limit.parameter)
      limit.unit.push_back(
          std::ranges::find(effect.parameters, name, &EffectParameter::name)->unit);
    limits.push_back(std::move(limit));
  }
  return limits;
}

/// One amplitude of each effect, a little above its limit, those first that are seen best for their
/// size.
std::vector<Plant> plants_of(const std::vector<DetectionLimit>& limits) {
  constexpr double kAbove = 1.6;
  struct Choice {
    Plant plant;
    double share = 0;  ///< of what is typical
  };
  std::vector<Choice> choices;
  for (const DetectionLimit& limit : limits) {
    const EffectDescription effect = describe_effect(limit.term.effect);
    for (Eigen::Index k = 0; k < limit.limit.size(); ++k) {
      const EffectParameter& parameter = *std::ranges::find(
          effect.parameters, limit.parameter[static_cast<size_t>(k)], &EffectParameter::name);
      double beyond = kAbove * limit.limit[k];
      if (parameter.neutral + beyond > parameter.upper) beyond = -beyond;
      if (!std::isfinite(beyond) || parameter.neutral + beyond < parameter.lower ||
          parameter.neutral + beyond > parameter.upper)
        continue;
      const Choice choice{
          .plant = {.term = limit.term, .parameter = parameter.name, .beyond_neutral = beyond},
          .share = std::abs(beyond) / parameter.typical};
      const auto same = std::ranges::find_if(choices, [&](const Choice& known) {
        return known.plant.term.effect == limit.term.effect;
      });
      if (same == choices.end())
        choices.push_back(choice);
      else if (choice.share < same->share)
        *same = choice;
    }
  }
  std::ranges::stable_sort(choices, {}, &Choice::share);
  std::vector<Plant> plants;
  for (Choice& choice : choices) plants.push_back(std::move(choice.plant));
  return plants;
}

/// Runs one diagnosis, whose steps share what was given.
class Run {
 public:
  Run(std::span<const FitInput> fitted, std::span<const FitInput> held_out,
      const DiagnoseOptions& options, const ProgressCallback& progress)
      : fitted_(fitted),
        held_out_(held_out),
        options_(options),
        progress_([this, &progress](const Progress& now) {
          cancelled_ = cancelled_ || (progress && !progress(now));
          return !cancelled_;
        }) {
    result_.recordings.resize(fitted.size() + held_out.size());
    for (size_t n = fitted.size(); n < result_.recordings.size(); ++n)
      result_.recordings[n].held_out = true;
  }

  Diagnosis run() {
    const auto began = std::chrono::steady_clock::now();
    diagnose_all();
    if (cancelled_) {
      result_.stop = FitStop::cancelled;
      result_.message = "cancelled";
    }
    result_.seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
    return std::move(result_);
  }

 private:
  using Report = FitReport DiagnosedRecording::*;

  /// Of a report on the mesh that was analysed, whatever a recording suggests itself.
  static FitOptions options_on(const DiagnosisSetup& setup, const std::vector<Term>& terms,
                               size_t recording) {
    FitOptions options = options_with(setup, terms, recording);
    options.mesh_columns = setup.columns;
    options.mesh_rows = setup.rows;
    return options;
  }

  /// The recordings as one set of options has them fitted.
  struct Analysis {
    Analysis(std::span<const FitInput> inputs, FitOptions fit_options)
        : options(std::move(fit_options)), setup{.inputs = inputs, .options = options} {}
    Analysis(const Analysis&) = delete;
    Analysis& operator=(const Analysis&) = delete;

    FitOptions options;
    DiagnosisSetup setup;  ///< on the mesh that is analysed
    FitReport first;       ///< a fit of the first recording alone, on its own mesh
    ModelFit base;
    SearchOptions search;
    LawSearch found;

    bool is_on_own_mesh() const {
      return setup.columns == first.result.mesh_columns && setup.rows == first.result.mesh_rows;
    }
  };

  void diagnose_all() {
    Analysis declared(fitted_, options_.fit);
    if (const std::string why_not = fit_base(declared); cancelled_ || !why_not.empty()) {
      give_up(declared.first.usable() ? FitStop::diverged : declared.first.stop, why_not);
      return;
    }
    result_.stop = declared.first.stop;
    result_.message = declared.first.message;
    result_.columns = declared.setup.columns;
    result_.rows = declared.setup.rows;
    // A fit of its own says more of how sure it is.
    if (fitted_.size() == 1 && declared.is_on_own_mesh() && !declared.base.rough)
      result_.recordings.front().before = std::move(declared.first);
    else if (!report_fitted(declared.setup, declared.base, &DiagnosedRecording::before))
      return;
    if (!report_held_out(declared.setup, declared.base, &DiagnosedRecording::before)) return;
    result_.before = judge_adequacy(declared.base, options_.fit.loss);

    search_for_laws(declared);
    if (cancelled_) return;
    if (declared.found.base.usable) {
      if (!report_model(declared.setup, declared.base, &DiagnosedRecording::before)) return;
      result_.before = judge_adequacy(declared.base, options_.fit.loss);
    }
    const double share = declared.found.first_share;
    result_.score_frames = frames_of_share(*declared.base.problems.front(), share);
    result_.scores = std::move(declared.found.first);
    // Over few frames, where the cloth's answer to a missing force is still small.
    ModelFit early = shortened(declared.base, std::max(share, kForceShare));
    refine_model(early, declared.setup, {.rounds = 1}, progress_);
    if (cancelled_) return;
    result_.residual_force = residual_force(early.usable ? early : declared.base);

    std::optional<Analysis> mended;
    result_.seen_elsewhere = offsets_to_try(declared);
    if (result_.seen_elsewhere) {
      FitOptions with_offsets = options_.fit;
      with_offsets.marker_offset_sigma_m = result_.seen_elsewhere->rms_m;
      mended.emplace(fitted_, with_offsets);
      if (!mend(*mended, declared)) {
        mended.reset();
        result_.seen_elsewhere.reset();
      }
    }
    if (!cancelled_) conclude(mended ? *mended : declared);
  }

  /// Why there is none; empty if there is.
  std::string fit_base(Analysis& analysis) {
    // A model that lacks something large is drawn far away, at ever shorter time steps, to an
    // optimum that says no more than what a fifth of the work finds.
    constexpr double kFirstWork = 0.2;
    FitOptions options = analysis.options;
    options.work *= kFirstWork;
    const ClothDescription& cloth = fitted_.front().recording.cloth;
    DiagnosisSetup& setup = analysis.setup;
    setup.columns = options.mesh_columns > 0 ? options.mesh_columns : cloth.mesh_columns;
    setup.rows = options.mesh_rows > 0 ? options.mesh_rows : cloth.mesh_rows;
    // Where a finer mesh may be analysed optima are compared.
    const bool coarse_will_do =
        is_coarser(with_coarse_mesh(setup), setup) && is_coarser(with_other_mesh(setup), setup);
    if (coarse_will_do) options.coarse_beyond = kHopeless;
    analysis.first = fit(fitted_.front(), options, progress_);
    if (!analysis.first.usable()) return analysis.first.message;
    ModelFit base = base_model(setup, analysis.first);
    if (!base.usable) return "the derivatives at the optimum could not be computed";
    base = on_analysed_mesh(std::move(base), setup, progress_);
    // Left for later, where a coarser mesh may show what is missing.
    base.rough = coarse_will_do && base.is_hopeless();
    if (!base.rough) refine_with_discretisation(base, setup, progress_);
    if (!base.usable) return "the fit went astray where it was to be refined";
    analysis.base = std::move(base);
    return "";
  }

  void search_for_laws(Analysis& analysis) {
    analysis.search = {.laws = laws(*analysis.base.problems.front()),
                       .lines = options_.lines,
                       .refits = options_.refits,
                       .most_effects = static_cast<size_t>(options_.most_effects),
                       .threshold = threshold(analysis.base)};
    analysis.found = search_laws(analysis.setup, analysis.base, analysis.search, progress_);
    if (!analysis.found.base.usable) return;
    analysis.base = analysis.found.base;
    analysis.search.threshold = analysis.found.threshold;
  }

  /// The constants that markers are off by, where nothing explains all and these would mend a good
  /// part of the rest on blocks that are left out.
  std::optional<SeenElsewhere> offsets_to_try(const Analysis& analysis) {
    const ModelFit& model = analysis.found.model;
    const bool in_space = std::ranges::all_of(model.problems, [](const auto& problem) {
      return problem->observations.front().dimension == 3;
    });
    if (!in_space || options_.fit.marker_offset_sigma_m > 0 ||
        judge_adequacy(model, options_.fit.loss).adequate)
      return std::nullopt;
    const CrossValidation left_out =
        cross_validate(analysis.setup, model, kTimeBlocks, analysis.search.threshold);
    if (!left_out.usable ||
        left_out.mean - left_out.constant_offset < kGoodPart * (left_out.mean - 1))
      return std::nullopt;
    // (The report of the last model takes this one's place.)
    if (!model.terms.empty() && !report_fitted(analysis.setup, model, &DiagnosedRecording::after))
      return std::nullopt;
    return SeenElsewhere{
        .rms_m = mean_residual_rms_m(model.terms.empty() ? &DiagnosedRecording::before
                                                         : &DiagnosedRecording::after),
        .cross_validated = left_out.constant_offset,
        .without_it = left_out.mean};
  }

  /// Of the markers' mean residuals in the fitted frames, per coordinate, by a model's report.
  double mean_residual_rms_m(Report report) const {
    double squares = 0;
    Eigen::Index count = 0;
    for (size_t n = 0; n < fitted_.size(); ++n) {
      std::map<int, std::pair<Eigen::Vector3d, int>> of_marker;
      for (const FitReport::Residuals::Row& row :
           (result_.recordings[n].*report).residuals.front().rows) {
        if (row.held_out) continue;
        auto& [sum, rows] =
            of_marker.try_emplace(row.marker, Eigen::Vector3d::Zero(), 0).first->second;
        sum += row.observed - row.predicted;
        ++rows;
      }
      for (const auto& [marker, of] : of_marker) squares += (of.first / of.second).squaredNorm();
      count += 3 * static_cast<Eigen::Index>(of_marker.size());
    }
    return std::sqrt(squares / static_cast<double>(std::max<Eigen::Index>(1, count)));
  }

  /// Searches anew beside such constants: from a fit of its own, or, where laws were accepted
  /// without them, from these. False where that does not work out, or does not mend a good part.
  /// (What is left out had its say in the constants there: that they foresee it has been asked
  /// before.)
  bool mend(Analysis& analysis, const Analysis& declared) {
    if (declared.found.accepted.empty() && !declared.found.moved) {
      if (!fit_base(analysis).empty() || cancelled_) return false;
    } else if (!go_on_from(declared, analysis)) {
      return false;
    }
    search_for_laws(analysis);
    if (cancelled_) return false;
    const CrossValidation left_out = cross_validate(analysis.setup, analysis.found.model,
                                                    kTimeBlocks, analysis.search.threshold);
    const double without_it = result_.seen_elsewhere->without_it;
    if (!left_out.usable || without_it - left_out.mean < kGoodPart * (without_it - 1)) return false;
    analysis.found.accepted.insert(analysis.found.accepted.begin(), declared.found.accepted.begin(),
                                   declared.found.accepted.end());
    return true;
  }

  /// The model that `from` has found, refined under the options of another analysis, which begins
  /// there.
  bool go_on_from(const Analysis& from, Analysis& analysis) {
    const ModelFit& model = from.found.model;
    analysis.setup.columns = from.setup.columns;
    analysis.setup.rows = from.setup.rows;
    analysis.base = model_at(analysis.setup, model.terms, model.values());
    for (size_t n = 0; n < model.parts.size(); ++n) {
      analysis.base.parts[n].frames = model.parts[n].frames;
      analysis.base.parts[n].steps = model.parts[n].steps;
    }
    linearise_model(analysis.base);
    refine_with_discretisation(analysis.base, analysis.setup, progress_);
    return analysis.base.usable && !cancelled_;
  }

  /// Reports what was found, and what else would have been.
  void conclude(Analysis& analysis) {
    const ModelFit& model = analysis.found.model;
    result_.columns = analysis.setup.columns;
    result_.rows = analysis.setup.rows;
    result_.accepted = std::move(analysis.found.accepted);
    result_.refused = std::move(analysis.found.refused);
    result_.after = judge_adequacy(model, options_.fit.loss);
    const double explained = analysis.base.chi_square(analysis.search.threshold) -
                             model.chi_square(analysis.search.threshold);
    const double worth = worth_naming(model, analysis.search.threshold, explained);
    const double clear =
        LawTrial::kClear * std::sqrt(std::max(1.0, result_.after.chi_square_per_dof));
    result_.limits = limits_of(analysis.found.last,
                               typical_roughness(model) * std::max(clear, std::sqrt(worth)));
    const bool adequate = result_.after.adequate;
    if (!result_.changed()) {
      for (DiagnosedRecording& recording : result_.recordings) recording.after = recording.before;
      result_.verdict = adequate ? DiagnosisVerdict::adequate : DiagnosisVerdict::unexplained;
    } else {
      if (!report_model(analysis.setup, model, &DiagnosedRecording::after)) return;
      result_.verdict = adequate ? DiagnosisVerdict::explained : DiagnosisVerdict::partly_explained;
    }
    if (options_.separate)
      result_.separations =
          separating_recordings(analysis.setup, model, result_.accepted, progress_);
    if (cancelled_) return;
    search_all_twins(analysis.setup, model, analysis.search);
    if (cancelled_ || adequate || options_.law_terms == 0) return;
    result_.law = propose_law(analysis.setup, model,
                              {.most_terms = options_.law_terms,
                               .blocks = kTimeBlocks,
                               .without = options_.without,
                               .threshold = analysis.search.threshold},
                              progress_);
    if (cancelled_ || !result_.law.found()) return;
    report_model(analysis.setup, result_.law.model, &DiagnosedRecording::with_law);
  }

  /// Fitted to all recordings, linearised. `first`: a fit of the first of them alone.
  ModelFit base_model(const DiagnosisSetup& setup, const FitReport& first) const {
    const std::vector<NamedValues> values(fitted_.size(), first.values);
    ModelFit base = model_at(setup, {}, values);
    if (fitted_.size() > 1) return fit_on_mesh(setup, base, progress_);
    PooledPart& part = base.parts.front();
    const FitProblem& problem = *base.problems.front();
    part.steps = time_steps_of_run(problem.cloth, parameter_set(problem, part.values),
                                   first.result.time_step_s);
    linearise_model(base);
    return base;
  }

  std::vector<LawShapes> laws(const FitProblem& problem) const {
    const double duration_s =
        problem.frame_time_s[static_cast<size_t>(problem.first_held_out - 1)] -
        problem.frame_time_s.front();
    std::vector<LawShapes> laws = laws_to_test(fitted_.front(), options_.fit, duration_s);
    std::erase_if(laws, [&](const LawShapes& law) {
      return std::ranges::find(options_.without, law.front().effect) != options_.without.end();
    });
    return laws;
  }

  void search_all_twins(const DiagnosisSetup& setup, const ModelFit& model,
                        const SearchOptions& options) {
    if (options_.reinject && !result_.accepted.empty())
      result_.reinjected = search_twins(setup, model, {}, options, options_.fit.seed, progress_);
    std::vector<Plant> plants = plants_of(result_.limits);
    if (plants.size() > static_cast<size_t>(options_.plants))
      plants.resize(static_cast<size_t>(options_.plants));
    for (size_t k = 0; k < plants.size() && !cancelled_; ++k)
      result_.plants.push_back(search_twins(setup, model, plants[k], options,
                                            derived_seed(options_.fit.seed, static_cast<int>(k)),
                                            progress_));
  }

  /// What a model leaves of all recordings. False where it does not run, or nobody waits for it.
  bool report_model(const DiagnosisSetup& setup, const ModelFit& model, Report report) {
    return report_fitted(setup, model, report) && report_held_out(setup, model, report);
  }

  bool report_fitted(const DiagnosisSetup& setup, const ModelFit& model, Report report) {
    const std::vector<NamedValues> values = model.values();
    const std::vector<NamedValues> sigma =
        sigma_of(model, judge_adequacy(model, options_.fit.loss), threshold(model));
    for (size_t n = 0; n < fitted_.size(); ++n) {
      FitReport& own = result_.recordings[n].*report;
      own = report_at(with_terms(fitted_[n], model.terms), options_on(setup, model.terms, n),
                      {.values = values[n], .sigma = sigma[n]});
      if (!own.usable())
        return give_up(own.stop, "with " + title(model.terms) + ": " + own.message);
    }
    return true;
  }

  /// What the model leaves of recordings that it has not seen.
  bool report_held_out(const DiagnosisSetup& setup, const ModelFit& model, Report report) {
    for (size_t n = 0; n < held_out_.size(); ++n) {
      FitReport& own = result_.recordings[fitted_.size() + n].*report;
      own = report_unseen(setup, model, held_out_[n], report);
      if (cancelled_) return false;
      if (!own.usable()) return give_up(own.stop, held_out_[n].recording.name + ": " + own.message);
    }
    return true;
  }

  FitReport report_unseen(const DiagnosisSetup& setup, const ModelFit& model, FitInput unseen,
                          Report report) {
    DiagnosisSetup alone = setup;
    alone.inputs = {&unseen, 1};
    NamedValues shared;
    std::vector<MarkerOffset> offsets;
    const ParameterSpace& space = model.problems.front()->space;
    for (int p = 0; p < space.size(); ++p) {
      const FitParameter& parameter = space.parameters[static_cast<size_t>(p)];
      if (is_physical(parameter.role)) shared[parameter.name] = model.parts.front().values[p];
    }
    ModelFit own = model_at(alone, model.terms, {shared});
    if (PooledSpace(own.problem_pointers()).own_of(0).empty()) {
      // Nothing is fitted: all frames but those that a recording must have are held out.
      state_noise(*own.problems.front(), unseen);
      unseen.recording.held_out_from_frame = kLeastFitted;
      if (!unseen.held_tracks.empty()) unseen.held_tracks = held_tracks_from_pixels(unseen);
      offsets = mean_offsets(report);
    } else {
      own = fit_on_mesh(alone, own, progress_, true);
      if (!own.usable) {
        FitReport failed;
        failed.stop = own.cancelled ? FitStop::cancelled : FitStop::diverged;
        failed.message = "no fit of what is its own worked out";
        return failed;
      }
      shared = own.values().front();
    }
    return report_at(with_terms(unseen, model.terms), options_on(setup, model.terms, 0),
                     {.values = shared, .sigma = {}, .marker_offsets = offsets});
  }

  /// Of the markers in the recordings that were fitted, whose world is that of those held out.
  std::vector<MarkerOffset> mean_offsets(Report report) const {
    std::map<std::string, std::vector<Eigen::Vector3d>> seen;
    for (size_t n = 0; n < fitted_.size(); ++n)
      for (const MarkerOffset& offset : (result_.recordings[n].*report).result.marker_offsets)
        seen[offset.marker].push_back(offset.offset_m);
    std::vector<MarkerOffset> mean;
    for (const auto& [marker, offsets] : seen) {
      mean.push_back({.marker = marker, .offset_m = Eigen::Vector3d::Zero()});
      for (const Eigen::Vector3d& offset_m : offsets)
        mean.back().offset_m += offset_m / static_cast<double>(offsets.size());
    }
    return mean;
  }

  /// Residuals beyond it count less, in sigmas.
  double threshold(const ModelFit& model) const {
    return options_.fit.loss == Loss::huber ? kHuberScales * robust_scale(model.residual())
                                            : std::numeric_limits<double>::infinity();
  }

  bool give_up(FitStop stop, const std::string& message) {
    result_.stop = stop;
    result_.message = message;
    return false;
  }

  static constexpr int kLeastFitted = 2;

  std::span<const FitInput> fitted_, held_out_;
  const DiagnoseOptions& options_;
  bool cancelled_ = false;
  ProgressCallback progress_;
  Diagnosis result_;
};

}  // namespace

std::string to_string(DiagnosisVerdict verdict) {
  switch (verdict) {
    case DiagnosisVerdict::adequate:
      return "adequate";
    case DiagnosisVerdict::explained:
      return "explained";
    case DiagnosisVerdict::partly_explained:
      return "partly_explained";
    case DiagnosisVerdict::unexplained:
      return "unexplained";
  }
  return "";
}

void DiagnoseOptions::validate() const {
  fit.validate();
  const auto require = [](bool good, const std::string& name, const std::string& expected) {
    if (!good) throw InputError("--" + name, "is out of range", expected);
  };
  require(lines >= 1 && lines <= 20, "lines", "1 to 20");
  require(refits >= 1 && refits <= 50, "refits", "1 to 50");
  require(most_effects >= 0 && most_effects <= 10, "most-effects", "0 to 10");
  require(law_terms >= 0 && law_terms <= 10, "law-terms", "0 to 10");
  require(plants >= 0, "plant", "a number of laws, or all");
  require(!fit.forecast && !fit.start, "start", "a diagnosis finds its own");
  for (const std::string& effect : without) require_effect(effect, "--without");
}

Diagnosis diagnose(std::span<const FitInput> fitted, std::span<const FitInput> held_out,
                   const DiagnoseOptions& options, const ProgressCallback& progress) {
  options.validate();
  if (fitted.empty()) throw InputError("diagnose", "no recording is given", "one or more to fit");
  const ClothDescription& cloth = fitted.front().recording.cloth;
  for (const auto& recordings : {fitted, held_out})
    for (const FitInput& input : recordings)
      if (input.recording.cloth.width_m != cloth.width_m ||
          input.recording.cloth.height_m != cloth.height_m)
        throw InputError(input.recording.name,
                         "its cloth has another size than that of " + fitted.front().recording.name,
                         "recordings of one cloth");
  const tbb::global_control threads(
      tbb::global_control::max_allowed_parallelism,
      options.fit.threads > 0
          ? static_cast<size_t>(options.fit.threads)
          : tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
  return Run(fitted, held_out, options, progress).run();
}

Diagnosis diagnose(const FitInput& input, const DiagnoseOptions& options,
                   const ProgressCallback& progress) {
  return diagnose({&input, 1}, {}, options, progress);
}

}  // namespace clothfit
