#pragma once

#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "data/fit_result.h"
#include "fit/interface/hypothesis.h"
#include "model/fabric/spring_set.h"

namespace clothfit {

/// The weight of large residuals: as all others, or less (Huber).
enum class Loss { squared, huber };

/// Methods of searching the parameters' ranges: the founding paper's evolutionary strategy, or
/// CMA-ES with restarts.
enum class SearchMethod { paper, cma };

/// The cost that leads a fit from its start to where the trajectory's takes over. The optimum is
/// always the trajectory's. `trajectory`: a search, then a growing horizon. `shooting`: windows
/// with states of their own (fit/cost/shooting.h). `full`, `small`: the founding paper's over
/// states from smoothed 3D tracks (fit/cost/track_states.h).
enum class LeadingCost { trajectory, shooting, full, small };

std::string to_string(LeadingCost cost);

/// Returns the cost of that name; nothing where there is none.
std::optional<LeadingCost> leading_cost_named(const std::string& name);

/// Observations that a fit uses.
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
  /// Effects to fit beside those that the recording declares, of motion or of the measurement.
  std::vector<std::string> effects;
  /// Hypotheses to fit beside these: their amplitudes, at the shapes that they name.
  std::vector<Hypothesis> hypotheses;
  std::vector<ParameterPrior> priors;
  int mesh_columns = 0;  ///< 0: the recording's suggestion
  int mesh_rows = 0;
  unsigned long long seed = 1;
  LeadingCost cost = LeadingCost::trajectory;  ///< others: a search only if they lead nowhere
  SearchMethod search = SearchMethod::paper;
  int population = 100;       ///< individuals of the evolutionary search [louchet1995]
  int generations = 40;       ///< at most, >= 1; the search stops earlier when it no longer gains
  double search_share = 0.4;  ///< searched share of the fitted frames; 0 < share <= 1
  int refine_best = 3;        ///< individuals, or optima of CMA-ES, that go to refinement
  /// The search ends once its best cost, the mean error over its window in sigmas, is this low.
  /// Without a value it ends once the model follows the cloth (fit/cost/observed_motion.h).
  std::optional<double> stop_cost;
  std::filesystem::path checkpoint;  ///< the search's state after each generation; empty: not saved
  bool resume = false;               ///< go on from `checkpoint`, to the same bits
  /// Values of parameters by name, from an earlier fit. A search follows only if they lead to no
  /// optimum. Parameters without a value start where they would otherwise.
  std::optional<std::map<std::string, double>> start;
  Loss loss = Loss::huber;
  /// Nodes a side, for the corrections of a start that is unknown; 0: 4 where the first shape is
  /// smooth, else 8.
  int start_nodes = 0;
  /// Standard deviation of constant offsets of the markers (fit/observe/marker_offsets.h); 0: none.
  double marker_offset_sigma_m = 0;
  /// Knots of the corrections of tracked held points (fit/problem/drive_correction.h), 4 to 1000.
  /// 0: the smoothed tracks are taken as exact. Each costs three directions of derivatives a point.
  int drive_knots = 0;
  double work = 1;  ///< > 0; times the limits of work of the refinement's stages
  /// Chi-square per residual, > 0, beyond which the fit's own mesh only follows the coarse one's
  /// result. Such a model lacks physics that any mesh shows. Its sigmas are not estimated, and are
  /// given as 0. Infinite: never.
  double coarse_beyond = std::numeric_limits<double>::infinity();
  /// Shear and flexion may vanish, as in limp cloth. A model that lacks something runs there too,
  /// so a diagnosis does not allow it.
  bool to_nothing = false;
  double substep_scale = 1;  ///< >= 1; more cuts time finer than stability asks
  bool profile = false;      ///< intervals from the profiled cost where it is no parabola
  int bootstrap = 0;         ///< replicates of a bootstrap over blocks; 0: none, else 19 or more
  bool two_meshes = false;   ///< fit again on a mesh of other resolution, from the optimum
  int threads = 0;           ///< 0: as many as the machine has
  /// Parameters taken from an earlier fit. Nothing is then fitted: the recording is forecast from
  /// its own first frame.
  std::optional<FitResult> forecast;
  /// Asked within simulations, every few milliseconds, whether to end at once; any thread may ask.
  /// What it throws ends the call. Empty: the progress alone is asked, between simulations.
  std::function<bool()> is_cancelled;
  void validate() const;  ///< throws InputError, also beyond fit/interface/option_limits.h
};

}  // namespace clothfit
