#include "apps/study/trials/recover.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "apps/study/trials/json_number.h"
#include "apps/study/trials/study_key.h"
#include "data/algebra/dense_factors.h"
#include "data/input_error.h"
#include "data/median.h"
#include "fit/cost/objective.h"
#include "fit/jobs/draws.h"
#include "fit/jobs/stop_token.h"
#include "fit/jobs/thread_limit.h"
#include "fit/problem/parameterised_model.h"
#include "fit/problem/prior_cost.h"
#include "fit/problem/problem.h"
#include "fit/uncertainty/cluster_covariance.h"
#include "model/cloth/stability.h"

namespace clothfit {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
enum RecoverSeries : int { kStart = 100 };

Json json_of(const TrackerErrors& tracker) {
  return {{"pictures", tracker.pictures},
          {"shown", tracker.shown},
          {"accepted", tracker.accepted},
          {"rejected", tracker.rejected},
          {"squared_error_px2", tracker.squared_error_px2},
          {"stated_variance_px2", tracker.stated_variance_px2},
          {"chi_squared", tracker.chi_squared},
          {"beyond_5_sigma", tracker.beyond_5_sigma}};
}

TrackerErrors tracker_errors_of(const Json& json) {
  return {.pictures = json.at("pictures"),
          .shown = json.at("shown"),
          .accepted = json.at("accepted"),
          .rejected = json.at("rejected").get<std::map<std::string, int>>(),
          .squared_error_px2 = json.at("squared_error_px2"),
          .stated_variance_px2 = json.at("stated_variance_px2"),
          .chi_squared = json.at("chi_squared"),
          .beyond_5_sigma = json.at("beyond_5_sigma")};
}

std::string payload_of(const RecoverTrial& trial) {
  Json json{{"stop", static_cast<int>(trial.stop)},
            {"message", trial.message},
            {"rejected", trial.rejected},
            {"seconds", trial.seconds}};
  Json& parameters = json["parameters"] = Json::array();
  for (const RecoveredParameter& p : trial.parameters)
    parameters.push_back({p.name, json_number(p.truth), json_number(p.estimate),
                          json_number(p.sigma), json_number(p.noise_sigma),
                          json_number(p.robust_sigma), json_number(p.bound_sigma), p.undetermined,
                          json_number(p.degrees_of_freedom), json_number(p.interval_90.lower),
                          json_number(p.interval_90.upper)});
  if (trial.tracker) json["tracker"] = json_of(*trial.tracker);
  return json.dump();
}

RecoverTrial trial_of(const std::string& payload) {
  const Json json = Json::parse(payload);
  RecoverTrial trial{.stop = choice_of_json(json.at("stop"), FitStop::diverged),
                     .message = json.at("message"),
                     .parameters = {},
                     .rejected = json.at("rejected"),
                     .tracker = std::nullopt,
                     .seconds = json.at("seconds")};
  if (json.contains("tracker")) trial.tracker = tracker_errors_of(json.at("tracker"));
  for (const Json& p : json.at("parameters"))
    trial.parameters.push_back({.name = p.at(0),
                                .truth = number_of_json(p.at(1)),
                                .estimate = number_of_json(p.at(2)),
                                .sigma = number_of_json(p.at(3)),
                                .noise_sigma = number_of_json(p.at(4)),
                                .robust_sigma = number_of_json(p.at(5)),
                                .degrees_of_freedom = p.at(8).is_null()
                                                          ? std::numeric_limits<double>::infinity()
                                                          : p.at(8).get<double>(),
                                .interval_90 = {number_of_json(p.at(9)), number_of_json(p.at(10))},
                                .bound_sigma = number_of_json(p.at(6)),
                                .undetermined = p.at(7)});
  return trial;
}

bool has_fit(const RecoverTrial& trial) {
  return trial.stop == FitStop::converged || trial.stop == FitStop::reached_limit;
}

double mean_of(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return values.empty() ? kNone : sum / static_cast<double>(values.size());
}

double deviation_of(const std::vector<double>& values) {
  if (values.size() < 2) return kNone;
  const double mean = mean_of(values);
  double sum = 0;
  for (const double value : values) sum += (value - mean) * (value - mean);
  return std::sqrt(sum / static_cast<double>(values.size() - 1));
}

double share_within(const std::vector<double>& pulls, double limit) {
  if (pulls.empty()) return kNone;
  const auto within = std::ranges::count_if(pulls, [&](double z) { return std::abs(z) <= limit; });
  return static_cast<double>(within) / static_cast<double>(pulls.size());
}

RecoverySummary summary_of(const std::string& name, const std::vector<RecoverTrial>& trials) {
  constexpr double kNormal95 = 1.959964;
  RecoverySummary summary{.name = name};
  std::vector<double> relative, by_bound, by_noise;
  for (const RecoverTrial& trial : trials) {
    const auto p = std::ranges::find(trial.parameters, name, &RecoveredParameter::name);
    if (p == trial.parameters.end()) continue;
    summary.truth = p->truth;
    ++summary.trials;
    if (p->undetermined) {
      ++summary.undetermined;
      continue;
    }
    const double error = p->estimate - p->truth;
    relative.push_back(error / p->truth);
    if (std::isfinite(p->bound_sigma)) by_bound.push_back(error / p->bound_sigma);
    by_noise.push_back(error / p->noise_sigma);
  }
  if (relative.empty()) return summary;
  summary.bias = mean_of(relative);
  summary.spread = deviation_of(relative);
  std::vector<double> squares, sizes;
  for (const double error : relative) {
    squares.push_back(error * error);
    sizes.push_back(std::abs(error));
  }
  summary.rms = std::sqrt(mean_of(squares));
  std::ranges::sort(sizes);
  const auto last = static_cast<double>(sizes.size() - 1);
  summary.percentile_95 = sizes[static_cast<size_t>(std::lround(0.95 * last))];
  summary.spread_over_bound = deviation_of(by_bound);
  summary.bias_over_bound = mean_of(by_bound);
  summary.coverage_95 = share_within(by_noise, kNormal95);
  summary.holds_truth = coverage_90(trials, name, summary.truth);
  return summary;
}

}  // namespace

void RecoverOptions::validate() const {
  scene.validate();
  fit.validate();
  if (pictures) {
    pictures->validate(scene);
    if (fit.observations == ObservationKind::tracks3d)
      throw InputError("--observations", "tracks3d cannot be had from pictures", "tracks2d",
                       "leave it out beside --render");
  }
  if (trials < 1 || trials > kMostTrials)
    throw InputError("--trials", "is out of range", fmt::format("1 to {}", kMostTrials));
  if (start_factor != 0 && !(start_factor >= 1 && start_factor <= 1e6))
    throw InputError("--start-factor", "is out of range", "1 to 1e6, or 0 for a search");
  require_threads(threads);
}

std::string RecoverOptions::key() const {
  JournalKey key("recover/3");
  key.add("seed", seed).add("start_factor", start_factor);
  key.add("effects", fmt::format("{}", fmt::join(fit.effects, ", ")));
  add_fields(scene, key);
  add_fields(fit, key);
  if (!pictures) return key.line();
  key.add("tags", pictures->tags).add("width_px", pictures->width_px);
  key.add("height_px", pictures->height_px).add("exposure_s", pictures->exposure_s);
  key.add("instants", pictures->instants).add("samples", pictures->samples);
  key.add("blur_px", pictures->blur_px).add("noise_levels", pictures->noise_levels);
  key.add("shot_levels", pictures->shot_levels);
  return key.line();
}

FitProblem problem_of(const SyntheticRecording& recording, const FitOptions& options) {
  const ClothDescription& cloth = recording.input.recording.cloth;
  return make_problem(recording.input, options,
                      options.mesh_columns > 0 ? options.mesh_columns : cloth.mesh_columns,
                      options.mesh_rows > 0 ? options.mesh_rows : cloth.mesh_rows);
}

std::map<std::string, double> bound_sigmas(const SyntheticRecording& recording,
                                           const FitOptions& options) {
  const FitProblem problem = problem_of(recording, options);
  Eigen::VectorXd values = problem.space.start();
  for (int p = 0; p < problem.space.size(); ++p) {
    const auto known = recording.truth.find(problem.space.parameters[static_cast<size_t>(p)].name);
    if (known != recording.truth.end()) values[p] = known->second;
  }
  const double stable_s = stable_time_step_s(problem.cloth, parameter_set(problem, values));
  const TrajectoryObjective objective(problem, problem.first_held_out, stable_s / 1.5);
  const Linearisation linear = objective.linearise(values);
  std::map<std::string, double> result;
  if (!linear.usable) return result;
  const Eigen::VectorXd slope = problem.space.value_by_coordinate(values);
  const Eigen::MatrixXd information =
      linear.residual_by_coordinate.transpose() * linear.residual_by_coordinate +
      prior_cost(problem, values).information;
  const Eigen::MatrixXd covariance =
      SymmetricFactors(information).solve(Eigen::MatrixXd::Identity(slope.size(), slope.size()));
  for (int p = 0; p < problem.space.size(); ++p)
    result[problem.space.parameters[static_cast<size_t>(p)].name] =
        std::sqrt(covariance(p, p)) * slope[p];
  return result;
}

Coverage90 coverage_90(const std::vector<RecoverTrial>& trials, const std::string& parameter,
                       double value) {
  const double normal = student_factor(0.9, std::numeric_limits<double>::infinity());
  int plain = 0, robust = 0, stated = 0, count = 0;
  for (const RecoverTrial& trial : trials) {
    const auto p = std::ranges::find(trial.parameters, parameter, &RecoveredParameter::name);
    if (p == trial.parameters.end() || p->undetermined) continue;
    ++count;
    const double error = std::abs(p->estimate - value);
    if (error <= normal * p->noise_sigma) ++plain;
    if (error <= student_factor(0.9, p->degrees_of_freedom) * p->robust_sigma) ++robust;
    if (p->interval_90.lower <= value && value <= p->interval_90.upper) ++stated;
  }
  const auto share = [&](int held) {
    return count > 0 ? held / static_cast<double>(count) : kNone;
  };
  return {.plain = share(plain), .robust = share(robust), .stated = share(stated)};
}

RecoverTrial recover_once(const RecoverOptions& options, int, std::uint64_t seed) {
  const auto began = std::chrono::steady_clock::now();
  std::optional<TrackerErrors> tracker;
  const auto without_a_fit = [&](const std::string& why) {
    return RecoverTrial{
        .stop = FitStop::diverged, .message = why, .parameters = {}, .tracker = tracker};
  };
  SyntheticRecording recording;
  if (options.pictures) {
    try {
      RenderedRecording rendered = make_rendered_recording(options.scene, *options.pictures, seed);
      tracker = rendered.tracker;
      recording = std::move(rendered.recording);
    } catch (const InputError& nothing_seen) {
      return without_a_fit(nothing_seen.what());
    }
    if (tracker->accepted == 0) return without_a_fit("the tracker stands by no marker");
  } else {
    recording = make_synthetic_recording(options.scene, seed);
  }
  FitOptions fit_options = options.fit;
  fit_options.seed = seed;
  fit_options.threads = 1;  // trials run side by side
  if (options.start_factor > 0) {
    fit_options.start.emplace();
    int place = 0;
    for (const auto& [name, value] : recording.truth) {
      if (name.starts_with("viscous_damping")) continue;
      Draws draws(seed, kStart, place++);
      const bool above = draws.uniform() < 0.5;
      (*fit_options.start)[name] =
          above ? value * options.start_factor : value / options.start_factor;
    }
  }
  const FitReport report = fit(recording.input, fit_options, {});
  if (report.stop == FitStop::cancelled) throw StopRequested();
  RecoverTrial trial{.stop = report.stop, .message = report.message, .tracker = tracker};
  for (const auto& [reason, count] : report.result.observations_rejected) trial.rejected += count;
  if (report.usable()) {
    const std::map<std::string, double> bound = bound_sigmas(recording, fit_options);
    for (const FitReport::SigmaParts& parts : report.sigma_parts) {
      const auto known = recording.truth.find(parts.name);
      if (known == recording.truth.end()) continue;
      RecoveredParameter parameter{.name = parts.name,
                                   .truth = known->second,
                                   .estimate = parts.value,
                                   .noise_sigma = parts.noise,
                                   .robust_sigma = parts.robust,
                                   .degrees_of_freedom = parts.degrees_of_freedom,
                                   .interval_90 = parts.interval_90,
                                   .bound_sigma = kNone};
      if (const auto sigma = bound.find(parts.name); sigma != bound.end())
        parameter.bound_sigma = sigma->second;
      const auto look_in = [&](const std::vector<ParameterEstimate>& list,
                               const std::string& name) {
        const auto found = std::ranges::find(list, name, &ParameterEstimate::name);
        if (found == list.end()) return;
        parameter.sigma = found->sigma;
        parameter.undetermined = found->state == ParameterState::undetermined;
      };
      look_in(report.result.parameters, parts.name);
      for (const EffectEstimate& effect : report.result.effects)
        if (parts.name.starts_with(effect.name + "."))
          look_in(effect.parameters, parts.name.substr(effect.name.size() + 1));
      trial.parameters.push_back(parameter);
    }
  }
  trial.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  return trial;
}

RecoverResult recover(const RecoverOptions& options, Journal* journal,
                      const ProgressCallback& progress) {
  options.validate();
  const Work work = [&](int index, std::uint64_t seed) {
    return payload_of(recover_once(options, index, seed));
  };
  const ExecuteResult executed =
      execute(options.trials, work,
              {.threads = options.threads,
               .seed = options.seed,
               .accept = [](int, const std::string& payload) { trial_of(payload); }},
              journal, progress);
  RecoverResult result{.stop = executed.stop, .message = executed.message};
  for (const std::string& payload : executed.payloads) result.trials.push_back(trial_of(payload));
  summarise_trials(result);
  return result;
}

void summarise_trials(RecoverResult& result) {
  constexpr double kWrongBounds = 10;
  std::vector<std::string> names;
  std::vector<double> seconds;
  for (const RecoverTrial& trial : result.trials) {
    seconds.push_back(trial.seconds);
    if (trial.tracker) {
      if (!result.tracker) result.tracker.emplace();
      result.tracker->add(*trial.tracker);
    }
    if (!has_fit(trial)) {
      ++result.failures;
      continue;
    }
    if (trial.stop != FitStop::converged) ++result.unconverged;
    bool wrong = false;
    for (const RecoveredParameter& p : trial.parameters) {
      if (std::ranges::find(names, p.name) == names.end()) names.push_back(p.name);
      wrong = wrong || !(std::abs(p.estimate - p.truth) <= kWrongBounds * p.bound_sigma);
    }
    if (wrong) ++result.wrong;
    if (!wrong && trial.stop == FitStop::converged) ++result.good;
  }
  for (const std::string& name : names)
    result.parameters.push_back(summary_of(name, result.trials));
  if (seconds.empty()) return;
  result.longest_seconds = std::ranges::max(seconds);
  result.median_seconds = median(seconds);
}

}  // namespace clothfit
