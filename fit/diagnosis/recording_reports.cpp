#include "fit/diagnosis/recording_reports.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "fit/diagnosis/adequacy.h"
#include "fit/diagnosis/analysis.h"
#include "fit/diagnosis/clearance.h"
#include "fit/diagnosis/discretisation.h"
#include "fit/fit.h"
#include "fit/observe/held_tracks.h"

namespace clothfit {
namespace {

/// Frames that a recording must have among those fitted.
constexpr int kLeastFitted = 2;

/// Gives observations that state no sigma the one that a problem has found for them. Those of
/// markers that drive held points are left alone.
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

/// Returns the values of the parameters that all recordings share.
NamedValues shared_values(const FittedModel& model) {
  NamedValues shared;
  const ParameterSpace& space = model.problems.front()->space;
  for (int p = 0; p < space.size(); ++p) {
    const FitParameter& parameter = space.parameters[static_cast<size_t>(p)];
    if (is_physical(parameter.role)) shared[parameter.name] = model.parts.front().values[p];
  }
  return shared;
}

}  // namespace

RecordingReports::RecordingReports(std::span<const FitInput> fitted,
                                   std::span<const FitInput> held_out, ProgressCallback progress)
    : recordings(fitted.size() + held_out.size()),
      fitted_(fitted),
      held_out_(held_out),
      progress_(std::move(progress)) {
  for (size_t n = fitted.size(); n < recordings.size(); ++n) recordings[n].held_out = true;
}

void RecordingReports::add(const DiagnosisSetup& setup, const FittedModel& model, Which which) {
  add_fitted(setup, model, which);
  add_held_out(setup, model, which);
}

void RecordingReports::add_fitted(const DiagnosisSetup& setup, const FittedModel& model,
                                  Which which) {
  const std::vector<NamedValues> values = model.values();
  const Loss loss = setup.options.loss;
  // Sigmas of a model that is to be replaced are worth no time where it misfits grossly.
  const bool is_passing = which == &DiagnosedRecording::before && model.misfits_grossly();
  const std::vector<NamedValues> sigma =
      is_passing ? std::vector<NamedValues>(fitted_.size())
                 : sigma_of(model, judge_adequacy(model, loss), huber_threshold(model, loss));
  for (size_t n = 0; n < fitted_.size(); ++n) {
    FitReport& own = recordings[n].*which;
    own = report_at(fitted_[n], options_on_mesh(setup, model.hypotheses, n),
                    {.values = values[n], .sigma = sigma[n]});
    if (!own.usable())
      throw GivenUp{own.stop, "with " + title(model.hypotheses) + ": " + own.message};
  }
}

void RecordingReports::add_held_out(const DiagnosisSetup& setup, const FittedModel& model,
                                    Which which) {
  for (size_t n = 0; n < held_out_.size(); ++n) {
    FitReport& own = recordings[fitted_.size() + n].*which;
    own = unseen(setup, model, held_out_[n], which);
    if (!own.usable()) throw GivenUp{own.stop, held_out_[n].recording.name + ": " + own.message};
  }
}

FitReport RecordingReports::unseen(const DiagnosisSetup& setup, const FittedModel& model,
                                   FitInput input, Which which) const {
  DiagnosisSetup alone = setup;
  alone.inputs = {&input, 1};
  NamedValues values = shared_values(model);
  std::vector<MarkerOffset> offsets;
  FittedModel own = model_at(alone, model.hypotheses, {values});
  if (PooledSpace(own.problem_pointers()).own_of(0).empty()) {
    // Nothing is fitted, so all frames but those that a recording must have are held out.
    state_noise(*own.problems.front(), input);
    input.recording.held_out_from_frame = kLeastFitted;
    if (!input.held_tracks.empty()) input.held_tracks = held_tracks_from_pixels(input);
    offsets = mean_offsets(which);
  } else {
    own = fit_on_mesh(alone, own, progress_, true);
    if (!own.usable()) {
      FitReport failed;
      failed.stop = FitStop::diverged;
      failed.message = "no fit of what is its own worked out";
      return failed;
    }
    values = own.values().front();
  }
  return report_at(input, options_on_mesh(setup, model.hypotheses, 0),
                   {.values = values, .sigma = {}, .marker_offsets = offsets});
}

double RecordingReports::mean_residual_rms_m(Which which) const {
  double squares = 0;
  Eigen::Index count = 0;
  for (size_t n = 0; n < fitted_.size(); ++n) {
    std::map<int, std::pair<Eigen::Vector3d, int>> of_marker;
    for (const FitReport::Residuals::Row& row : (recordings[n].*which).residuals.front().rows) {
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

/// Averages over the fitted recordings, whose world is that of those held out.
std::vector<MarkerOffset> RecordingReports::mean_offsets(Which which) const {
  std::map<std::string, std::vector<Eigen::Vector3d>> seen;
  for (size_t n = 0; n < fitted_.size(); ++n)
    for (const MarkerOffset& offset : (recordings[n].*which).result.marker_offsets)
      seen[offset.marker].push_back(offset.offset_m);
  std::vector<MarkerOffset> mean;
  for (const auto& [marker, offsets] : seen) {
    mean.push_back({.marker = marker, .offset_m = Eigen::Vector3d::Zero()});
    for (const Eigen::Vector3d& offset_m : offsets)
      mean.back().offset_m += offset_m / static_cast<double>(offsets.size());
  }
  return mean;
}

}  // namespace clothfit
