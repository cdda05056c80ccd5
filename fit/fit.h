#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "data/camera_parameters.h"
#include "data/clouds.h"
#include "data/fit_result.h"
#include "data/model_description.h"
#include "data/progress.h"
#include "data/recording.h"
#include "data/tracks.h"
#include "model/spring_set.h"

namespace clothfit {

/// Everything a fit looks at, read in.
struct FitInput {
  Recording recording;
  Tracks3d tracks3d;                         ///< empty when there are none
  std::map<std::string, Tracks2d> tracks2d;  ///< camera name -> its tracks
  std::vector<CameraParameters> cameras;     ///< those of tracks2d, with poses
  /// Of markers that held points follow, where there are no 3D tracks (fit/held_tracks.h).
  Tracks3d held_tracks;
  PointClouds clouds;  ///< world; errors are judged by them, nothing is fitted
};

/// What large residuals weigh: as all others, or less (Huber).
enum class Loss { squared, huber };

/// How the parameters' ranges are searched: by the founding paper's evolutionary strategy, or by
/// CMA-ES with restarts.
enum class SearchMethod { paper, cma };

/// The cost that leads a fit from its start to where the trajectory's takes over; the optimum is
/// always the trajectory's. `trajectory`: a search, then a growing horizon. `shooting`: windows
/// with states of their own (fit/shooting.h). `full`, `small`: the founding paper's over states
/// from smoothed 3D tracks (fit/track_states.h).
enum class LeadingCost { trajectory, shooting, full, small };

std::string to_string(LeadingCost cost);

/// The cost of that name; nothing where there is none.
std::optional<LeadingCost> leading_cost_named(const std::string& name);

/// Which observations a fit uses.
enum class ObservationKind { automatic, tracks3d, tracks2d };

/// Gaussian knowledge about a parameter of a fit, in its unit.
struct ParameterPrior {
  std::string name;  ///< such as tension_warp, or EFFECT.PARAMETER
  double mean = 0;
  double sigma = 0;  ///< > 0
};

struct FitOptions {
  ObservationKind observations = ObservationKind::automatic;  ///< automatic: 3D where there are any
  SpringSet spring_set = SpringSet::fabric;  ///< others come with the paper's strain limit
  /// Effects to fit beside those the recording declares, of motion or of the measurement.
  std::vector<std::string> effects;
  std::vector<ParameterPrior> priors;
  int mesh_columns = 0;  ///< 0: the recording's suggestion
  int mesh_rows = 0;
  unsigned long long seed = 1;
  LeadingCost cost = LeadingCost::trajectory;  ///< others: a search only if they lead nowhere
  SearchMethod search = SearchMethod::paper;
  int population = 100;       ///< individuals of the evolutionary search [louchet1995]
  int generations = 40;       ///< at most; the search stops earlier when it no longer gains
  double search_share = 0.4;  ///< of the fitted frames, that the search looks at; 0 < share <= 1
  int refine_best = 3;        ///< individuals, or optima of CMA-ES, that go to refinement
  /// The search ends once its best cost, the mean error over its window in sigmas, is this low; not
  /// given: once the model follows the cloth (fit/observed_motion.h).
  std::optional<double> stop_cost;
  std::filesystem::path checkpoint;  ///< the search's state after each generation; empty: not saved
  bool resume = false;               ///< go on from `checkpoint`, to the same bits
  /// Values of parameters by name, from an earlier fit: there is a search only if they lead to no
  /// optimum, and what has none starts where it would.
  std::optional<std::map<std::string, double>> start;
  Loss loss = Loss::huber;
  int start_nodes = 8;  ///< per side, of the corrections of a start that is unknown
  /// Standard deviation of constant offsets of the markers (fit/marker_offsets.h); 0: none.
  double marker_offset_sigma_m = 0;
  /// Knots of the corrections of tracked held points (fit/drive_correction.h), 4 to 1000; 0: the
  /// smoothed tracks are taken as exact. Each costs three directions of derivatives a point.
  int drive_knots = 0;
  double work = 1;  ///< > 0; times the limits of work of the refinement's stages
  /// > 0; chi-square per residual beyond which the fit's own mesh only follows what the coarse one
  /// finds: such a model lacks what any mesh shows. Infinite: never.
  double coarse_beyond = std::numeric_limits<double>::infinity();
  double substep_scale = 1;  ///< >= 1; more cuts time finer than stability asks
  bool profile = false;      ///< intervals from the profiled cost where it is no parabola
  int bootstrap = 0;         ///< replicates of a bootstrap over blocks; 0: none, else 19 or more
  bool two_meshes = false;   ///< fit again on a mesh of other resolution, from the optimum
  int threads = 0;           ///< 0: as many as the machine has
  /// Parameters taken from an earlier fit: nothing is fitted, the recording is forecast from its
  /// own first frame.
  std::optional<FitResult> forecast;
  void validate() const;  ///< throws InputError
};

enum class FitStop { converged, reached_limit, cancelled, diverged };

/// A fit with all that a report shows.
struct FitReport {
  FitStop stop = FitStop::converged;
  std::string message;  ///< one line for a person
  FitResult result;
  bool usable() const { return stop == FitStop::converged || stop == FitStop::reached_limit; }
  ModelDescription model;  ///< what was found, with all that a simulation needs
  /// Every parameter of the fit by name, those of the start and of the drive among them.
  std::map<std::string, double> values;

  /// What the sigma of each parameter of the physics is made of (fit/uncertainty.h).
  struct SigmaParts {
    std::string name;
    double value = 0;
    double noise = 0, robust = 0, step_shift = 0;  ///< in the parameter's unit
    double degrees_of_freedom = 0;                 ///< of robust; infinite without blocks
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
    /// rms over coordinates in each frame, of the model and of the trivial predictors
    /// (the latter only where defined; NaN elsewhere). Index = frame.
    std::vector<double> rms_by_frame;
    std::vector<double> first_frame_by_frame;
    std::vector<double> last_velocity_by_frame;
    std::vector<double> rigid_by_frame;
  };
  std::vector<Residuals> residuals;

  /// Best cost after each generation of the evolutionary search.
  std::vector<double> search_cost;
  /// One line per stage: what was done, with how many frames, substeps, evaluations, final cost.
  std::vector<std::string> stages;
};

/// Identifies the simulator that moves like the recording: evolutionary search, then refinement
/// with a growing horizon, then uncertainty and the error on held-out frames. Throws InputError
/// for a recording that cannot be fitted as it stands.
FitReport fit(const FitInput& input, const FitOptions& options, const ProgressCallback& progress);

/// What a fit elsewhere found: parameters by name, and where markers are seen.
struct KnownParameters {
  std::map<std::string, double> values;  ///< others stand where a fit would begin
  std::map<std::string, double> sigma;   ///< 0 where nothing is known
  /// By the markers' names, in place of what this recording asks for (fit/marker_offsets.h).
  std::vector<MarkerOffset> marker_offsets = {};
};

/// What a model with known parameters leaves of a recording; nothing is fitted. Throws InputError
/// as fit() does.
FitReport report_at(const FitInput& input, const FitOptions& options, const KnownParameters& known);

}  // namespace clothfit
