#include "apps/study/trials/undeclared.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <utility>

#include "apps/study/scene/true_sight.h"
#include "apps/study/trials/study_key.h"
#include "apps/study/trials/undeclared_json.h"
#include "data/input_error.h"
#include "fit/diagnosis/hypothesis_derivatives.h"
#include "fit/jobs/draws.h"
#include "fit/jobs/stop_token.h"
#include "fit/jobs/thread_limit.h"
#include "fit/measurement_effects/registry.h"
#include "fit/problem/effects_of.h"

namespace clothfit {
namespace {

constexpr double kNothingHidden = std::numeric_limits<double>::quiet_NaN();
constexpr double kTold = 0.9;      ///< correlation of two hidden modes, below
constexpr int kWithheldDraws = 3;  ///< each asks for the derivatives of every mode
constexpr int kDraws = 20;  ///< draws of release, shape and direction, before a trial is given up
constexpr int kDirections = 20;  ///< draws of a mode's direction in one release
enum UndeclaredSeries : int { kPartner = 320, kReleases };

/// The hidden modes of a trial, with the release that shows them.
struct Setting {
  std::uint64_t release = 0;
  std::vector<DrawnMode> modes;
  std::vector<std::vector<std::string>> right;
  double mimicked = kNothingHidden;
};

/// Returns a trial's modes. The second of a pair is one of any other effect.
std::vector<HiddenMode> modes_of_trial(const UndeclaredOptions& options, int index,
                                       std::uint64_t seed) {
  if (options.hide == UndeclaredOptions::Hide::nothing) return {};
  const auto modes = static_cast<int>(options.modes.size());
  std::vector<HiddenMode> result{options.modes[static_cast<size_t>(index % modes)]};
  if (options.hide == UndeclaredOptions::Hide::pairs) {
    std::vector<HiddenMode> others;
    for (const HiddenMode& mode : options.modes)
      if (mode.effect != result.front().effect) others.push_back(mode);
    Draws draws(seed, kPartner, 0);
    result.push_back(others[static_cast<size_t>(draws.index(static_cast<int>(others.size())))]);
  }
  return result;
}

bool markers_stay_on_cloth(const UndeclaredOptions& options,
                           const RecordingInformation& information,
                           std::span<const DrawnMode> modes) {
  SyntheticScene scene = options.scene;
  for (const DrawnMode& drawn : modes) scene.hidden.push_back(hidden_effect(drawn));
  return HiddenMeasurement(scene, information.recording.input.recording).markers_stay_on_cloth();
}

/// Draws modes with numbers for one release. There is nothing where one of them cannot be seen in
/// it, or puts markers beside the cloth. `mimicked` is lowered to how well others mimic a withheld
/// one.
std::optional<Setting> draw_setting(const UndeclaredOptions& options,
                                    const std::vector<HiddenMode>& modes, std::uint64_t seed,
                                    std::uint64_t release_seed, Releases& releases,
                                    double& mimicked) {
  Setting setting{.release = release_seed, .modes = {}, .right = {}};
  if (modes.empty()) return setting;
  const std::shared_ptr<const Release> release = releases.at(release_seed);
  const RecordingInformation& information = release->information();
  std::vector<std::uint64_t> seeds;
  for (size_t n = 0; n < modes.size(); ++n) {
    // A pattern of markers that reaches the edges can shrink only: other directions are drawn
    // again.
    for (int k = 0; k < kDirections && setting.modes.size() == n; ++k) {
      seeds.resize(n);
      seeds.push_back(derived_seed(seed, static_cast<int>(n) + 2 * k));
      DrawnMode drawn = draw_mode(information, modes[n], options.draw, seeds.back());
      if (drawn.amplitude.size() == 0) return std::nullopt;
      if (markers_stay_on_cloth(options, information, {&drawn, 1}))
        setting.modes.push_back(std::move(drawn));
    }
    if (setting.modes.size() == n) return std::nullopt;
  }
  if (modes.size() == 2) {
    // Each has to be seen beside the other, so that the other's direction is nobody's evidence.
    const Eigen::VectorXd first = setting.modes[0].projected, second = setting.modes[1].projected;
    if (std::abs(first.dot(second)) > kTold) return std::nullopt;
    setting.modes[0] = draw_mode(information, modes[0], options.draw, seeds[0], second);
    setting.modes[1] = draw_mode(information, modes[1], options.draw, seeds[1], first);
    for (DrawnMode& drawn : setting.modes)
      if (drawn.amplitude.size() == 0) return std::nullopt;
    setting.modes[0].projected = first;
    setting.modes[1].projected = second;
  }
  if (!markers_stay_on_cloth(options, information, setting.modes)) return std::nullopt;
  for (const DrawnMode& drawn : setting.modes)
    setting.right.push_back(right_class(information, drawn, release->projected_modes()));
  if (options.hide == UndeclaredOptions::Hide::withheld) {
    setting.mimicked =
        mimicked_by_others(information, setting.modes.front(), release->projected_modes(),
                           options.diagnosis.most_effects);
    mimicked = std::fmin(mimicked, setting.mimicked);
    if (setting.mimicked >= options.most_mimicked) return std::nullopt;
  }
  return setting;
}

const ParameterEstimate* estimate_of(const FitResult& result, const std::string& effect,
                                     const std::string& parameter) {
  const auto nuisance =
      std::ranges::find(result.nuisance, effect + "." + parameter, &ParameterEstimate::name);
  if (nuisance != result.nuisance.end()) return &*nuisance;
  for (const EffectEstimate& of : result.effects) {
    const auto own = std::ranges::find(of.parameters, parameter, &ParameterEstimate::name);
    if (of.name == effect && own != of.parameters.end()) return &*own;
  }
  return nullptr;
}

/// Compares the amplitudes of a hidden mode, accepted at its own, with the truth. Their ratio is as
/// the recording sees them, by the derivatives at the found shape. So a wave's other sign half a
/// turn later is the same.
void compare_amplitudes(const RecordingInformation& information, const DrawnMode& drawn,
                        const FitResult& result, HiddenInTrial& hidden) {
  const EffectDescription effect = describe_effect(drawn.hypothesis.effect);
  Hypothesis found = drawn.hypothesis;
  for (auto& [name, value] : found.shape)
    if (const ParameterEstimate* estimate = estimate_of(result, found.effect, name))
      value = estimate->value;
  Eigen::VectorXd amount = Eigen::VectorXd::Zero(drawn.amplitude.size());
  for (Eigen::Index k = 0; k < amount.size(); ++k) {
    const std::string& name = drawn.hypothesis.amplitudes[static_cast<size_t>(k)];
    const ParameterEstimate* estimate = estimate_of(result, found.effect, name);
    if (estimate == nullptr || estimate->state == ParameterState::undetermined) continue;
    const double neutral =
        std::ranges::find(effect.parameters, name, &EffectParameter::name)->neutral;
    amount[k] = estimate->value - neutral;
    hidden.found.push_back({.name = found.effect + "." + name,
                            .truth = neutral + drawn.amplitude[k],
                            .estimate = estimate->value,
                            .sigma = estimate->sigma});
  }
  const std::array<Hypothesis, 2> terms{found, drawn.hypothesis};
  const std::vector<Columns> columns = hypothesis_derivatives(information.model, terms);
  if (hidden.found.empty() || columns[0].empty() || columns[1].empty()) return;
  const Eigen::VectorXd seen = information.projection.columns({columns[0].front() * amount});
  const Eigen::VectorXd truth =
      information.projection.columns({columns[1].front() * drawn.amplitude});
  hidden.amplitude_ratio = seen.dot(truth) / truth.squaredNorm();
  if (hidden.amplitude_ratio > 0 && amount.dot(drawn.amplitude) < 0)
    for (FoundAmplitude& one : hidden.found) {
      const std::string name = one.name.substr(found.effect.size() + 1);
      const double neutral =
          std::ranges::find(effect.parameters, name, &EffectParameter::name)->neutral;
      one.estimate = 2 * neutral - one.estimate;
    }
}

double held_out_rms(const FitReport& report) {
  return report.result.errors.empty() ? kNothingHidden : report.result.errors.front().held_out.rms;
}
double fitted_rms(const FitReport& report) {
  return report.result.errors.empty() ? kNothingHidden : report.result.errors.front().fitted.rms;
}

/// Returns the held-out error of a fit with the hidden modes and their shapes declared. It starts
/// from the truth, on the mesh that was analysed.
double error_with_truth(const FitInput& input, const UndeclaredOptions& options,
                        const std::vector<DrawnMode>& modes, const Diagnosis& diagnosis,
                        const std::map<std::string, double>& truth) {
  FitOptions told = options.diagnosis.fit;
  told.mesh_columns = diagnosis.columns;
  told.mesh_rows = diagnosis.rows;
  told.start = diagnosis.base().values;
  for (auto& [name, value] : *told.start)
    if (const auto known = truth.find(name); known != truth.end()) value = known->second;
  std::vector<Hypothesis> terms;
  for (const DrawnMode& drawn : modes) {
    terms.push_back(drawn.hypothesis);
    const HiddenEffect hidden = hidden_effect(drawn);
    const EffectDescription effect = describe_effect(hidden.name);
    for (size_t p = 0; p < effect.parameters.size(); ++p) {
      const std::string& name = effect.parameters[p].name;
      const auto& amplitudes = drawn.hypothesis.amplitudes;
      if (std::ranges::find(amplitudes, name) != amplitudes.end())
        (*told.start)[hidden.name + "." + name] = hidden.values[p];
    }
  }
  told.hypotheses = terms;
  const FitReport report = fit(input, told, {});
  if (report.stop == FitStop::cancelled) throw StopRequested();
  return report.usable() ? held_out_rms(report) : kNothingHidden;
}

/// Says of each hidden mode whether an accepted effect is right about it: one that stands for no
/// other.
void name_hidden(UndeclaredTrial& trial) {
  std::vector<bool> used(trial.accepted_effects.size(), false);
  for (HiddenInTrial& hidden : trial.hidden) {
    // Its own name comes first, so that a member of two classes is left to the other one.
    for (const bool own : {true, false})
      for (size_t k = 0; k < used.size() && !hidden.named; ++k) {
        const std::string& effect = trial.accepted_effects[k];
        const bool counts = own ? effect == hidden.mode.effect
                                : std::ranges::find(hidden.right, effect) != hidden.right.end();
        if (!used[k] && counts) used[k] = hidden.named = true;
      }
  }
}

double seconds_since(std::chrono::steady_clock::time_point began) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
}

}  // namespace

std::string to_string(UndeclaredOptions::Hide hide) {
  switch (hide) {
    case UndeclaredOptions::Hide::one:
      return "one";
    case UndeclaredOptions::Hide::nothing:
      return "nothing";
    case UndeclaredOptions::Hide::pairs:
      return "pairs";
    case UndeclaredOptions::Hide::withheld:
      return "withheld";
  }
  return "";
}

int UndeclaredOptions::count() const {
  return hide == Hide::nothing ? trials : trials * static_cast<int>(modes.size());
}

void UndeclaredOptions::validate() const {
  scene.validate();
  diagnosis.validate();
  const auto require = [](bool good, const char* option, const char* expected) {
    if (!good) throw InputError(option, "is out of range", expected);
  };
  require(trials >= 1 && trials <= kMostTrials, "--trials", "1 to 1000000");
  require_threads(threads);
  require(most_mimicked > 0 && most_mimicked <= 1, "--mimicked", "a share, to 1");
  require(draw.least > 0 && draw.least <= draw.most && draw.most <= 1e9, "--least-sigmas",
          "rising, more than 0");
  require(diagnosis.fit.mesh_columns >= 3 && diagnosis.fit.mesh_columns == diagnosis.fit.mesh_rows,
          "--mesh", "at least 3 vertices a side");
  require(scene.held_out_from > 0, "--fitted", "frames to judge by");
  if (hide == Hide::nothing) return;
  require(!modes.empty(), "--hidden", "an effect");
  const bool of_pixels = diagnosis.fit.observations == ObservationKind::tracks2d;
  for (const HiddenMode& mode : modes) {
    const MeasurementEffectEntry* entry = measurement_effect_named(mode.effect);
    if (entry != nullptr && entry->make()->needs_camera() && !of_pixels)
      throw InputError("--hidden", mode.effect + " says nothing of 3D tracks",
                       "an effect that they show", "add --observations tracks2d");
  }
  if (hide == Hide::pairs)
    require(std::ranges::any_of(
                modes, [&](const HiddenMode& mode) { return mode.effect != modes.front().effect; }),
            "--hidden", "two effects or more, for pairs");
}

std::string UndeclaredOptions::key() const {
  std::string hidden;
  if (hide != Hide::nothing)
    for (const HiddenMode& mode : modes) hidden += (hidden.empty() ? "" : ", ") + mode.title();
  JournalKey key("undeclared/5");
  key.add("seed", seed).add("hide", to_string(hide)).add("hidden", hidden);
  key.add("most_mimicked", most_mimicked);
  key.add("least_sigmas", draw.least).add("most_sigmas", draw.most);
  add_fields(scene, key);
  add_fields(diagnosis.fit, key);
  key.add("work", diagnosis.fit.work);
  key.add("lines", diagnosis.beam_width).add("refits", diagnosis.refits);
  key.add("most_effects", diagnosis.most_effects);
  key.add("without", fmt::format("{}", fmt::join(diagnosis.without, ", ")));
  return key.line();
}

bool UndeclaredTrial::right_first() const {
  if (hidden.empty()) return accepted.empty();
  return !accepted_effects.empty() && std::ranges::any_of(hidden, [&](const HiddenInTrial& mode) {
    return std::ranges::find(mode.right, accepted_effects.front()) != mode.right.end();
  });
}

bool UndeclaredTrial::all_named() const {
  return std::ranges::all_of(hidden, &HiddenInTrial::named);
}

UndeclaredTrial undeclared_once(const UndeclaredOptions& options, int index, std::uint64_t seed,
                                Releases& releases) {
  const auto began = std::chrono::steady_clock::now();
  UndeclaredTrial trial{.before = kNothingHidden,
                        .after = kNothingHidden,
                        .with_truth = kNothingHidden,
                        .noise = kNothingHidden,
                        .with_law = kNothingHidden};
  const std::vector<HiddenMode> modes = modes_of_trial(options, index, seed);
  for (const HiddenMode& mode : modes) trial.hidden.push_back({.mode = mode});
  std::optional<Setting> setting;
  const int round = modes.empty() ? index : index / static_cast<int>(options.modes.size());
  const bool withheld = options.hide == UndeclaredOptions::Hide::withheld;
  trial.mimicked = kNothingHidden;
  for (int n = 0; n < (withheld ? kWithheldDraws : kDraws) && !setting; ++n)
    setting = draw_setting(options, modes, derived_seed(seed, n),
                           derived_seed(derived_seed(options.seed, kReleases), kDraws * round + n),
                           releases, trial.mimicked);
  if (!setting) {
    trial.refused = std::isfinite(trial.mimicked)
                        ? fmt::format("others mimic it, R2 at least {:.3f}", trial.mimicked)
                        : "not seen within its bounds, or beside the cloth";
    return trial;
  }
  trial.mimicked = setting->mimicked;
  SyntheticScene scene = options.scene;
  for (size_t n = 0; n < modes.size(); ++n) {
    const DrawnMode& drawn = setting->modes[n];
    scene.hidden.push_back(hidden_effect(drawn));
    trial.hidden[n].shape = drawn.hypothesis.shape;
    trial.hidden[n].sigmas = drawn.sigmas;
    trial.hidden[n].right = setting->right[n];
    trial.hidden[n].amplitude_ratio = kNothingHidden;
  }
  const SyntheticRecording recording = make_synthetic_recording(scene, setting->release, seed);
  trial.drawing_seconds = seconds_since(began);

  UndeclaredOptions own = options;
  own.diagnosis.fit.seed = seed;
  own.diagnosis.fit.threads = 1;  // trials run side by side
  own.diagnosis.separate = false;
  if (withheld)
    own.diagnosis.without.push_back(modes.front().effect);
  else
    own.diagnosis.law_terms = 0;  // nobody asks for it where the hidden effect is known
  const auto diagnosis_began = std::chrono::steady_clock::now();
  const Diagnosis diagnosis = diagnose(recording.input, own.diagnosis, {});
  if (diagnosis.stop == FitStop::cancelled) throw StopRequested();
  trial.seconds = seconds_since(diagnosis_began);
  trial.stop = diagnosis.stop;
  trial.message = diagnosis.message;
  if (!diagnosis.usable()) return trial;
  trial.verdict = diagnosis.verdict;
  // This is never right: no trial hides such a thing.
  if (diagnosis.seen_elsewhere) {
    trial.accepted.push_back("markers seen elsewhere");
    trial.accepted_effects.push_back("markers seen elsewhere");
  }
  for (const AcceptedEffect& accepted : diagnosis.accepted) {
    trial.accepted.push_back(accepted.trial.hypothesis.title());
    trial.accepted_effects.push_back(accepted.trial.hypothesis.effect);
  }
  name_hidden(trial);
  trial.before = held_out_rms(diagnosis.base());
  trial.after = held_out_rms(diagnosis.found());
  if (diagnosis.law.found()) trial.with_law = held_out_rms(diagnosis.with_law());
  trial.before_fitted = fitted_rms(diagnosis.base());
  trial.after_fitted = fitted_rms(diagnosis.found());
  trial.noise = diagnosis.base().result.errors.front().noise;
  for (size_t n = 0; n < modes.size(); ++n) {
    const bool same_mode =
        std::ranges::find(trial.accepted, setting->modes[n].hypothesis.title()) !=
        trial.accepted.end();
    if (same_mode)
      compare_amplitudes(releases.at(setting->release)->information(), setting->modes[n],
                         diagnosis.found().result, trial.hidden[n]);
  }
  if (!modes.empty())
    trial.with_truth =
        error_with_truth(recording.input, own, setting->modes, diagnosis, recording.truth);
  return trial;
}

UndeclaredResult recover_undeclared(const UndeclaredOptions& options, Journal* journal,
                                    const ProgressCallback& progress) {
  options.validate();
  Releases releases(options.scene, options.diagnosis.fit);
  const Work work = [&](int index, std::uint64_t seed) {
    return payload_of(undeclared_once(options, index, seed, releases));
  };
  const ExecuteResult executed =
      execute(options.count(), work,
              {.threads = options.threads,
               .seed = options.seed,
               .accept = [](int, const std::string& payload) { undeclared_trial_of(payload); }},
              journal, progress);
  UndeclaredResult result{.stop = executed.stop, .message = executed.message, .trials = {}};
  for (const std::string& payload : executed.payloads)
    result.trials.push_back(undeclared_trial_of(payload));
  return result;
}

}  // namespace clothfit
