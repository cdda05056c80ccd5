#include "fit/problem/turned.h"
#include "fit/problem/unknown_group.h"

/// The sheet's placement: a small turn about its middle, and a shift.
namespace clothfit {
namespace {

/// Fits a small turn of the placed sheet about its middle and a shift along. The sheet is as
/// uncertain as the first frame's markers are noisy, and its error would pass for physics. The
/// first frame's own residuals determine them.
void add_sheet_motion(FitProblem& problem) {
  if (problem.start != StartKind::released_flat) return;
  const auto add = [&](const char* name, const char* unit, double range) {
    problem.sheet_motion.push_back({.parameter = problem.space.size(), .constant = 0});
    problem.space.parameters.push_back({.name = name,
                                        .unit = unit,
                                        .role = ParameterRole::placement,
                                        .scale = ParameterScale::linear,
                                        .lower = -range,
                                        .upper = range,
                                        .start = 0,
                                        .typical = 1e-3});
  };
  for (const char* name : {"sheet_turn_x", "sheet_turn_y", "sheet_turn_z"}) add(name, "rad", 0.1);
  for (const char* name : {"sheet_shift_x", "sheet_shift_y", "sheet_shift_z"}) add(name, "m", 0.05);
}

Eigen::Vector3d three(const std::vector<Binding>& bindings, size_t first,
                      const Eigen::VectorXd& values) {
  return {bindings[first].value(values), bindings[first + 1].value(values),
          bindings[first + 2].value(values)};
}

class SheetUnknowns final : public UnknownGroup {
 public:
  void declare(const ProblemSource& source, FitProblem& problem) const override {
    if (!source.options.forecast) add_sheet_motion(problem);
  }

  void apply(const FitProblem& problem, const Eigen::VectorXd& values,
             ParameterSet& set) const override {
    if (problem.sheet_motion.empty()) return;
    const Eigen::Vector3d middle = problem.placed_sheet_m.rowwise().mean();
    const Eigen::Vector3d turn = three(problem.sheet_motion, 0, values),
                          shift = three(problem.sheet_motion, 3, values);
    for (Eigen::Index v = 0; v < set.start_position_m.cols(); ++v)
      set.start_position_m.col(v) =
          turned(turn, problem.placed_sheet_m.col(v) - middle).value + middle + shift;
  }

  void differentiate(const FitProblem& problem, const Eigen::VectorXd& values,
                     const Eigen::VectorXd& slope, std::vector<Direction>& along) const override {
    if (problem.sheet_motion.empty()) return;
    const Eigen::Index vertices = problem.placed_sheet_m.cols();
    const Eigen::Vector3d middle = problem.placed_sheet_m.rowwise().mean();
    const Eigen::Vector3d turn = three(problem.sheet_motion, 0, values);
    const auto position = [&](const Binding& binding) -> Eigen::Matrix3Xd& {
      return along[static_cast<size_t>(binding.parameter)].start_position_m;
    };
    for (const Binding& binding : problem.sheet_motion) position(binding).resize(3, vertices);
    for (Eigen::Index v = 0; v < vertices; ++v) {
      const Eigen::Matrix3d by_turn = turned(turn, problem.placed_sheet_m.col(v) - middle).by_turn;
      for (size_t axis = 0; axis < 3; ++axis) {
        const auto column = static_cast<Eigen::Index>(axis);
        const Binding& turning = problem.sheet_motion[axis];
        const Binding& shifting = problem.sheet_motion[axis + 3];
        position(turning).col(v) = slope[turning.parameter] * by_turn.col(column);
        position(shifting).col(v) = slope[shifting.parameter] * Eigen::Vector3d::Unit(column);
      }
    }
  }
};

}  // namespace

const UnknownGroup& sheet_unknowns() {
  static const SheetUnknowns group;
  return group;
}

}  // namespace clothfit
