#pragma once

#include <functional>
#include <string>
#include <vector>

#include "fit/problem/problem.h"
#include "model/integrate/relax.h"

namespace clothfit {

/// What is done differently in another recording of a cloth.
enum class CandidateKind { duration, frame_rate, attitude, shaken, turned, camera };

/// A recording of the same cloth that could be made, as a change of the one there is: the same
/// markers, sigma and gaps otherwise.
struct CandidateRecording {
  CandidateKind kind = CandidateKind::duration;
  std::string what;  ///< for a person, such as "twice as long (1.7 s)"
  /// On any mesh of that recording. Where its markers are seen, observe() says.
  std::function<void(FitProblem& problem)> change;
};

/// Those that can be made of a recording:
///   duration    twice as long; held points that move go on, their way turned about its end;
///   frame_rate  a frame more between every two;
///   attitude    let go turned by 20 or 40 degrees, either way, about the line through the held
///               points: of a flat start whose held points lie on a line, without contact;
///   shaken      held points to and fro along a known path, from rest, by a twentieth of the
///               cloth's shorter side, along their line and across it; where time begins at 0;
///   turned      the cloth upside down, or, where it is square, by a quarter turn in its plane, so
///               that other points of it are held; not where held points are tracked;
///   camera      one more camera, an eighth of a turn to the side of the first (from a quarter turn
///               a hanging cloth is seen from its edge).
/// A start that is unknown stays as it is: no attitude, no turn.
std::vector<CandidateRecording> candidate_recordings(const FitProblem& problem);

/// Puts every observation of the fitted frames where the model has it, for `values` of the
/// parameters; others, and what a camera does not see, are left out. False where the model does not
/// run, or less than half would be seen.
bool observe(FitProblem& problem, const Eigen::VectorXd& values, const TimeSteps& steps);

}  // namespace clothfit
