#pragma once

#include <string>
#include <vector>

#include "apps/study/louchet1995/landscape.h"
#include "apps/study/louchet1995/race.h"
#include "apps/study/louchet1995/recovery.h"
#include "apps/study/louchet1995/setting.h"
#include "data/progress.h"
#include "fit/jobs/journal.h"

namespace clothfit {

/// Options of the study of the founding paper's section 3 [louchet1995], and of its open ends.
struct Louchet1995Options {
  int seeds = 100;              ///< > 0, for the recoveries; the slower comparisons take a fifth
  unsigned long long seed = 1;  ///< the first of them
  int threads = 0;              ///< 0: as many as the machine has
  bool quick = false;           ///< coarser grids, shorter searches
  void validate() const;        ///< throws InputError

  /// Returns how many seeds the comparisons of searches and of places in the motion take.
  int compared_seeds() const { return (seeds + 4) / 5; }
  /// Returns all that determines the results, in one line.
  std::string key() const;
};

/// A recovery and the time it took here.
struct RecoveryTrial {
  unsigned long long seed = 0;
  Recovery recovery;
  double error = 0;     ///< largest relative error of a refined value
  double seconds = -1;  ///< measured by this run; negative: resumed from a journal
};

struct RecoveryTrials {
  SpringSet set = SpringSet::louchet5;
  Eigen::VectorXd truth;
  std::vector<std::string> names;
  /// Relative sigma of each parameter from measured positions (measured_sigmas()).
  Eigen::VectorXd relative_sigma;
  std::vector<RecoveryTrial> trials;

  bool determined(Eigen::Index p) const;  ///< its sigma is below kDeterminedSigma
  /// Returns the largest relative error of a trial among the determined parameters.
  double determined_error(const RecoveryTrial& trial) const;
};
inline constexpr double kDeterminedSigma = 0.1;
inline constexpr double kMeasuringNoise_m = 1e-3;
inline constexpr double kFrameRate_hz = 60;

/// The strategy alone on the full cost, with which the printed listing agrees.
struct FullCostTrial {
  unsigned long long seed = 0;
  Recovery recovery;  ///< not refined
};

/// The small cost somewhere else in the motion.
struct PlaceInMotion {
  int transition = 0;
  double time_s = 0;
  double share_at_limit = 0;
  Eigen::VectorXd relative_sigma;  ///< louchet5, states measured with kMeasuringNoise_m
  std::vector<double> errors;  ///< errors of a recovery from this transition alone, for each seed
};

struct RaceResults {
  Racer racer = Racer::strategy_5;
  std::vector<Race> races;  ///< for each seed
};

/// A set of parameters, its motion from the same start, and its distance from the original.
struct Reconstruction {
  std::string name;
  Louchet5 set;
  double cost_m2 = 0;  ///< full
  RecordedStates states;
  double rms_m = 0;  ///< distance of vertices over the motion
};

struct Louchet1995Study {
  PaperExperiment experiment;
  std::vector<SettingSearch> settings;   ///< one for each of setting_readings()
  ListingMatch full_match, small_match;  ///< for `experiment`
  std::vector<CostLandscape> landscapes;
  RecoveryTrials five, eighteen;
  std::vector<FullCostTrial> full_cost;
  int full_cost_transitions = 0;
  std::vector<RaceResults> races;
  std::vector<PlaceInMotion> places;
  RecordedStates original;
  std::vector<Reconstruction> reconstructions;  ///< printed good, printed bad, ours good, ours bad
  bool cancelled = false;                       ///< the rest is then empty
};

/// Runs the study. Everything but the seconds is a function of the options. `journal`, when given,
/// has the options' key.
Louchet1995Study study_louchet1995(const Louchet1995Options& options, Journal* journal,
                                   const ProgressCallback& progress);

}  // namespace clothfit
