#include "data/input_error.h"
#include "fit/problem/unknown_group.h"

/// The state of a cloth that was moving when its recording began.
namespace clothfit {
namespace {

/// Returns the corrections, 3 x nodes.
Eigen::Matrix3Xd corrections(const std::vector<Binding>& bindings, const Eigen::VectorXd& values) {
  Eigen::Matrix3Xd at_nodes(3, static_cast<Eigen::Index>(bindings.size() / 3));
  for (size_t n = 0; n < bindings.size(); ++n) at_nodes.data()[n] = bindings[n].value(values);
  return at_nodes;
}

class StartUnknowns final : public UnknownGroup {
 public:
  void declare(const ProblemSource& source, FitProblem& problem) const override {
    if (problem.start != StartKind::unknown) return;
    if (source.options.forecast)
      throw InputError("FitOptions::forecast", "the recording begins with the cloth in motion",
                       "a start that is known without a fit",
                       "fit the recording, or cut it so that it begins with the cloth at rest");
    problem.start_state =
        make_start_state(problem.observations, problem.marker_place_m, problem.frame_time_s,
                         problem.first_held_out, problem.cloth.mesh, source.world_from_sheet,
                         {.nodes = source.options.start_nodes}, problem.space, problem.priors);
  }

  void apply(const FitProblem& problem, const Eigen::VectorXd& values,
             ParameterSet& set) const override {
    if (problem.start != StartKind::unknown) return;
    const StartState& start = problem.start_state;
    set.start_position_m =
        start.position_m + corrections(start.position, values) * start.basis.transpose();
    set.start_velocity_m_per_s =
        start.velocity_m_per_s + corrections(start.velocity, values) * start.basis.transpose();
  }

  void differentiate(const FitProblem& problem, const Eigen::VectorXd&,
                     const Eigen::VectorXd& slope, std::vector<Direction>& along) const override {
    const StartState& start = problem.start_state;
    for (int n = 0; n < 3 * start.nodes(); ++n) {
      const Eigen::RowVectorXd field = start.basis.col(n / 3).transpose();
      const auto move = [&](const Binding& binding, Eigen::Matrix3Xd Direction::*of) {
        along[static_cast<size_t>(binding.parameter)].*of =
            slope[binding.parameter] * Eigen::Vector3d::Unit(n % 3) * field;
      };
      move(start.position[static_cast<size_t>(n)], &Direction::start_position_m);
      move(start.velocity[static_cast<size_t>(n)], &Direction::start_velocity_m_per_s);
    }
  }
};

}  // namespace

const UnknownGroup& start_unknowns() {
  static const StartUnknowns group;
  return group;
}

}  // namespace clothfit
