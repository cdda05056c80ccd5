#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "data/fit_result.h"
#include "data/model_description.h"

namespace clothfit {

enum class FitStop { not_run, converged, reached_limit, cancelled, diverged };

/// Says whether there is a result.
inline bool is_usable(FitStop stop) {
  return stop == FitStop::converged || stop == FitStop::reached_limit;
}

/// A fit with all that a report shows.
struct FitReport {
  FitStop stop = FitStop::not_run;
  std::string message;  ///< one line for a person
  FitResult result;
  bool usable() const { return is_usable(stop); }
  ModelDescription model;  ///< the found model, with all that a simulation needs
  /// Every parameter of the fit by name, those of the start and of the drive among them.
  std::map<std::string, double> values;

  /// The parts of each physical parameter's sigma (fit/uncertainty/uncertainty.h).
  struct SigmaParts {
    std::string name;
    double value = 0;
    double noise = 0, robust = 0, step_shift = 0;  ///< in the parameter's unit
    double degrees_of_freedom = 0;                 ///< those behind robust; infinite without blocks
    Interval interval_90;                          ///< with all of these
  };
  std::vector<SigmaParts> sigma_parts;

  /// Correlations between the fitted parameters, in the order of `correlation_names`.
  std::vector<std::string> correlation_names;
  Eigen::MatrixXd correlation;

  /// One entry per kind of observation, as in result.errors.
  struct Residuals {
    std::string kind;
    std::string unit;
    struct Row {
      int frame = 0;
      int marker = 0;
      Eigen::VectorXd observed;   ///< 2 or 3 coordinates
      Eigen::VectorXd predicted;  ///< the model's
      double sigma = 0;
      bool held_out = false;
    };
    std::vector<Row> rows;
    /// rms over coordinates in each frame, of the model and of the trivial predictors. The latter
    /// are NaN where not defined. Index = frame.
    std::vector<double> rms_by_frame;
    std::vector<double> first_frame_by_frame;
    std::vector<double> last_velocity_by_frame;
    std::vector<double> rigid_by_frame;
  };
  std::vector<Residuals> residuals;

  /// Best cost after each generation of the evolutionary search.
  std::vector<double> search_cost;
  /// One line per stage: its work, frames, substeps, evaluations and final cost.
  std::vector<std::string> stages;
};

}  // namespace clothfit
