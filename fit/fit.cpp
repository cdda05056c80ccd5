#include "fit/fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "data/input_error.h"
#include "fit/affordable.h"
#include "fit/cost/report_residuals.h"
#include "fit/identify.h"
#include "fit/jobs/stop_token.h"
#include "fit/jobs/thread_limit.h"
#include "fit/observe/cloud_errors.h"
#include "fit/observe/marker_offsets.h"
#include "fit/problem/fitted_tilt.h"
#include "fit/problem/mesh_ladder.h"
#include "fit/problem/parameterised_model.h"
#include "fit/problem/predictor.h"
#include "fit/problem/problem.h"
#include "fit/problem/simulation.h"
#include "fit/problem/springs_on_limit.h"
#include "fit/uncertainty/parameter_estimates.h"
#include "fit/uncertainty/uncertainty.h"
#include "fit/verdict/contradicted_pose.h"
#include "fit/verdict/contradicting.h"
#include "model/cloth/stability.h"

namespace clothfit {
namespace {

/// Profiles and the fit on another mesh, where the options ask for them, each with its line in the
/// report.
FurtherLooks look_further(const FitInput& input, const TrajectoryObjective& objective,
                          const FitOptions& options, const Eigen::VectorXd& values,
                          const Uncertainty& uncertainty, const ProgressCallback& progress,
                          FitReport& report) {
  const FitProblem& problem = objective.problem();
  FurtherLooks looks;
  if (options.profile) {
    looks.profiles = parameter_profiles(objective, values, uncertainty, options.loss, progress);
    for (const ParameterProfile& profile : looks.profiles) {
      const std::string& name =
          problem.space.parameters[static_cast<size_t>(profile.parameter)].name;
      const std::string ends =
          profile.profiled
              ? fmt::format("profiled: {:.4g} to {:.4g}{}", profile.lower, profile.upper,
                            profile.profile.optimum_was_none
                                ? "; lower costs than the optimum's were met"
                                : "")
              : "a parabola";
      report.stages.push_back(fmt::format(
          "{}: at the ends of its interval the cost rises {:.2f} and {:.2f} times as far as a "
          "parabola; {}",
          name, profile.rise_below, profile.rise_above, ends));
    }
  }
  if (options.two_meshes) {
    const Mesh& mesh = problem.cloth.mesh;
    const int least = problem.start == StartKind::unknown
                          ? std::max(kSmallestMesh, vertices_for_start(options.start_nodes))
                          : kSmallestMesh;
    const auto [columns, rows] = other_mesh_of(mesh.columns, mesh.rows, least);
    const FitProblem other = make_problem(input, options, columns, rows);
    looks.other_mesh = fit_on_other_mesh(other, values, final_refinement(other, options), progress);
    report.stages.push_back(fmt::format("the fit again on {} x {}, for the mesh's share: {}",
                                        looks.other_mesh.columns, looks.other_mesh.rows,
                                        looks.other_mesh.message));
  }
  return looks;
}

/// Fills in the correlation of all parameters that reports list.
void fill_correlation(const ParameterSpace& space, const Uncertainty& uncertainty,
                      FitReport& report) {
  std::vector<int> shown;
  for (int p = 0; p < space.size(); ++p) {
    if (!is_listed(space.parameters[static_cast<size_t>(p)].role)) continue;
    shown.push_back(p);
    report.correlation_names.push_back(space.parameters[static_cast<size_t>(p)].name);
  }
  report.correlation = uncertainty.correlation(shown, shown);
}

/// Reports what the physics' sigmas are made of, and the residuals that all were made from.
void add_uncertainty(const FitProblem& problem, const Eigen::VectorXd& values,
                     const Uncertainty& uncertainty, FitReport& report) {
  for (int p = 0; p < problem.space.size(); ++p) {
    const FitParameter& parameter = problem.space.parameters[static_cast<size_t>(p)];
    if (!is_physical(parameter.role)) continue;
    report.sigma_parts.push_back(
        {.name = parameter.name,
         .value = values[p],
         .noise = uncertainty.noise_sigma[p],
         .robust = uncertainty.robust_sigma[p],
         .step_shift = uncertainty.step_shift[p],
         .degrees_of_freedom = uncertainty.degrees_of_freedom[p],
         .interval_90 = {.lower = uncertainty.lower[p], .upper = uncertainty.upper[p]}});
  }
  const BlockCounts& counts = uncertainty.block_counts;
  const std::string blocks =
      uncertainty.blocks > 0
          ? fmt::format("sigma over {} blocks ({} along s, {} along t, {} in time)",
                        uncertainty.blocks, counts.along_s, counts.along_t, counts.in_time)
          : "sigma of independent residuals alone: " + uncertainty.why_no_blocks;
  report.stages.push_back(fmt::format("chi-square per degree of freedom {:.3g}; {}",
                                      uncertainty.chi_square_per_dof, blocks));
}

/// Columns and rows: as asked for, or of the earlier fit of a forecast, whose parameters are those
/// of the cloth on its mesh, or as the recording suggests. Natural lengths are of one mesh alone.
std::pair<int, int> mesh_of(const ClothDescription& cloth, const FitOptions& options) {
  std::pair<int, int> suggested{cloth.mesh_columns, cloth.mesh_rows};
  const bool of_one_mesh = options.forecast && options.spring_set != SpringSet::fabric;
  if (options.forecast) suggested = {options.forecast->mesh_columns, options.forecast->mesh_rows};
  const std::pair<int, int> mesh{options.mesh_columns > 0 ? options.mesh_columns : suggested.first,
                                 options.mesh_rows > 0 ? options.mesh_rows : suggested.second};
  if (of_one_mesh && mesh != suggested)
    throw InputError("FitOptions::mesh_columns",
                     "the natural lengths of the earlier fit are those of its own mesh",
                     fmt::format("{}x{}", suggested.first, suggested.second), "leave it out");
  return mesh;
}

/// Constants that predictions of the markers get, 3 x markers, with their part of the report: those
/// known of markers of such names, or else what the fitted frames ask for. None where there are
/// none.
Eigen::Matrix3Xd marker_offsets(const FitProblem& problem, const MarkerSet& markers,
                                const std::vector<MarkerOffset>& known, const Predictor& predictor,
                                const MarkerRun& run, FitReport& report) {
  const auto count = static_cast<Eigen::Index>(markers.markers.size());
  Eigen::Matrix3Xd offset_m;
  if (!known.empty()) {
    offset_m = Eigen::Matrix3Xd::Zero(3, count);
    for (const MarkerOffset& offset : known)
      if (const auto found = markers.index.find(offset.marker); found != markers.index.end())
        offset_m.col(found->second) = offset.offset_m;
  } else if (problem.marker_offset_sigma_m > 0) {
    const ObservationSet& set = problem.observations.front();
    std::vector<Eigen::Matrix3Xd> predicted = run.position_m;
    for (const Observation& row : set.rows)
      predicted[static_cast<size_t>(row.frame)].col(row.marker) = *predictor.predict(0, row, run);
    offset_m =
        estimate_offsets(set, predicted, problem.first_held_out, problem.marker_offset_sigma_m);
  } else {
    return {};
  }
  Eigen::Index furthest = 0;
  const double most_m = offset_m.colwise().norm().maxCoeff(&furthest);
  report.stages.push_back(
      fmt::format("offsets of markers{}: {:.2g} mm rms, at most {:.2g} mm (marker {})",
                  known.empty() ? "" : " of an earlier fit",
                  1e3 * std::sqrt(offset_m.squaredNorm() / static_cast<double>(count)),
                  1e3 * most_m, markers.markers[static_cast<size_t>(furthest)].name));
  report.result.marker_offset_sigma_m = known.empty() ? problem.marker_offset_sigma_m : 0;
  for (Eigen::Index m = 0; m < count; ++m)
    if (!offset_m.col(m).isZero(0))
      report.result.marker_offsets.push_back(
          {.marker = markers.markers[static_cast<size_t>(m)].name, .offset_m = offset_m.col(m)});
  return offset_m;
}

/// Tells what the fit made of the drive's noise, as a line of the report.
std::string drive_line(const FitProblem& problem, const Eigen::VectorXd& values) {
  const DriveCorrection& correction = problem.drive_correction;
  const std::vector<double> fitted(problem.frame_time_s.begin(),
                                   problem.frame_time_s.begin() + problem.first_held_out);
  return fmt::format(
      "drive corrected at {} knots for each of {} tracked points: {:.2g} mm rms per coordinate "
      "over the fitted frames, {:.2g} mm predicted from the tracks' noise",
      correction.knots(), correction.points.size(),
      1e3 * rms_correction_m(correction, values, fitted), 1e3 * correction.prior_rms_m);
}

FitReport stopped(FitReport report, FitStop stop, const std::string& message) {
  report.stop = stop;
  report.message = message;
  return report;
}

/// A report with what a recording's problem says before anything is fitted.
FitReport report_of(const FitInput& input, const FitProblem& problem, const FitOptions& options) {
  FitReport report;
  FitResult& result = report.result;
  result.recording = input.recording.name;
  result.seed = options.seed;
  result.mesh_columns = problem.cloth.mesh.columns;
  result.mesh_rows = problem.cloth.mesh.rows;
  result.parameter_set = to_string(problem.spring_set);
  result.integrator = "euler";
  result.start = to_string(problem.start);
  result.observations_rejected = problem.rejected;
  if (const auto why = why_readout_is_not_used(problem))
    report.stages.push_back("the cameras' readout_time is not used: there is " + *why);
  return report;
}

/// As stability asks where nothing was fitted.
double own_time_step_s(const FitProblem& problem, const FitOptions& options,
                       const Eigen::VectorXd& values) {
  const RefineOptions defaults;
  return stable_time_step_s(problem.cloth, parameter_set(problem, values)) /
         (defaults.stability_margin * options.substep_scale);
}

/// Runs the model on through all frames and fills in what it leaves of them.
void run_on(const FitInput& input, const FitProblem& problem, const FitOptions& options,
            const Eigen::VectorXd& values, const Uncertainty& uncertainty,
            const std::vector<MarkerOffset>& known_offsets, const FurtherLooks& looks,
            FitReport& report) {
  FitResult& result = report.result;
  if (!problem.drive_correction.points.empty())
    report.stages.push_back(drive_line(problem, values));
  Predictor predictor(problem, values);
  const SimulateResult run =
      std::move(run_model(problem, {values}, problem.frames(),
                          time_steps_of_run(problem.cloth, parameter_set(problem, values),
                                            result.time_step_s),
                          predictor.needs_velocities())
                    .front());
  if (!run.usable()) {
    report.stop = FitStop::diverged;
    report.message = "the model diverged when it was run on through all frames";
    return;
  }
  double longest_frame_s = 0;
  for (size_t f = 1; f < problem.frame_time_s.size(); ++f)
    longest_frame_s =
        std::max(longest_frame_s, problem.frame_time_s[f] - problem.frame_time_s[f - 1]);
  result.substeps = static_cast<int>(std::ceil(longest_frame_s / result.time_step_s - 1e-9));
  for (int p = 0; p < problem.space.size(); ++p)
    report.values[problem.space.parameters[static_cast<size_t>(p)].name] = values[p];
  fill_parameters(problem, options, values, uncertainty, looks, result);
  const std::vector<Eigen::Matrix3Xd> fitted_frames(
      run.position_m.begin(), run.position_m.begin() + problem.first_held_out);
  explain_by_strain_limit(
      problem, values,
      springs_on_limit(problem.cloth, parameter_set(problem, values).springs, fitted_frames),
      result.parameters);
  report.model = describe_model(problem, input.recording, values);
  report.model.time_step_s = result.time_step_s;
  const MarkerRun markers = marker_run(problem, run);
  predictor.offset_markers(
      marker_offsets(problem, input.recording.markers, known_offsets, predictor, markers, report));
  fill_residuals(problem, predictor, markers, report);
  name_contradicting(input.recording.markers, report);
  const FittedTilt tilt = fitted_tilt(problem, values);
  warn_of_contradicted_pose(
      {.tilt_rad = tilt.angle_rad, .sigmas = tilt.sigmas, .is_stated = tilt.is_stated},
      (input.recording.folder / "recording.yaml").string(), report);
  if (!input.clouds.empty())
    result.clouds =
        cloud_errors(input.clouds, problem.cloth.mesh, run.position_m, problem.first_held_out);
  for (const ObservationSet& set : problem.observations)
    result.observations_used += static_cast<int>(set.rows.size());
}

/// Returns sigmas that are known from elsewhere, with the intervals of normal numbers; nothing for
/// the others.
Uncertainty stated(const FitProblem& problem, const Eigen::VectorXd& values,
                   const std::map<std::string, double>& known) {
  const int count = problem.space.size();
  Uncertainty result{.sigma = Eigen::VectorXd::Zero(count),
                     .lower = values,
                     .upper = values,
                     .correlation = Eigen::MatrixXd::Identity(count, count),
                     .roughness = Eigen::VectorXd::Ones(count)};
  for (int p = 0; p < count; ++p) {
    const FitParameter& parameter = problem.space.parameters[static_cast<size_t>(p)];
    if (const auto sigma = known.find(parameter.name); sigma != known.end())
      result.sigma[p] = sigma->second;
    constexpr double kOfNormal = 1.645;  // half the interval of kIntervalLevel
    const double half = kOfNormal * result.sigma[p];
    result.lower[p] = std::max(parameter.lower, values[p] - half);
    result.upper[p] = std::min(parameter.upper, values[p] + half);
  }
  return result;
}

void forecast(const FitInput& input, const FitProblem& problem, const FitOptions& options,
              FitReport& report) {
  const Eigen::VectorXd values = problem.space.start();
  report.stop = FitStop::converged;
  report.result.time_step_s = own_time_step_s(problem, options, values);
  report.stages.push_back("forecast: nothing fitted");
  run_on(input, problem, options, values, {}, options.forecast->marker_offsets, {}, report);
}

/// From the optimum to the intervals and the error on held-out frames.
void identify_all(const FitInput& input, const FitProblem& problem, const FitOptions& options,
                  const ProgressCallback& progress, FitReport& report) {
  FitResult& result = report.result;
  const auto fail = [&](const std::string& message) {
    report = stopped(std::move(report), FitStop::diverged, message);
  };
  std::vector<Candidate> candidates;
  const RefineResult refined = identify(input, problem, options, progress, report, candidates);
  if (!refined.usable) return fail("no fit worked out: " + refined.message);
  const Eigen::VectorXd& values = refined.values;
  result.time_step_s = refined.time_step_s;
  report.stop = refined.converged ? FitStop::converged : FitStop::reached_limit;
  report.message = refined.message;
  const TrajectoryObjective objective(
      problem, problem.first_held_out,
      time_steps_of_run(problem.cloth, parameter_set(problem, values), result.time_step_s));
  // What a model says of its sigmas that leaves so much is worth no time.
  if (2 * refined.cost > options.coarse_beyond) {
    const Eigen::VectorXd residual = objective.residuals({values}).front();
    if (residual.size() == 0 || misfit_of_most_markers(objective, residual) > options.coarse_beyond)
      return run_on(input, problem, options, values, stated(problem, values, {}), {}, {}, report);
  }
  const Uncertainty uncertainty = estimate_uncertainty(
      objective, values,
      {.loss = options.loss, .bootstrap = options.bootstrap, .seed = options.seed},
      refined.residual_by_coordinate);
  if (options.bootstrap > 0 && uncertainty.bootstrap_lower.size() == 0)
    report.stages.push_back(
        "no bootstrap: fewer than two blocks, or a coordinate that the residuals say nothing of");
  if (!uncertainty.usable) return fail("the derivatives at the optimum could not be computed");
  fill_correlation(problem.space, uncertainty, report);
  result.basins = basins_of(problem.space, std::move(candidates), values, uncertainty);
  add_uncertainty(problem, values, uncertainty, report);
  const FurtherLooks looks =
      look_further(input, objective, options, values, uncertainty, progress, report);
  run_on(input, problem, options, values, uncertainty, {}, looks, report);
}

}  // namespace

FitReport fit(const FitInput& input, const FitOptions& asked_options,
              const ProgressCallback& progress) {
  asked_options.validate();
  FitOptions options = asked_options;
  options.is_cancelled = throwing_check(asked_options.is_cancelled);
  const auto began = std::chrono::steady_clock::now();
  const ThreadLimit threads(options.threads);
  const auto [columns, rows] = mesh_of(input.recording.cloth, options);
  const FitProblem problem = make_problem(input, options, columns, rows);
  require_affordable(input, problem, options);
  FitReport report = report_of(input, problem, options);
  try {
    if (options.forecast)
      forecast(input, problem, options, report);
    else
      identify_all(input, problem, options, stop_token(progress), report);
  } catch (const StopRequested&) {
    return stopped(std::move(report), FitStop::cancelled, "cancelled");
  }
  report.result.seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  return report;
}

FitReport report_at(const FitInput& input, const FitOptions& options,
                    const KnownParameters& known) {
  options.validate();
  const auto [columns, rows] = mesh_of(input.recording.cloth, options);
  const FitProblem problem = make_problem(input, options, columns, rows);
  Eigen::VectorXd values = problem.space.start();
  for (int p = 0; p < problem.space.size(); ++p) {
    const FitParameter& parameter = problem.space.parameters[static_cast<size_t>(p)];
    if (const auto value = known.values.find(parameter.name); value != known.values.end())
      values[p] = std::clamp(value->second, parameter.lower, parameter.upper);
  }
  FitReport report = report_of(input, problem, options);
  report.stop = FitStop::converged;
  report.stages.push_back("nothing fitted here: the values come from a fit elsewhere");
  report.result.time_step_s = own_time_step_s(problem, options, values);
  run_on(input, problem, options, values, stated(problem, values, known.sigma),
         known.marker_offsets, {}, report);
  return report;
}

}  // namespace clothfit
