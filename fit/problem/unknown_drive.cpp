#include "data/input_error.h"
#include "fit/problem/unknown_group.h"

/// Corrections of the tracks that drive held points.
namespace clothfit {
namespace {

void add_drive_correction(const std::vector<TrackedPoint>& tracked, const Recording& recording,
                          const FitOptions& options, FitProblem& problem) {
  if (options.drive_knots == 0) return;
  if (tracked.empty())
    throw InputError("FitOptions::drive_knots",
                     "no held point of " + recording_file(recording) + " is tracked",
                     "a held point with motion: tracked",
                     "leave it out: fixed points and known paths have no noise");
  const auto last = static_cast<size_t>(problem.first_held_out - 1);
  problem.drive_correction =
      make_drive_correction(tracked, problem.frame_time_s.front(), problem.frame_time_s[last],
                            options.drive_knots, recording.markers, problem.space, problem.priors);
}

class DriveUnknowns final : public UnknownGroup {
 public:
  void declare(const ProblemSource& source, FitProblem& problem) const override {
    if (!source.options.forecast)
      add_drive_correction(source.drive.tracked, source.input.recording, source.options, problem);
  }

  void apply(const FitProblem& problem, const Eigen::VectorXd& values,
             ParameterSet& set) const override {
    if (!problem.drive_correction.points.empty())
      set.held_shift = drive_shifts(problem.drive_correction, values, problem.cloth.held.size());
  }

  void differentiate(const FitProblem& problem, const Eigen::VectorXd&,
                     const Eigen::VectorXd& slope, std::vector<Direction>& along) const override {
    for (const DriveCorrection::Point& point : problem.drive_correction.points) {
      for (size_t n = 0; n < point.values.size(); ++n) {
        const int parameter = point.values[n].parameter;
        Direction& direction = along[static_cast<size_t>(parameter)];
        direction.held_motion.resize(problem.cloth.held.size());
        direction.held_motion[static_cast<size_t>(point.held)] = drive_shift_by_value(
            problem.drive_correction, static_cast<int>(n) / 3,
            slope[parameter] * Eigen::Vector3d::Unit(static_cast<Eigen::Index>(n) % 3));
      }
    }
  }
};

}  // namespace

const UnknownGroup& drive_unknowns() {
  static const DriveUnknowns group;
  return group;
}

}  // namespace clothfit
