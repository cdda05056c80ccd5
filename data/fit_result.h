#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "data/finding.h"

namespace clothfit {

enum class ParameterState {
  fitted,
  fixed,
  undetermined,
  ratio,  ///< to the mass per area, which is not known; its unit is one "per kg/m2"
  misfit  ///< the model leaves too much of the data for any interval to be true
};
std::string to_string(ParameterState state);

/// What a fit is good for.
enum class FitVerdict {
  good,              ///< it predicts as well as these data can show
  usable_with_care,  ///< it predicts, not quite to the floor; or nothing was held out
  model_lacks,       ///< it predicts something, and lacks physics that these data show
  do_not_use         ///< a guess predicts better, or nothing is determined
};
std::string to_string(FitVerdict verdict);

/// Ends of an interval, in a parameter's unit.
struct Interval {
  double lower = 0, upper = 0;
};

struct ParameterEstimate {
  std::string name;
  std::string unit;
  double value = 0;
  double sigma = 0;  ///< one standard deviation; 0 when fixed
  ParameterState state = ParameterState::fitted;
  std::string reason;  ///< why it is undetermined or fixed; empty when fitted
  std::optional<Interval> interval_90 = std::nullopt;   ///< of 90 %; where it was fitted
  bool interval_by_profile = false;                     ///< its ends are those of the profiled cost
  std::optional<Interval> bootstrap_90 = std::nullopt;  ///< where it was asked for
  /// Value on a mesh of another resolution less this one, where that was asked for.
  std::optional<double> mesh_shift = std::nullopt;
};

/// Follows the unit of what is given as a ratio to the mass per area.
inline constexpr const char* kPerArealDensity = " per kg/m2";
/// Follows the unit of what is given as a product with it.
inline constexpr const char* kTimesArealDensity = " times kg/m2";
/// Returns the power of the cloth's mass that numbers in a unit go with, for cloth that moves the
/// same way: 1 for force, pressure and mass, -1 for a compliance, else 0.
int mass_exponent(const std::string& unit);
/// Returns an estimate with all its numbers times a factor.
ParameterEstimate scaled(ParameterEstimate parameter, double factor);

struct EffectEstimate {
  std::string name;
  std::vector<ParameterEstimate> parameters;
};

/// A place in the space of parameters where runs of a search, or their refinements, ended. Several
/// basins say that the recording can be explained in several ways, or that the search did not
/// converge.
struct Basin {
  struct Number {
    std::string name;  ///< of a spring parameter, or EFFECT.PARAMETER
    double value = 0;  ///< in the parameter's unit
  };
  double cost = 0;      ///< mean error over the search's window, in sigmas, on the search's mesh
  int ended = 0;        ///< runs of CMA-ES, or individuals of the paper's strategy, that lead there
  bool refined = true;  ///< by least squares; else as a run of the search ended
  std::vector<Number> parameters;
};

/// `rms` is over coordinates, `rms_distance` over points.
struct ErrorSummary {
  double rms = 0;
  double rms_distance = 0;
  int count = 0;  ///< points
};

/// rms over coordinates of the trivial predictors on the held-out frames. NaN where nothing was
/// held out, or where one cannot predict it: a marker must be seen before.
struct TrivialErrors {
  double first_frame = 0;
  double last_velocity = 0;
  double rigid = 0;
};

/// Errors of one kind of observation: `unit` is "m" (3D tracks) or "px" (a camera's tracks).
struct ObservationErrors {
  std::string kind;  ///< "tracks3d" or the camera's name
  std::string unit;
  ErrorSummary fitted;
  ErrorSummary held_out;  ///< count 0 when nothing was held out
  double noise = 0;       ///< standard deviation per coordinate
  TrivialErrors trivial;
  /// Root mean squares of what mesh and time step make, as expected of them and as found in the
  /// fitted frames; 0 where they were not estimated.
  double discretisation = 0, discretisation_found = 0;
  /// Errors without the markers that contradict all others and without outliers.
  std::optional<ErrorSummary> fitted_without = std::nullopt, held_out_without = std::nullopt;
  /// Single observations that contradict those before and after them; left out of the same.
  int outliers = 0;

  /// Return what no model on this mesh can do better than. On fitted frames that counts the
  /// discretisation's error as found, up to what is expected: an effect that the model lacks may
  /// look like a larger one. On held-out frames it counts what is expected: what parameters took
  /// up returns there.
  double fitted_floor() const {
    return std::hypot(noise, std::min(discretisation_found, discretisation));
  }
  double held_out_floor() const { return std::hypot(noise, discretisation); }
};

/// A marker that lies far off the model over a stretch of frames in which the others do not.
struct ContradictingMarker {
  std::string marker;
  std::string kind;  ///< of the observations, as in ObservationErrors
  int first_frame = 0, last_frame = 0;
  double off = 0;  ///< rms distance there, in the unit of the observations
};

/// Distance of the model's surface from measured clouds (fit/observe/cloud_errors.h).
struct CloudErrors {
  /// Chamfer distance, the mean over frames that have a cloud.
  struct Summary {
    double chamfer_m2 = 0;
    int frames = 0;
  };
  Summary fitted, held_out, all;
};

/// The constant offset of a marker from the place that the model gives it.
struct MarkerOffset {
  std::string marker;
  Eigen::Vector3d offset_m;  ///< observed - predicted; world
};

/// The content of fit.json (format clothfit-fit/1).
struct FitResult {
  std::string recording;
  std::string version;
  std::string command;
  unsigned long long seed = 0;
  double seconds = 0;
  int mesh_columns = 0;
  int mesh_rows = 0;
  std::string parameter_set;
  std::string integrator;
  int substeps = 0;  ///< time steps per frame at the last stage (largest frame interval)
  double time_step_s = 0;
  std::string start;
  std::vector<ParameterEstimate> parameters;
  std::vector<EffectEstimate> effects;
  std::vector<ParameterEstimate> nuisance;  ///< measurement unknowns fitted along
  double marker_offset_sigma_m = 0;         ///< of their prior; 0 for those of an earlier fit
  std::vector<MarkerOffset> marker_offsets;
  std::vector<Basin> basins;  ///< best first; empty without a search
  std::vector<ObservationErrors> errors;
  std::optional<CloudErrors> clouds;  ///< where the recording has any
  FitVerdict verdict = FitVerdict::usable_with_care;
  std::string verdict_reason;  ///< one sentence
  std::string next_command;    ///< that asks what is missing, ready to copy; empty of a usable fit
  bool converged = true;
  bool contradicts_pose = false;  ///< gravity ended far from where the camera's pose has it
  std::vector<ContradictingMarker> contradicting;
  /// What the checks before the fit (fit/preflight/preflight.h) and its outcome warn of.
  Findings warnings;
  int observations_used = 0;
  std::map<std::string, int> observations_rejected;  ///< reason -> count

  bool usable() const {
    return verdict == FitVerdict::good || verdict == FitVerdict::usable_with_care;
  }
};

/// Turns ratios to the mass per area into numbers for a cloth of that density (kg/m2); without one
/// for the density that the fit assumed.
FitResult at_density(FitResult result, std::optional<double> areal_density);

/// Writes fit.json; numbers that are not finite are a programming error.
void write_fit_result(const FitResult& result, const std::filesystem::path& file);

/// Reads fit.json; unknown keys are ignored, missing ones and impossible numbers are an InputError.
/// Offsets of markers and parameters of basins come in the order of their names.
FitResult read_fit_result(const std::filesystem::path& file);

}  // namespace clothfit
