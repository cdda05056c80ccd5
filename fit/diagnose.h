#pragma once

#include <string>
#include <vector>

#include "fit/diagnosis/adequacy.h"
#include "fit/diagnosis/cross_validation.h"
#include "fit/diagnosis/law_score.h"
#include "fit/diagnosis/proposed_law.h"
#include "fit/diagnosis/residual_force.h"
#include "fit/diagnosis/term.h"
#include "fit/fit.h"

namespace clothfit {

struct DiagnoseOptions {
  FitOptions fit;
  /// Effects that are not tested.
  std::vector<std::string> without;
  int lines = 3;   ///< of search that are followed side by side
  int refits = 6;  ///< laws of each line that are fitted in one round
  int most_effects = 4;
  void validate() const;  ///< throws InputError
};

enum class DiagnosisVerdict {
  adequate,          ///< nothing is missing that this recording could show
  explained,         ///< effects were accepted, and what is left looks like noise
  partly_explained,  ///< effects were accepted, and structure remains
  unexplained        ///< structure, and no effect that explains it
};
std::string to_string(DiagnosisVerdict verdict);

/// What is said of a law with which a model was fitted again.
struct LawTrial {
  Term term;
  double foreseen_fall = 0;                    ///< of chi-square, by the score
  double fall = 0;                             ///< by the fit
  double cross_validated = 0, without_it = 0;  ///< chi-square per observation left out
  double best_trivial = 0;                     ///< the same of the model without it, mended
  double clear_of_neutral = 0;                 ///< standard deviations, clustered
  std::string refused;                         ///< why it is not accepted; empty: it is
};

/// One effect that was accepted, with what speaks for it.
struct AcceptedEffect {
  LawTrial trial;
  std::vector<Term> alike;        ///< laws that this recording cannot tell from it
  std::vector<LawTrial> refused;  ///< other laws that were fitted in its place
};

/// What a law would have to amount to for this recording to show it.
struct DetectionLimit {
  Term term;  ///< at the shape it was seen best
  std::vector<std::string> parameter;
  std::vector<std::string> unit;
  Eigen::VectorXd limit;  ///< five standard deviations of each amplitude beyond neutral
  Eigen::VectorXd found;  ///< what the score foresees
  double fall = 0;        ///< of chi-square, foreseen
};

struct Diagnosis {
  FitStop stop = FitStop::converged;
  std::string message;
  DiagnosisVerdict verdict = DiagnosisVerdict::adequate;
  FitReport base, found;  ///< the fit of the recording as declared, and with what was accepted
  Adequacy before, after;
  std::vector<LawScore> scores;          ///< of the base model, the most telling first
  int columns = 0, rows = 0;             ///< of the mesh that was analysed
  int score_frames = 0;                  ///< horizon of these
  std::vector<AcceptedEffect> accepted;  ///< in the order in which they were
  std::vector<LawTrial> refused;         ///< the last round's
  std::vector<DetectionLimit> limits;
  ResidualForce residual_force;  ///< of the model as declared, over its first frames
  ProposedLaw law;               ///< for what is left, where that has structure
  FitReport with_law;            ///< the fit with it, where there is one
  double seconds = 0;
  bool usable() const { return stop != FitStop::cancelled && stop != FitStop::diverged; }
};

/// Which effect does a fitted model lack? Fits the recording as it is declared, looks for structure
/// in what is left, tests every registered law, adds what explains it, one after the other, and
/// judges the outcome on frames held out, which take part in no decision
/// (docs/theory/diagnosis.md). Throws InputError for a recording that cannot be fitted as it
/// stands.
Diagnosis diagnose(const FitInput& input, const DiagnoseOptions& options,
                   const ProgressCallback& progress);

}  // namespace clothfit
