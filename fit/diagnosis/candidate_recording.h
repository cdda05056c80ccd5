#pragma once

#include <functional>
#include <string>
#include <vector>

#include "fit/problem/problem.h"
#include "model/integrate/relax.h"

namespace clothfit {

/// The kinds of change that make another recording of a cloth.
enum class CandidateKind { duration, frame_rate, attitude, shaken, turned, camera };

/// A recording of the same cloth that could be made. It changes the one there is, and otherwise
/// keeps its markers, sigma and gaps.
struct CandidateRecording {
  CandidateKind kind = CandidateKind::duration;
  std::string what;  ///< for a person, such as "twice as long (1.7 s)"
  /// Changes the recording's problem, on any mesh. observe() says where its markers are seen.
  std::function<void(FitProblem& problem)> change;
};

/// Returns the recordings that can be made of a cloth, by what they change:
///   duration    twice as long; held points that move go on, their way turned about its end;
///   frame_rate  a frame more between every two;
///   attitude    let go turned by 20 or 40 degrees, either way, about the line through the held
///               points; for a flat start without contact whose held points lie on a line;
///   shaken      held points to and fro along a known path, from rest, by a twentieth of the
///               cloth's shorter side, along their line and across it; where time begins at 0;
///   turned      the cloth upside down, or, where it is square, by a quarter turn in its plane, so
///               that other points of it are held; not where held points are tracked;
///   camera      one more camera, an eighth of a turn to the side of the first; a quarter turn
/// would
///               show a hanging cloth from its edge.
/// A start that is unknown stays as it is, so its attitude and turn are not changed.
std::vector<CandidateRecording> candidate_recordings(const FitProblem& problem);

/// Puts every observation of the fitted frames where the model has it, at `values` of the
/// parameters. Other observations are left out, and so are those that a camera does not see.
/// Returns false where the model does not run, or where less than half would be seen.
bool observe(FitProblem& problem, const Eigen::VectorXd& values, const TimeSteps& steps);

}  // namespace clothfit
