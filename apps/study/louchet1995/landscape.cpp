#include "apps/study/louchet1995/landscape.h"

#include <cmath>

namespace clothfit {
namespace {

/// K ranges from a tenth of the reference to ten times; tau over its range up to 1.
constexpr double kStiffnessFactor = 10;
constexpr double kHighestElongation = 1;

/// Moves the place nearest to `value` onto it.
void pass_through(std::vector<double>& places, double value) {
  double* nearest = &places.front();
  for (double& place : places)
    if (std::abs(place - value) < std::abs(*nearest - value)) nearest = &place;
  *nearest = value;
}

}  // namespace

std::pair<Eigen::Index, Eigen::Index> CostLandscape::lowest() const {
  Eigen::Index i = 0, j = 0;
  value_m2.minCoeff(&i, &j);
  return {i, j};
}

int CostLandscape::other_minima() const {
  int minima = 0;
  for (Eigen::Index i = 0; i < value_m2.rows(); ++i)
    for (Eigen::Index j = 0; j < value_m2.cols(); ++j) {
      bool lower = true;
      for (Eigen::Index k = std::max<Eigen::Index>(0, i - 1);
           k <= std::min(value_m2.rows() - 1, i + 1); ++k)
        for (Eigen::Index l = std::max<Eigen::Index>(0, j - 1);
             l <= std::min(value_m2.cols() - 1, j + 1); ++l)
          lower = lower && ((k == i && l == j) || value_m2(i, j) < value_m2(k, l));
      minima += lower && std::pair(i, j) != lowest();
    }
  return minima;
}

CostLandscape cost_landscape(PaperExperiment experiment, double reference_elongation,
                             PaperCost cost, int points, int most_transitions) {
  experiment.reference.critical_elongation = reference_elongation;
  const RecordedStates states = paper_states(experiment);
  const FitProblem problem = paper_problem(experiment, states, SpringSet::louchet5);
  const std::vector<int> transitions = thinned_out(transitions_of(cost, states), most_transitions);
  const StateObjective objective(problem, states, transitions, experiment.time_step_s);

  CostLandscape landscape{.reference_elongation = reference_elongation,
                          .cost = cost,
                          .transitions = static_cast<int>(transitions.size())};
  const double reference_k = experiment.reference.stiffness_n_per_m;
  for (int n = 0; n < points; ++n) {
    const double share = n / (points - 1.0);
    landscape.stiffness_n_per_m.push_back(reference_k * std::pow(kStiffnessFactor, 2 * share - 1));
    landscape.elongation.push_back(kHighestElongation * (n + 1) / points);
  }
  pass_through(landscape.stiffness_n_per_m, reference_k);
  pass_through(landscape.elongation, reference_elongation);

  landscape.value_m2.resize(points, points);
  for (int i = 0; i < points; ++i) {
    std::vector<Eigen::VectorXd> individuals;
    for (int j = 0; j < points; ++j) {
      Louchet5 set = experiment.reference;
      set.stiffness_n_per_m = landscape.stiffness_n_per_m[static_cast<size_t>(i)];
      set.critical_elongation = landscape.elongation[static_cast<size_t>(j)];
      individuals.emplace_back(to_vector(set));
    }
    const std::vector<Eigen::VectorXd> residuals = objective.residuals(individuals);
    for (int j = 0; j < points; ++j) {
      const Eigen::VectorXd& residual = residuals[static_cast<size_t>(j)];
      landscape.value_m2(i, j) = residual.size() > 0 ? residual.squaredNorm() : INFINITY;
    }
  }
  return landscape;
}

}  // namespace clothfit
