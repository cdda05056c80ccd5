#pragma once

#include <span>
#include <string>
#include <vector>

#include "calib/camera/rigid3.h"
#include "fit/problem/fit_problem.h"
#include "model/integrate/simulate.h"
#include "model/integrate/tangent_step.h"

namespace clothfit {

/// The sources from which a group declares its unknowns.
struct ProblemSource {
  const FitInput& input;
  const FitOptions& options;
  const Drive& drive;
  const Rigid3& world_from_sheet;
};

/// A group of a fit's unknowns. It declares its parameters, writes their values into the model, and
/// says how they change it. A new group is a file, its name below and its line in unknown_groups().
class UnknownGroup {
 public:
  virtual ~UnknownGroup() = default;

  /// Adds its parameters to the problem's space, with their priors, or binds them to what is known.
  /// Adds nothing where the problem does not ask for the group. Throws InputError where it cannot
  /// be had.
  virtual void declare(const ProblemSource& source, FitProblem& problem) const = 0;
  /// Writes the model's numbers at values of the problem's parameters.
  virtual void apply(const FitProblem& problem, const Eigen::VectorXd& values,
                     ParameterSet& set) const = 0;
  /// Writes the derivatives of these numbers along each of the group's coordinates. `slope`: of
  /// each value by its coordinate. `along`: of each coordinate of the problem.
  virtual void differentiate(const FitProblem& problem, const Eigen::VectorXd& values,
                             const Eigen::VectorXd& slope, std::vector<Direction>& along) const = 0;
};

/// All groups, in the order in which they declare their parameters.
std::span<const UnknownGroup* const> unknown_groups();

const UnknownGroup& spring_unknowns();
const UnknownGroup& effect_unknowns();
const UnknownGroup& gravity_unknowns();
const UnknownGroup& sheet_unknowns();
const UnknownGroup& start_unknowns();
const UnknownGroup& drive_unknowns();

/// The numbers of the springs' set at values of the problem's parameters.
Eigen::VectorXd spring_numbers(const FitProblem& problem, const Eigen::VectorXd& values);

/// The file that messages about a recording name.
std::string recording_file(const Recording& recording);

}  // namespace clothfit
