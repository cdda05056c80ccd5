#include "apps/study/trials/identification_targets.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>

#include "data/input_error.h"
#include "fit/jobs/stop_token.h"
#include "fit/jobs/thread_limit.h"

namespace clothfit {
namespace {

constexpr int kFewestTrials = 5;

/// Sizes of a planted drag, in sigmas, and releases over which its pseudo-true values are pooled.
constexpr std::array kDragSigmas{1.0, 5.0, 20.0};
constexpr int kPooledReleases = 50;

RecoverOptions study_of(int trials, const TargetsOptions& options) {
  RecoverOptions study;
  study.trials = std::max(kFewestTrials, static_cast<int>(std::lround(trials * options.share)));
  study.seed = options.seed;
  study.threads = options.threads;
  study.fit.mesh_columns = study.fit.mesh_rows = 17;
  study.fit.loss = Loss::squared;
  study.fit.observations = ObservationKind::tracks3d;
  return study;
}

const RecoverResult* result_of(const TargetsResult& result, const std::string& name) {
  for (const auto& [study, recovered] : result.studies)
    if (study.name == name) return &recovered;
  return nullptr;
}

/// Returns the smallest and largest of a number over the parameters.
template <class Number>
std::pair<double, double> range_of(const RecoverResult& result, const Number& number) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const RecoverySummary& p : result.parameters) {
    low = std::min(low, number(p));
    high = std::max(high, number(p));
  }
  return {low, high};
}

TargetState judged(bool met) {
  return met ? TargetState::met : TargetState::missed;
}

std::string command_of(const std::string& name) {
  return "clothfit experiment identification --only " + name;
}

void judge_tracks3d(const TargetsResult& result, std::vector<TargetRow>& rows) {
  TargetRow converged{
      .target = "3D tracks, 1 mm, 60 Hz, 1 s, starts off by 5: 999 of 1000 converge",
      .measured = {},
      .command = command_of("tracks3d")};
  TargetRow spread = converged, cover = converged;
  spread.target = "the same: spread over the Cramer-Rao bound 0.9 to 1.1, per parameter";
  cover.target = "the same: 95 % intervals cover 93 to 97 %, per parameter";
  if (const RecoverResult* found = result_of(result, "tracks3d")) {
    const auto trials = static_cast<int>(found->trials.size());
    const int good = found->good;
    converged.measured =
        fmt::format("{} of {} ({} without a fit, {} not converged, {} beyond 10 bounds)", good,
                    trials, found->failures, found->unconverged, found->wrong);
    converged.state = judged(1000 * (trials - good) <= trials);
    const auto [low, high] =
        range_of(*found, [](const RecoverySummary& p) { return p.spread_over_bound; });
    spread.measured = fmt::format("{:.3f} to {:.3f}", low, high);
    spread.state = judged(low >= 0.9 && high <= 1.1);
    const auto [least, most] =
        range_of(*found, [](const RecoverySummary& p) { return p.coverage_95; });
    const auto [none, undetermined] = range_of(
        *found, [](const RecoverySummary& p) { return static_cast<double>(p.undetermined); });
    cover.measured = fmt::format("{:.1f} to {:.1f} % (up to {:.0f} undetermined of a parameter)",
                                 100 * least, 100 * most, undetermined);
    cover.state = judged(least >= 0.93 && most <= 0.97);
  }
  rows.insert(rows.end(), {converged, spread, cover});
}

void judge_one_camera(const TargetsResult& result, std::vector<TargetRow>& rows) {
  TargetRow row{.target =
                    "one camera, 0.3 px, start unknown: stiffness and damping within 2 % (95 "
                    "of 100 trials)",
                .measured = {},
                .command = command_of("one_camera")};
  if (const RecoverResult* found = result_of(result, "one_camera")) {
    double worst = 0;
    for (const RecoverySummary& p : found->parameters) {
      row.measured += fmt::format("{} {:.2f} % (bound x {:.2f}), ", p.name, 100 * p.percentile_95,
                                  p.spread_over_bound);
      worst = std::max(worst, p.percentile_95);
    }
    row.measured += fmt::format("{} of {} without a fit", found->failures, found->trials.size());
    row.state = judged(worst <= 0.02 && found->failures == 0);
  }
  rows.push_back(row);
}

void judge_spoiled(const TargetsResult& result, std::vector<TargetRow>& rows) {
  TargetRow row{.target =
                    "20 % missing, a hand, 5 % outliers: rms error at most 1.5 times the clean "
                    "case's with as many observations",
                .measured = {},
                .command = command_of("spoiled clean")};
  const RecoverResult* spoiled = result_of(result, "spoiled");
  const RecoverResult* clean = result_of(result, "clean");
  if (spoiled != nullptr && clean != nullptr && !clean->parameters.empty() &&
      spoiled->parameters.size() == clean->parameters.size()) {
    double worst = 0;
    for (size_t p = 0; p < clean->parameters.size(); ++p)
      worst = std::max(worst, spoiled->parameters[p].rms / clean->parameters[p].rms);
    row.measured = fmt::format(
        "{:.2f} at most over the parameters ({} and {} trials, {} and {} "
        "without a fit)",
        worst, spoiled->trials.size(), clean->trials.size(), spoiled->failures, clean->failures);
    row.state = judged(worst <= 1.5 && spoiled->failures == 0);
  }
  rows.push_back(row);
}

bool is_stiffness(const std::string& parameter) {
  return !parameter.starts_with("damping") && parameter.find('.') == std::string::npos;
}

/// Least and largest of some coverage over the stiffnesses, and their printed form.
struct Covered {
  double low = 1, high = 0;
  void add(double share) {
    // Without any trial there is no coverage.
    const double known = std::isnan(share) ? 0 : share;
    low = std::min(low, known);
    high = std::max(high, known);
  }
  bool within_target() const { return low <= high && low >= 0.85 && high <= 0.95; }
  std::string text() const { return fmt::format("{:.0f} to {:.0f} %", 100 * low, 100 * high); }
};

void judge_planted_drag(const PlantedDrag& drag, std::vector<TargetRow>& rows) {
  TargetRow row{.target = fmt::format(
                    "drag of {:g} sigma planted, none in the fit: robust 90 % intervals of every "
                    "stiffness hold the pseudo-true value in 85 to 95 %",
                    drag.sigmas),
                .measured = {},
                .command = command_of("drag")};
  if (drag.pseudo.usable && !drag.rows.empty()) {
    Covered robust, stated, plain, robust_truth, plain_truth;
    int trials = 0;
    for (const PlantedDragRow& p : drag.rows) {
      if (!is_stiffness(p.parameter)) continue;
      trials = std::max(trials, p.trials);
      robust.add(p.holds_pseudo_truth.robust);
      stated.add(p.holds_pseudo_truth.stated);
      plain.add(p.holds_pseudo_truth.plain);
      robust_truth.add(p.holds_truth.robust);
      plain_truth.add(p.holds_truth.plain);
    }
    row.measured = fmt::format(
        "{} ({} trials; as fit.json states them {}; plain ones {}); the true value: {}, plain {}",
        robust.text(), trials, stated.text(), plain.text(), robust_truth.text(),
        plain_truth.text());
    if (!drag.pseudo.converged)
      row.measured += "; the pooled fit did not converge: " + drag.pseudo.message;
    row.state = judged(robust.within_target() && drag.pseudo.converged);
  }
  rows.push_back(row);
}

void judge_drag_fitted(const RecoverResult& found, std::vector<TargetRow>& rows) {
  Covered robust, stated, plain;
  for (const RecoverySummary& p : found.parameters) {
    if (!is_stiffness(p.name)) continue;
    robust.add(p.holds_truth.robust);
    stated.add(p.holds_truth.stated);
    plain.add(p.holds_truth.plain);
  }
  rows.push_back(
      {.target = "with drag in the model too: robust 90 % intervals of every stiffness "
                 "hold the true value in 85 to 95 %",
       .measured = fmt::format("{} ({} trials; as fit.json states them {}; plain {})",
                               robust.text(), found.trials.size(), stated.text(), plain.text()),
       .state = judged(robust.within_target()),
       .command = command_of("drag_fitted")});
}

void judge_seconds(const FitSeconds& seconds, std::vector<TargetRow>& rows) {
  rows.push_back(
      {.target = "a fit of 289 vertices, 1 s at 60 Hz, under 5 s on one core from scratch",
       .measured = fmt::format("3D tracks {:.1f} s, one camera {:.1f} s", seconds.scratch_3d,
                               seconds.scratch_2d),
       .state = judged(std::max(seconds.scratch_3d, seconds.scratch_2d) < 5),
       .command = command_of("seconds")});
  rows.push_back({.target = "the same under 1 s from a warm start",
                  .measured = fmt::format("3D tracks {:.1f} s, one camera {:.1f} s",
                                          seconds.warm_3d, seconds.warm_2d),
                  .state = judged(std::max(seconds.warm_3d, seconds.warm_2d) < 1),
                  .command = command_of("seconds")});
}

/// Sets up a study of 9 x 9 vertices and markers. A fit takes a second, and the coverage of
/// intervals does not depend on these numbers.
RecoverOptions drag_study(double sigmas, const TargetsOptions& options) {
  constexpr double kDragSigmaPerS = 1.2e-3;  // drag_sigma_per_s() of this scene
  RecoverOptions study = study_of(500, options);
  study.scene.truth_mesh = study.scene.markers = 9;
  study.fit.mesh_columns = study.fit.mesh_rows = 9;
  study.start_factor = 1.1;
  study.scene.drag_per_s = sigmas * kDragSigmaPerS;
  return study;
}

bool is_wanted(const TargetsOptions& options, const TargetStudy& study) {
  return options.only.empty() || std::ranges::any_of(options.only, [&](const std::string& name) {
           return name == study.name || (name == "drag" && study.drag_sigmas > 0);
         });
}

}  // namespace

void TargetsOptions::validate() const {
  if (!(share > 0 && share <= 1))
    throw InputError("--share", "is out of range", "a share of the trials, more than 0, at most 1");
  require_threads(threads);
  for (const std::string& name : only) {
    const std::vector<TargetStudy> studies = target_studies({});
    const bool known = name == "seconds" || name == "drag" ||
                       std::ranges::find(studies, name, &TargetStudy::name) != studies.end();
    if (!known)
      throw InputError("--only", "there is no study '" + name + "'",
                       "tracks3d, one_camera, spoiled, clean, drag (or drag_1, drag_5, drag_20), "
                       "drag_fitted or seconds");
  }
}

std::vector<TargetStudy> target_studies(const TargetsOptions& options) {
  std::vector<TargetStudy> studies;
  RecoverOptions tracks3d = study_of(1000, options);
  tracks3d.start_factor = 5;
  studies.push_back(
      {"tracks3d", "3D tracks with 1 mm noise, starts off by a factor of 5", tracks3d});

  RecoverOptions one_camera = study_of(200, options);
  one_camera.fit.observations = ObservationKind::tracks2d;
  one_camera.scene.before_s = 0.25;
  studies.push_back({"one_camera", "one camera, 0.3 px, the cloth already swinging", one_camera});

  RecoverOptions spoiled = study_of(100, options);
  spoiled.start_factor = 2;
  spoiled.fit.loss = Loss::huber;
  spoiled.scene.missing = 0.2;
  spoiled.scene.hand = true;
  spoiled.scene.outliers = 0.05;
  studies.push_back({"spoiled", "observations missing, hidden by a hand and far off", spoiled});

  // The clean recordings have as many observations as the spoiled ones have good ones. The hand
  // hides a quarter of the cloth for a third of the time; 0.8 of the rest remain, and 0.95 of
  // these.
  RecoverOptions clean = study_of(100, options);
  clean.start_factor = 2;
  clean.scene.missing = 1 - 0.8 * (1 - 1.0 / 12) * 0.95;
  studies.push_back({"clean", "as many good observations", clean});

  for (const double sigmas : kDragSigmas)
    studies.push_back({.name = fmt::format("drag_{:g}", sigmas),
                       .what = fmt::format("drag of the air of {:g} of its sigmas that the fit "
                                           "does not know",
                                           sigmas),
                       .options = drag_study(sigmas, options),
                       .drag_sigmas = sigmas});
  RecoverOptions drag_fitted = drag_study(kDragSigmas.back(), options);
  drag_fitted.fit.effects = {"viscous_damping"};
  studies.push_back({"drag_fitted", "the largest of these drags, fitted too", drag_fitted});
  return studies;
}

FitSeconds measure_fits(unsigned long long seed) {
  const ThreadLimit one_core(1);
  constexpr int kBestOf = 3;
  const TargetsOptions options{.seed = seed};
  RecoverOptions study = study_of(1, options);
  const SyntheticRecording recording = make_synthetic_recording(study.scene, seed);
  const auto seconds_of = [&](FitOptions fit_options) {
    fit_options.threads = 1;
    double best = std::numeric_limits<double>::infinity();
    for (int n = 0; n < kBestOf; ++n) {
      const auto began = std::chrono::steady_clock::now();
      const FitReport report = fit(recording.input, fit_options, {});
      if (!report.usable()) return best;
      best = std::min(
          best, std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count());
    }
    return best;
  };
  FitSeconds seconds;
  FitOptions fit_options = study.fit;
  seconds.scratch_3d = seconds_of(fit_options);
  // A warm start is an earlier fit of such a cloth: a tenth off, to either side.
  fit_options.start.emplace();
  double off = 1.1;
  for (const auto& [name, value] : recording.truth) {
    if (name.find('.') != std::string::npos) continue;
    (*fit_options.start)[name] = value * off;
    off = 1 / off;
  }
  seconds.warm_3d = seconds_of(fit_options);
  fit_options.observations = ObservationKind::tracks2d;
  seconds.warm_2d = seconds_of(fit_options);
  fit_options.start.reset();
  seconds.scratch_2d = seconds_of(fit_options);
  return seconds;
}

TargetsResult measure_targets(const TargetsOptions& options, const std::filesystem::path& journals,
                              JournalStart start, const ProgressCallback& progress) {
  options.validate();
  const auto wanted = [&](const std::string& name) {
    return options.only.empty() || std::ranges::find(options.only, name) != options.only.end();
  };
  TargetsResult result;
  // This one is first, while nothing else runs.
  const bool timed = wanted("seconds");
  if (timed) result.seconds = measure_fits(options.seed);
  for (const TargetStudy& study : target_studies(options)) {
    if (!is_wanted(options, study)) continue;
    Journal journal(journals / (study.name + ".journal"), study.options.key(), start);
    const ProgressCallback named = [&](const Progress& now) {
      Progress of_study = now;
      of_study.stage = study.name;
      return !progress || progress(of_study);
    };
    RecoverResult found = recover(study.options, &journal, named);
    if (found.stop == ExecuteStop::cancelled) {
      result.cancelled = true;
      return result;
    }
    if (study.drag_sigmas > 0) {
      PlantedDrag drag{.sigmas = study.drag_sigmas, .pseudo = {}, .rows = {}};
      try {
        drag.pseudo = pseudo_truth(study.options, kPooledReleases, named);
      } catch (const StopRequested&) {
        result.cancelled = true;
        return result;
      }
      drag.rows = planted_drag_rows(found, drag.pseudo);
      result.planted_drag.push_back(std::move(drag));
    }
    result.studies.emplace_back(study, std::move(found));
  }
  if (wanted("tracks3d")) judge_tracks3d(result, result.rows);
  if (timed) judge_seconds(result.seconds, result.rows);
  for (const PlantedDrag& drag : result.planted_drag) judge_planted_drag(drag, result.rows);
  if (const RecoverResult* fitted = result_of(result, "drag_fitted"))
    judge_drag_fitted(*fitted, result.rows);
  if (wanted("one_camera")) judge_one_camera(result, result.rows);
  if (wanted("spoiled") && wanted("clean")) judge_spoiled(result, result.rows);
  return result;
}

}  // namespace clothfit
