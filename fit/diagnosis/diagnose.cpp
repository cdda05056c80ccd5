#include "fit/diagnosis/diagnose.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <utility>

#include "data/input_error.h"
#include "fit/diagnosis/analysis.h"
#include "fit/diagnosis/base_fit.h"
#include "fit/diagnosis/worth.h"
#include "fit/jobs/draws.h"
#include "fit/jobs/stop_token.h"
#include "fit/jobs/thread_limit.h"

namespace clothfit {
namespace {

/// The least share of the frames that a residual force is taken from.
constexpr double kForceShare = 0.28;

/// Runs one diagnosis, whose steps share what was given.
class Run {
 public:
  Run(std::span<const FitInput> fitted, std::span<const FitInput> held_out,
      const DiagnoseOptions& options, const ProgressCallback& progress)
      : fitted_(fitted),
        options_(with_check(options)),
        began_(std::chrono::steady_clock::now()),
        progress_(stop_token(until_winding_up(progress))),
        search_progress_(until_enough()),
        reports_(fitted, held_out, progress_) {}

  Diagnosis run() {
    try {
      diagnose_all();
    } catch (const StopRequested&) {
      result_.stop = FitStop::cancelled;
      result_.message = "cancelled";
    } catch (const GivenUp& given_up) {
      result_.stop = given_up.stop;
      result_.message = given_up.message;
    }
    result_.recordings = std::move(reports_.recordings);
    result_.phases = clock_.times();
    result_.seconds = seconds();
    return std::move(result_);
  }

 private:
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count();
  }

  /// Returns the options with a check for simulations that ends what the progress ends.
  DiagnoseOptions with_check(DiagnoseOptions options) const {
    options.fit.is_cancelled = [this, asked = options.fit.is_cancelled] {
      if (is_searching_) throw_if_time_is_up();
      if (asked && !winding_up_ && asked()) throw StopRequested();
      return false;
    };
    return options;
  }

  void throw_if_time_is_up() const {
    const bool is_late = options_.budget_s > 0 && seconds() > options_.budget_s;
    if (is_late || (options_.is_enough && options_.is_enough())) throw TimeIsUp();
  }

  /// Returns a progress that nobody can stop once results are being made of what was found.
  ProgressCallback until_winding_up(const ProgressCallback& asked) const {
    if (!asked) return asked;
    return [this, asked](const Progress& now) { return asked(now) || winding_up_; };
  }

  /// Returns the progress of a search, which ends once its time is up. Throws TimeIsUp then.
  ProgressCallback until_enough() const {
    return [this](const Progress& now) {
      throw_if_time_is_up();
      report_progress(progress_, now);
      return true;
    };
  }

  void diagnose_all() {
    Analysis declared(fitted_, options_, options_.fit);
    clock_.enter("base fit");
    report_base(declared);
    is_searching_ = true;
    search_for_effects(declared, search_progress_, &clock_);
    is_searching_ = false;
    result_.complete = declared.found.complete;
    winding_up_ = !result_.complete;
    clock_.enter("reports");
    if (declared.found.base.usable()) {
      reports_.add(declared.setup, declared.base, &DiagnosedRecording::before);
      result_.before = judge_adequacy(declared.base, options_.fit.loss);
    }
    const double share = declared.found.first_share;
    result_.score_frames = frames_of_share(*declared.base.problems.front(), share);
    result_.scores = std::move(declared.found.first);
    if (!result_.complete) return conclude(declared);
    clock_.enter("residual force");
    look_at_forces(declared, share);

    result_.seen_elsewhere = constants_to_try(declared, reports_);
    if (result_.seen_elsewhere) {
      FitOptions with_offsets = options_.fit;
      with_offsets.marker_offset_sigma_m = result_.seen_elsewhere->rms_m;
      clock_.enter("marker constants");
      Analysis beside(fitted_, options_, with_offsets);
      if (search_beside_constants(beside, declared, *result_.seen_elsewhere, progress_))
        return conclude(beside);
      result_.seen_elsewhere.reset();
    }
    conclude(declared);
  }

  /// Fits the model as declared, and reports it.
  void report_base(Analysis& declared) {
    fit_base(declared, progress_);
    result_.stop = declared.first.stop;
    result_.message = declared.first.message;
    result_.columns = declared.setup.columns;
    result_.rows = declared.setup.rows;
    // A recording's own fit says more of how sure it is.
    if (fitted_.size() == 1 && declared.is_on_own_mesh() && !declared.base.is_unrefined())
      reports_.recordings.front().before = std::move(declared.first);
    else
      reports_.add_fitted(declared.setup, declared.base, &DiagnosedRecording::before);
    reports_.add_held_out(declared.setup, declared.base, &DiagnosedRecording::before);
    result_.before = judge_adequacy(declared.base, options_.fit.loss);
  }

  /// Takes the residual force over few frames, where the cloth's answer to it is still small.
  void look_at_forces(const Analysis& declared, double share) {
    FittedModel early = shortened(declared.base, std::max(share, kForceShare));
    refine_model(early, declared.setup, {.rounds = 1}, progress_);
    result_.residual_force = residual_force(early.usable() ? early : declared.base);
  }

  /// Reports what was found, and what else would have been.
  void conclude(Analysis& analysis) {
    clock_.enter("reports");
    const FittedModel& model = analysis.found.model;
    const double threshold = analysis.search.threshold;
    result_.columns = analysis.setup.columns;
    result_.rows = analysis.setup.rows;
    result_.accepted = std::move(analysis.found.accepted);
    result_.refused = std::move(analysis.found.refused);
    result_.after = judge_adequacy(model, options_.fit.loss);
    const double explained = analysis.base.chi_square(threshold) - model.chi_square(threshold);
    if (result_.complete)
      result_.limits = detection_limits(model, result_.after, analysis.found.last,
                                        worth_naming(model, threshold, explained));
    if (result_.changed() || model.misfits_grossly())
      reports_.add(analysis.setup, model, &DiagnosedRecording::after);
    else
      for (DiagnosedRecording& recording : reports_.recordings) recording.after = recording.before;
    result_.verdict = verdict();

    if (!result_.complete) return;
    clock_.enter("separation");
    if (options_.separate)
      result_.separations =
          separating_recordings(analysis.setup, model, result_.accepted, progress_);
    clock_.enter("twins");
    search_all_twins(analysis);
    clock_.enter("proposed law");
    if (result_.after.adequate || options_.law_terms == 0) return;
    propose_law_for(analysis.setup, model, threshold);
  }

  /// Proposes a law for what a model leaves. The coarse mesh does for that, corrected by what the
  /// meshes differ by.
  void propose_law_for(const DiagnosisSetup& setup, const FittedModel& model, double threshold) {
    const DiagnosisSetup coarse = with_coarse_mesh(setup);
    const bool is_coarse = is_coarser(coarse, setup);
    const FittedModel there = is_coarse ? corrected_on_mesh(coarse, model) : model;
    if (!there.usable()) return;
    result_.law = propose_law(is_coarse ? coarse : setup, there,
                              {.most_terms = options_.law_terms,
                               .blocks = static_cast<int>(kCriteria.time_blocks),
                               .without = options_.without,
                               .threshold = threshold},
                              progress_);
    if (!result_.law.found()) return;
    if (is_coarse) {
      // The law as it is written, so nothing is fitted again.
      FittedModel here = model_at(setup, result_.law.model.hypotheses, result_.law.model.values());
      for (size_t n = 0; n < here.parts.size(); ++n) {
        here.parts[n].correction = model.parts[n].correction;
        here.parts[n].directions = model.parts[n].directions;
        here.parts[n].amplitudes = model.parts[n].amplitudes;
      }
      linearise_model(here);
      if (!here.usable()) {
        result_.law = {};
        return;
      }
      result_.law.model = std::move(here);
    }
    reports_.add(setup, result_.law.model, &DiagnosedRecording::with_law);
  }

  DiagnosisVerdict verdict() const {
    if (!result_.changed())
      return result_.after.adequate ? DiagnosisVerdict::adequate : DiagnosisVerdict::unexplained;
    return result_.after.adequate ? DiagnosisVerdict::explained
                                  : DiagnosisVerdict::partly_explained;
  }

  void search_all_twins(const Analysis& analysis) {
    const auto search = [&](const Plant& plant, unsigned long long seed) {
      return search_twins(analysis.setup, analysis.found.model, plant, analysis.search, seed,
                          progress_);
    };
    if (options_.reinject && !result_.accepted.empty())
      result_.reinjected = search({}, options_.fit.seed);
    std::vector<Plant> plants = plants_of(result_.limits);
    if (plants.size() > static_cast<size_t>(options_.plants))
      plants.resize(static_cast<size_t>(options_.plants));
    for (size_t k = 0; k < plants.size(); ++k)
      result_.plants.push_back(
          search(plants[k], derived_seed(options_.fit.seed, static_cast<int>(k))));
  }

  std::span<const FitInput> fitted_;
  const DiagnoseOptions options_;
  std::chrono::steady_clock::time_point began_;
  ProgressCallback progress_, search_progress_;
  std::atomic<bool> is_searching_ = false, winding_up_ = false;
  PhaseClock clock_;
  RecordingReports reports_;
  Diagnosis result_;
};

/// Throws InputError where recordings are not of one cloth.
void require_one_cloth(std::span<const FitInput> fitted, std::span<const FitInput> held_out) {
  if (fitted.empty()) throw InputError("diagnose", "no recording is given", "one or more to fit");
  const ClothDescription& cloth = fitted.front().recording.cloth;
  for (const auto& recordings : {fitted, held_out})
    for (const FitInput& input : recordings)
      if (input.recording.cloth.width_m != cloth.width_m ||
          input.recording.cloth.height_m != cloth.height_m)
        throw InputError(input.recording.name,
                         "its cloth has another size than that of " + fitted.front().recording.name,
                         "recordings of one cloth");
}

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
    case DiagnosisVerdict::not_reached:
      return "not_reached";
  }
  return "";
}

Diagnosis diagnose(std::span<const FitInput> fitted, std::span<const FitInput> held_out,
                   const DiagnoseOptions& options, const ProgressCallback& progress) {
  options.validate();
  require_one_cloth(fitted, held_out);
  const ThreadLimit threads(options.fit.threads);
  return Run(fitted, held_out, options, progress).run();
}

Diagnosis diagnose(const FitInput& input, const DiagnoseOptions& options,
                   const ProgressCallback& progress) {
  return diagnose({&input, 1}, {}, options, progress);
}

}  // namespace clothfit
