#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "apps/study/scene/synthetic_recording.h"
#include "fit/diagnosis/catalogue.h"
#include "fit/diagnosis/fitted_model.h"
#include "fit/diagnosis/projection.h"

namespace clothfit {

/// A law that a study hides in the truth.
struct HiddenLaw {
  std::string effect, law;  ///< as the effect names it; empty where it has but one
  std::string title() const { return law.empty() ? effect : effect + " (" + law + ")"; }
};

/// The library's laws for a kind of observation. Left out are those that are, of such a recording,
/// near enough what a fit has free anyway, and those that need a geometry (contacts).
std::vector<HiddenLaw> hidden_laws(ObservationKind observations);

/// What a recording says of laws before any noise: a linear model of the fit around the truth
/// without hidden effects, over the fitted frames, on the truth's mesh (of twice the cells a side
/// of the fit's at most).
struct RecordingInformation {
  SyntheticRecording recording;       ///< without noise, of a cloth on that mesh
  std::vector<ShapeCandidates> laws;  ///< that a diagnosis tests
  FittedModel model;
  ModelProjection projection;  ///< everything that the fit has free is taken out
};

/// For the release of `seed`. Throws InputError where the scene cannot be simulated or has no
/// derivatives.
RecordingInformation recording_information(const SyntheticScene& scene, const FitOptions& fit,
                                           std::uint64_t seed);

/// A hidden law with its numbers.
struct DrawnLaw {
  Hypothesis term;            ///< the shape drawn
  Eigen::VectorXd amplitude;  ///< of each amplitude beyond neutral, in its unit
  double sigmas = 0;          ///< how many of its standard deviations it amounts to
  Eigen::VectorXd projected;  ///< derivative of the residuals by `sigmas`, projected; length 1
};

/// Draws a law's shape inside the range of its grid (evenly, or in its logarithm where that spans
/// more than a factor of five), the direction of its amplitudes (each by its typical size, either
/// sign where both are allowed), and how many sigmas it amounts to: log-uniform from `least` to
/// `most`, or to what the amplitudes' bounds allow. Sigma is that of the amount along the
/// direction, from the Fisher information with all that the fit has free projected out, and with
/// `beside` too. No term where the bounds do not let it amount to `least`.
struct DrawOptions {
  double least = 8, most = 50;
};
DrawnLaw draw_law(const RecordingInformation& information, const HiddenLaw& law,
                  const DrawOptions& options, std::uint64_t seed,
                  const Eigen::MatrixXd& beside = {});

/// The effect as the truth is told it.
HiddenEffect hidden_effect(const DrawnLaw& drawn);

/// Derivatives of every law at every shape that a diagnosis tests, projected; in the order of the
/// information's laws and their shapes.
std::vector<std::vector<Eigen::MatrixXd>> projected_laws(const RecordingInformation& information);

/// The right answers: the hidden effect, and all effects of which one law, at one shape of its
/// grid, has derivatives whose multiple correlation with the hidden one's is above 0.9. In
/// alphabetical order.
std::vector<std::string> right_class(const RecordingInformation& information, const DrawnLaw& drawn,
                                     const std::vector<std::vector<Eigen::MatrixXd>>& projected);

/// How well laws of other effects together mimic it: the squared multiple correlation of the `most`
/// that do it best, chosen one after the other, each at its best shape. As many as a diagnosis may
/// add: all laws at all shapes, hundreds of smooth functions, mimic anything.
double mimicked_by_others(const RecordingInformation& information, const DrawnLaw& drawn,
                          const std::vector<std::vector<Eigen::MatrixXd>>& projected, int most);

}  // namespace clothfit
