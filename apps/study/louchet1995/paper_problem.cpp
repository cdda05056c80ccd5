#include "apps/study/louchet1995/paper_problem.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "data/input_error.h"
#include "fit/problem/parameterised_model.h"
#include "model/effects/registry.h"
#include "model/fabric/louchet18.h"

namespace clothfit {
namespace {

Cloth paper_cloth(const PaperExperiment& experiment) {
  const int side = experiment.vertices_per_side;
  const double size_m = experiment.reference.natural_length_01_m * (side - 1);
  const Mesh mesh{side, side, size_m, size_m};
  Cloth cloth =
      Cloth::of(mesh, Eigen::VectorXd::Constant(mesh.vertex_count(), experiment.vertex_mass_kg));
  cloth.held = {held_at(mesh, 0, 0), held_at(mesh, size_m, 0)};
  cloth.strain_limit.mode = experiment.limit;
  add_effect(cloth, "viscous_damping", "louchet1995");
  return cloth;
}

/// Returns the flat sheet, its held edge along x, z up.
Eigen::Matrix3Xd released(const PaperExperiment& experiment, const Mesh& mesh) {
  const Eigen::Vector3d along_t = experiment.release == PaperRelease::level
                                      ? Eigen::Vector3d(0, 1, 0)
                                      : Eigen::Vector3d(0, 0, -1);
  const Eigen::Matrix3Xd flat = flat_positions(mesh);
  return Eigen::Vector3d::UnitX() * flat.row(0) + along_t * flat.row(1);
}

/// Returns the mean length of the springs of each type over all states.
std::array<double, kSpringTypes> mean_lengths(const SpringNet& springs,
                                              const RecordedStates& states) {
  std::array<double, kSpringTypes> mean{};
  for (size_t type = 0; type < kSpringTypes; ++type) {
    double sum = 0;
    for (const Eigen::Matrix3Xd& position_m : states.position_m)
      for (const auto& [a, b] : springs[type])
        sum += (position_m.col(b) - position_m.col(a)).norm();
    mean[type] = sum / static_cast<double>(states.position_m.size() * springs[type].size());
  }
  return mean;
}

/// Returns the largest deformation rate of a spring in the last state.
double largest_rate(const SpringNet& springs, const Louchet5& reference,
                    const RecordedStates& states) {
  const SpringParameters numbers = spring_parameters(reference);
  const Eigen::Matrix3Xd& position_m = states.position_m.back();
  double largest = 0;
  for (size_t type = 0; type < kSpringTypes; ++type)
    for (const auto& [a, b] : springs[type])
      largest = std::max(
          largest,
          (position_m.col(b) - position_m.col(a)).norm() / numbers.natural_length_m[type] - 1);
  return largest;
}

FitParameter searched(const SpringNumber& number, const std::array<double, kSpringTypes>& mean_m) {
  FitParameter parameter{.name = number.name, .unit = number.unit};
  switch (number.quantity) {
    case SpringQuantity::natural_length: {
      const double length_m = mean_m[static_cast<size_t>(number.type)];
      parameter.lower = 0.6 * length_m;
      parameter.upper = 1.2 * length_m;
      parameter.typical = length_m;
      break;
    }
    case SpringQuantity::critical_elongation:
      parameter.lower = 0.01;
      parameter.upper = 1;
      break;
    case SpringQuantity::stiffness:
    case SpringQuantity::retardation_time:
      parameter.scale = ParameterScale::logarithmic;
      parameter.lower = 0.1;
      parameter.upper = 40;
      break;
  }
  parameter.start = 0.5 * (parameter.lower + parameter.upper);
  return parameter;
}

}  // namespace

void PaperExperiment::validate() const {
  const auto require = [](bool good, const char* name, double value, const char* expected) {
    if (!good) throw InputError(name, std::string(name) + " = " + std::to_string(value), expected);
  };
  require(vertices_per_side >= 3, "mesh", vertices_per_side, "at least 3 vertices a side");
  require(vertex_mass_kg > 0, "mass", vertex_mass_kg, "the mass of a vertex, more than 0 kg");
  require(time_step_s > 0, "step", time_step_s, "a time step, more than 0 s");
  require(duration_s >= time_step_s && duration_s <= 1e6 * time_step_s, "duration", duration_s,
          "at least one time step, at most a million");
  require(damping_per_s >= 0 && damping_per_s * time_step_s < 1, "damping", damping_per_s,
          "0 or more, and less than one over the time step");
}

std::string to_string(PaperCost cost) {
  return cost == PaperCost::full ? "full" : "small";
}

std::vector<int> transitions_of(PaperCost cost, const RecordedStates& states) {
  return cost == PaperCost::full ? full_cost_transitions(states) : small_cost_transitions(states);
}

std::vector<int> thinned_out(const std::vector<int>& transitions, int most) {
  const auto count = static_cast<int>(transitions.size());
  if (most <= 0 || count <= most) return transitions;
  std::vector<int> kept;
  for (int n = 1; n <= most; ++n)
    kept.push_back(transitions[static_cast<size_t>(static_cast<long>(n) * count / most - 1)]);
  return kept;
}

RecordedStates paper_states(const PaperExperiment& experiment) {
  const Cloth cloth = paper_cloth(experiment);
  const ParameterSet set{.springs = spring_parameters(experiment.reference),
                         .effects = {{experiment.damping_per_s}},
                         .start_position_m = released(experiment, cloth.mesh)};
  return simulate_states(cloth, set, experiment.time_step_s, experiment.duration_s);
}

FitProblem paper_problem(const PaperExperiment& experiment, const RecordedStates& states,
                         SpringSet set) {
  FitProblem problem;
  problem.cloth = paper_cloth(experiment);
  problem.cloth_mass_kg = problem.cloth.mass_kg.sum();
  problem.start = StartKind::released_flat;
  problem.placed_sheet_m = released(experiment, problem.cloth.mesh);
  problem.gravity_m_per_s2 = {0, 0, -9.81};
  problem.frame_time_s = states.time_s;
  problem.first_held_out = problem.frames();
  problem.spring_set = set;
  const std::array<double, kSpringTypes> mean_m = mean_lengths(problem.cloth.springs, states);
  for (const SpringNumber& number : numbers_of(set)) {
    problem.spring_numbers.push_back({.parameter = problem.space.size()});
    problem.space.parameters.push_back(searched(number, mean_m));
  }
  problem.effects = {{{.constant = experiment.damping_per_s}}};
  return problem;
}

Eigen::VectorXd paper_truth(const PaperExperiment& experiment, SpringSet set) {
  if (set == SpringSet::louchet5) return to_vector(experiment.reference);
  return to_vector(nearest_louchet18(spring_parameters(experiment.reference)).set);
}

double rms_distance_m(const RecordedStates& a, const RecordedStates& b) {
  if (a.position_m.size() != b.position_m.size()) return INFINITY;
  double sum_m2 = 0;
  for (size_t n = 0; n < a.position_m.size(); ++n)
    sum_m2 += (a.position_m[n] - b.position_m[n]).squaredNorm();
  const auto count =
      static_cast<double>(a.position_m.size()) * static_cast<double>(a.position_m.front().cols());
  return std::isfinite(sum_m2) ? std::sqrt(sum_m2 / count) : INFINITY;
}

double free_run_distance_m(const PaperExperiment& experiment, const Louchet5& set) {
  const RecordedStates original = paper_states(experiment);
  const FitProblem problem = paper_problem(experiment, original, SpringSet::louchet5);
  return rms_distance_m(simulate_states(problem.cloth, parameter_set(problem, to_vector(set)),
                                        experiment.time_step_s, experiment.duration_s),
                        original);
}

std::vector<SearchParameter> search_ranges(const FitProblem& problem) {
  std::vector<SearchParameter> ranges;
  for (const FitParameter& parameter : problem.space.parameters)
    ranges.push_back({.name = parameter.name,
                      .lower = parameter.lower,
                      .upper = parameter.upper,
                      .log_scale = parameter.scale == ParameterScale::logarithmic});
  return ranges;
}

GenerationCost sum_of_squares(const Objective& objective) {
  return [&objective](const Eigen::MatrixXd& individuals) {
    std::vector<Eigen::VectorXd> values;
    for (Eigen::Index n = 0; n < individuals.cols(); ++n) values.push_back(individuals.col(n));
    const std::vector<Eigen::VectorXd> residuals = objective.residuals(values);
    Eigen::VectorXd costs(individuals.cols());
    for (Eigen::Index n = 0; n < individuals.cols(); ++n) {
      const Eigen::VectorXd& residual = residuals[static_cast<size_t>(n)];
      costs[n] = residual.size() > 0 ? residual.squaredNorm() : INFINITY;
    }
    return costs;
  };
}

const std::array<PaperIndividual, 10> kPaperGoodListing{{
    {95, {0.093985, 0.133019, 0.187111, 3.938169, 0.497108}, 0.024182},
    {12, {0.093985, 0.133019, 0.187111, 3.938169, 0.497108}, 0.024160},
    {65, {0.093984, 0.133019, 0.187083, 3.938169, 0.497108}, 0.024137},
    {31, {0.093984, 0.133019, 0.187111, 3.938169, 0.497108}, 0.024133},
    {82, {0.093984, 0.133019, 0.187109, 3.938169, 0.497108}, 0.024130},
    {4, {0.093984, 0.133019, 0.187106, 3.938169, 0.497108}, 0.024129},
    {26, {0.093887, 0.133019, 0.187111, 3.906064, 0.497108}, 0.022811},
    {57, {0.093960, 0.133019, 0.187107, 3.926550, 0.497108}, 0.022180},
    {39, {0.093954, 0.133019, 0.187108, 3.927238, 0.497108}, 0.021845},
    {88, {0.093984, 0.132705, 0.187083, 4.084211, 0.497108}, 0.014619},
}};

const std::array<PaperIndividual, 10> kPaperBadListing{{
    {70, {0.086170, 0.132648, 0.200459, 0.363856, 0.630850}, 0.650783},
    {47, {0.086170, 0.132094, 0.201230, 0.370355, 0.630850}, 0.650390},
    {43, {0.086170, 0.132654, 0.199978, 0.369424, 0.630850}, 0.649559},
    {95, {0.086170, 0.132671, 0.200991, 0.386130, 0.630850}, 0.648277},
    {74, {0.086170, 0.132671, 0.197468, 0.386130, 0.630850}, 0.646357},
    {73, {0.086170, 0.132667, 0.199857, 0.394229, 0.630850}, 0.645847},
    {7, {0.086170, 0.132667, 0.198607, 0.394229, 0.630850}, 0.645059},
    {1, {0.086170, 0.132670, 0.199827, 0.400431, 0.630850}, 0.644962},
    {40, {0.086170, 0.132668, 0.199821, 0.406031, 0.630850}, 0.644202},
    {51, {0.086170, 0.132671, 0.200991, 0.435233, 0.630850}, 0.642728},
}};

std::vector<Eigen::VectorXd> listed_individuals() {
  std::vector<Eigen::VectorXd> values;
  for (const auto* listing : {&kPaperGoodListing, &kPaperBadListing})
    for (const PaperIndividual& individual : *listing) values.push_back(to_vector(individual.set));
  return values;
}

std::vector<double> listed_costs() {
  std::vector<double> costs;
  for (const auto* listing : {&kPaperGoodListing, &kPaperBadListing})
    for (const PaperIndividual& individual : *listing) costs.push_back(individual.cost);
  return costs;
}

double ListingMatch::distance() const {
  return usable ? std::hypot(spread, std::log(factor)) : spread;
}

ListingMatch match_listing(const PaperExperiment& experiment, PaperCost cost,
                           int most_transitions) {
  ListingMatch match;
  const RecordedStates states = paper_states(experiment);
  if (states.position_m.size() != states.time_s.size() || !states.position_m.back().allFinite())
    return match;
  const FitProblem problem = paper_problem(experiment, states, SpringSet::louchet5);
  const std::vector<int> all = transitions_of(cost, states);
  const std::vector<int> transitions = thinned_out(all, most_transitions);
  const double weight = static_cast<double>(all.size()) / static_cast<double>(transitions.size());
  const StateObjective objective(problem, states, transitions, experiment.time_step_s);
  const std::vector<double> printed = listed_costs();
  Eigen::ArrayXd log_ratio(printed.size());
  for (const Eigen::VectorXd& residual : objective.residuals(listed_individuals())) {
    if (residual.size() == 0 || residual.squaredNorm() == 0) return match;
    const size_t n = match.cost.size();
    match.cost.push_back(weight * residual.squaredNorm());
    log_ratio[static_cast<Eigen::Index>(n)] = std::log(match.cost[n] / printed[n]);
  }
  match.usable = true;
  match.overshoot = largest_rate(problem.cloth.springs, experiment.reference, states) /
                    experiment.reference.critical_elongation;
  match.factor = std::exp(log_ratio.mean());
  match.spread = std::sqrt((log_ratio - log_ratio.mean()).square().mean());
  return match;
}

}  // namespace clothfit
