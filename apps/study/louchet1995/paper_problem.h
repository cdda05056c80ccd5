#pragma once

#include <array>
#include <limits>
#include <string>
#include <vector>

#include "fit/cost/state_objective.h"
#include "fit/problem/problem.h"
#include "fit/search/search_parameter.h"
#include "model/fabric/louchet5.h"

namespace clothfit {

/// Ways in which the founding paper's cloth may begin, which the paper does not say.
enum class PaperRelease {
  level,   ///< flat and level, let go
  upright  ///< flat in the vertical plane below its held corners
};

/// The founding paper's experiment [louchet1995, section 3.4]. A cloth of 17 x 17 equal masses is
/// held by two neighbouring corners and moved by gravity. Numbers that the paper does not state
/// have values that make the cost functions agree best with the costs it prints
/// (docs/theory/louchet1995.md).
struct PaperExperiment {
  Louchet5 reference{.natural_length_01_m = 0.09375,
                     .natural_length_23_m = 0.132582521472478,  ///< l01 sqrt(2); 0.132583 printed
                     .natural_length_45_m = 0.1875,
                     .stiffness_n_per_m = 4,
                     .critical_elongation = 0.5};
  int vertices_per_side = 17;

  double vertex_mass_kg = 0.01;  ///< > 0
  double time_step_s = 0.001;    ///< > 0
  double duration_s = 0.6;       ///< >= time_step_s
  double damping_per_s = 2;      ///< C_visc / mass, >= 0
  PaperRelease release = PaperRelease::level;
  StrainLimitMode limit = StrainLimitMode::rates_first;

  void validate() const;  ///< throws InputError
};

/// The paper's two costs: over all transitions of a motion, and over the last alone.
enum class PaperCost { full, small };
std::string to_string(PaperCost cost);
std::vector<int> transitions_of(PaperCost cost, const RecordedStates& states);

/// Returns at most `most` of the transitions, at equal distances, the last among them; all for 0.
std::vector<int> thinned_out(const std::vector<int>& transitions, int most);

/// Returns the reference motion, at every time step.
RecordedStates paper_states(const PaperExperiment& experiment);

/// Makes the search for `set` (louchet5 or louchet18) in this experiment. Ranges lie around the
/// lengths that the states show. The natural lengths of each type have 0.6 to 1.2 times its
/// springs' mean length over all states ("around the average length values observed on the
/// reference data"). K has 0.1 to 40 N/m, tau 0.01 to 1.
FitProblem paper_problem(const PaperExperiment& experiment, const RecordedStates& states,
                         SpringSet set);

/// Returns the reference as values of that problem.
Eigen::VectorXd paper_truth(const PaperExperiment& experiment, SpringSet set);

/// Returns ranges of a problem's parameters, as a search takes them.
std::vector<SearchParameter> search_ranges(const FitProblem& problem);

/// Returns the sum of squared residuals as a search's cost.
GenerationCost sum_of_squares(const Objective& objective);

/// Returns how far a cloth with the numbers of `set` moves from the reference in a free run from
/// the start. It is the root mean square distance of vertices over the motion. Infinite: one of
/// them diverged.
double free_run_distance_m(const PaperExperiment& experiment, const Louchet5& set);
/// Returns the distance between two motions of the same times.
double rms_distance_m(const RecordedStates& a, const RecordedStates& b);

/// A line of the paper's listing of the ten best individuals after 49 generations.
struct PaperIndividual {
  int candidate = 0;
  Louchet5 set;
  double cost = 0;
};
/// The listings in the paper's good and in its bad situation, in the order printed.
extern const std::array<PaperIndividual, 10> kPaperGoodListing, kPaperBadListing;

/// Returns the individuals of both listings, the good one first, as values of a louchet5 problem.
std::vector<Eigen::VectorXd> listed_individuals();
/// Returns their printed costs.
std::vector<double> listed_costs();

/// The agreement of an experiment's costs of the listed individuals with the printed ones. The
/// paper's formula divides its costs by nothing. In case it was done all the same, a common factor
/// is free.
struct ListingMatch {
  bool usable = false;       ///< neither the reference motion nor a prediction diverged
  std::vector<double> cost;  ///< one for each of listed_individuals()
  double factor = 0;         ///< geometric mean of our cost over the printed one
  /// Root mean square of log(our cost / printed cost) about its mean; 0: the same up to the factor.
  double spread = std::numeric_limits<double>::infinity();
  /// Largest (|L| - l0) / l0 of a spring, over tau, in the reference motion's last state. One sweep
  /// a step does not always keep it near 1, as the paper means it to be.
  double overshoot = 0;

  /// Returns the root mean square of log(our cost / printed cost), the factor not free.
  double distance() const;
};
/// Compares an experiment with the listing. For screening, `most_transitions` thins the full cost's
/// transitions out evenly, each then counting for more.
ListingMatch match_listing(const PaperExperiment& experiment, PaperCost cost,
                           int most_transitions = 0);

}  // namespace clothfit
