#pragma once

#include <Eigen/Core>
#include <vector>

#include "apps/study/louchet1995/paper_problem.h"

namespace clothfit {

/// A cost over stiffness and critical elongation, as figures 3 and 4 of the paper show it. The
/// natural lengths are at their reference.
struct CostLandscape {
  double reference_elongation = 0;  ///< motion's elongation
  PaperCost cost = PaperCost::full;
  std::vector<double> stiffness_n_per_m;  ///< rising, evenly in the logarithm
  std::vector<double> elongation;         ///< rising, evenly
  Eigen::MatrixXd value_m2;               ///< stiffness x elongation; infinite: diverged
  int transitions = 0;                    ///< in the cost's sum

  /// Returns the place of the smallest value.
  std::pair<Eigen::Index, Eigen::Index> lowest() const;
  /// Counts places lower than all their neighbours, up to eight, without the lowest of all. A
  /// descent on this grid is trapped there.
  int other_minima() const;
};

/// Computes `points` a side, both references among them; the full cost over at most
/// `most_transitions`.
CostLandscape cost_landscape(PaperExperiment experiment, double reference_elongation,
                             PaperCost cost, int points, int most_transitions);

}  // namespace clothfit
