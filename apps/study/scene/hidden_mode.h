#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "apps/study/scene/synthetic_recording.h"
#include "fit/diagnosis/catalogue.h"
#include "fit/diagnosis/fitted_model.h"
#include "fit/diagnosis/projection.h"

namespace clothfit {

/// A mode of an effect that a study hides in the truth.
struct HiddenMode {
  std::string effect, mode;  ///< named as in the effect; empty where it has only one
  std::string title() const { return mode.empty() ? effect : effect + " (" + mode + ")"; }
};

/// Returns the library's modes for a kind of observation. Left out are modes that resemble what a
/// fit of such a recording has free anyway, and those that need a geometry (contacts).
std::vector<HiddenMode> hidden_modes(ObservationKind observations);

/// The information of a recording on modes before any noise. It is a linear model of the fit around
/// the truth without hidden effects, over the fitted frames. The mesh is the truth's, with at most
/// twice as many cells a side as the fit's.
struct RecordingInformation {
  SyntheticRecording recording;        ///< without noise, of a cloth on that mesh
  std::vector<ShapeCandidates> modes;  ///< tested by a diagnosis
  FittedModel model;
  ModelProjection projection;  ///< everything that the fit has free is projected out
};

/// Computes it for the release of `seed`. Throws InputError where the scene cannot be simulated or
/// has no derivatives.
RecordingInformation recording_information(const SyntheticScene& scene, const FitOptions& fit,
                                           std::uint64_t seed);

/// A hidden mode with its numbers.
struct DrawnMode {
  Hypothesis hypothesis;      ///< the shape drawn
  Eigen::VectorXd amplitude;  ///< each amplitude beyond neutral, in its unit
  double sigmas = 0;          ///< amplitude beyond neutral over its standard deviation
  Eigen::VectorXd projected;  ///< derivative of the residuals by `sigmas`, projected; length 1
};

/// Options to draw a mode. Its shape lies inside the range of its grid (evenly, or in its logarithm
/// where that spans more than a factor of five). The direction of its amplitudes has each by its
/// typical size, either sign where both are allowed. The amplitude beyond neutral, in sigmas, is
/// log-uniform from `least` to `most`, or to the amplitudes' bounds. Sigma is that along the
/// direction, from the Fisher information with all that the fit has free projected out, and with
/// `beside` too. There is no mode where the bounds do not allow `least`.
struct DrawOptions {
  double least = 8, most = 50;
};
DrawnMode draw_mode(const RecordingInformation& information, const HiddenMode& mode,
                    const DrawOptions& options, std::uint64_t seed,
                    const Eigen::MatrixXd& beside = {});

/// Returns the effect as the truth has it.
HiddenEffect hidden_effect(const DrawnMode& drawn);

/// Returns derivatives of every mode at every shape that a diagnosis tests, projected. They are in
/// the order of the information's modes and their shapes.
std::vector<std::vector<Eigen::MatrixXd>> projected_modes(const RecordingInformation& information);

/// Returns the right answers, in alphabetical order. They are the hidden effect and all effects
/// like it: one of their modes, at one shape of its grid, has derivatives whose multiple
/// correlation with the hidden one's is above 0.9.
std::vector<std::string> right_class(const RecordingInformation& information,
                                     const DrawnMode& drawn,
                                     const std::vector<std::vector<Eigen::MatrixXd>>& projected);

/// Returns how well modes of other effects together mimic it. It is the squared multiple
/// correlation of the `most` that do it best, chosen one after the other, each at its best shape.
/// `most` is as many as a diagnosis may add. All modes at all shapes, hundreds of smooth functions,
/// mimic anything.
double mimicked_by_others(const RecordingInformation& information, const DrawnMode& drawn,
                          const std::vector<std::vector<Eigen::MatrixXd>>& projected, int most);

}  // namespace clothfit
