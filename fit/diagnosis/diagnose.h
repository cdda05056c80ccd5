#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "fit/diagnosis/adequacy.h"
#include "fit/diagnosis/planting.h"
#include "fit/diagnosis/proposed_law.h"
#include "fit/diagnosis/residual_force.h"
#include "fit/diagnosis/search.h"
#include "fit/diagnosis/separation.h"
#include "fit/interface/fit_input.h"
#include "fit/interface/fit_options.h"
#include "fit/interface/fit_report.h"

namespace clothfit {

struct DiagnoseOptions {
  FitOptions fit;
  /// Effects that are not tested.
  std::vector<std::string> without;
  int lines = 3;   ///< of search that are followed side by side
  int refits = 6;  ///< laws of each line that are fitted in one round
  int most_effects = 4;
  int law_terms = 4;  ///< of a law that is proposed for what remains, at most; 0: none is
  /// Laws whose detection limits are confirmed by planting them on twins of the recordings, one of
  /// each effect, those first that are seen best.
  int plants = 0;
  bool reinject = false;  ///< whether what was found is simulated and searched again
  bool separate = true;   ///< whether recordings are sought that tell laws apart that are alike
  void validate() const;  ///< throws InputError
};

enum class DiagnosisVerdict {
  adequate,          ///< nothing is missing that this recording could show
  explained,         ///< something was accepted, and what is left looks like noise
  partly_explained,  ///< something was accepted, and structure remains
  unexplained        ///< structure, and nothing that explains it
};
std::string to_string(DiagnosisVerdict verdict);

/// What a law would have to amount to for this recording to show it.
struct DetectionLimit {
  Term term;  ///< at the shape it was seen best
  std::vector<std::string> parameter;
  std::vector<std::string> unit;
  /// Of each amplitude beyond neutral: where it stands five standard deviations clear and is worth
  /// a name (fit/diagnosis/search.h).
  Eigen::VectorXd limit;
  Eigen::VectorXd found;  ///< what the score foresees
  double fall = 0;        ///< of chi-square, foreseen
};

/// One recording with the model as declared, with what was accepted, and with the proposed law
/// where there is one.
struct DiagnosedRecording {
  bool held_out = false;  ///< as a whole: it took part in no fit and no decision
  FitReport before, after, with_law;
};

/// Constants by which markers are seen beside where the model has them
/// (fit/observe/marker_offsets.h).
struct SeenElsewhere {
  double rms_m = 0;  ///< of a coordinate: how far, and the standard deviation of their prior
  /// Chi-square per number left out (fit/diagnosis/cross_validation.h), with them and without.
  double cross_validated = 0, without_it = 0;
};

struct Diagnosis {
  FitStop stop = FitStop::converged;
  std::string message;
  DiagnosisVerdict verdict = DiagnosisVerdict::adequate;
  /// Those that were fitted, then those held out: reports of the fit of all on the mesh that was
  /// analysed (report_at). Of a single recording on its own mesh `before` is its own fit, unless
  /// that only followed a coarser mesh, or the search for laws has found another valley where the
  /// model without any leaves less.
  std::vector<DiagnosedRecording> recordings;
  Adequacy before, after;
  std::vector<LawScore> scores;  ///< of the base model, the most telling first
  int columns = 0, rows = 0;     ///< of the mesh that was analysed
  int score_frames = 0;          ///< horizon of these, of the first recording
  /// Where constants for the markers mended what laws had left: laws accepted after that were found
  /// beside them.
  std::optional<SeenElsewhere> seen_elsewhere;
  std::vector<AcceptedEffect> accepted;  ///< in the order in which they were
  /// Of each accepted effect, what would tell it from each law that is alike; or empty.
  std::vector<std::vector<Separation>> separations;
  std::vector<LawTrial> refused;  ///< the last round's
  std::vector<DetectionLimit> limits;
  std::vector<PlantOutcome> plants;  ///< of some of them
  /// What a search finds on twins simulated with what was accepted: nothing, if all is well.
  std::optional<PlantOutcome> reinjected;
  ResidualForce residual_force;  ///< of the model as declared, over its first frames
  ProposedLaw law;               ///< for what is left, where that has structure
  double seconds = 0;
  bool usable() const { return stop != FitStop::cancelled && stop != FitStop::diverged; }
  /// Whether the model found is another one than the one declared.
  bool changed() const { return seen_elsewhere.has_value() || !accepted.empty(); }
  /// Of accepted effect `n`.
  std::span<const Separation> separation_of(size_t n) const {
    return n < separations.size() ? std::span<const Separation>(separations[n])
                                  : std::span<const Separation>();
  }
  /// The first recording's. There is one.
  const FitReport& base() const { return recordings.front().before; }
  const FitReport& found() const { return recordings.front().after; }
  const FitReport& with_law() const { return recordings.front().with_law; }
};

/// Which effect does a fitted model lack? Fits recordings of one cloth as they are declared, looks
/// for structure in what is left, tests every registered law, adds what explains it, one after the
/// other, and judges the outcome on frames and recordings held out, which take part in no decision
/// (docs/theory/diagnosis.md). Parameters of the physics are those of all recordings; where each
/// was placed, measured, or began is its own, and that alone is fitted of a recording held out.
/// Throws InputError for recordings that cannot be fitted as they stand, or not together.
Diagnosis diagnose(std::span<const FitInput> fitted, std::span<const FitInput> held_out,
                   const DiagnoseOptions& options, const ProgressCallback& progress);

/// Of one recording.
Diagnosis diagnose(const FitInput& input, const DiagnoseOptions& options,
                   const ProgressCallback& progress);

}  // namespace clothfit
