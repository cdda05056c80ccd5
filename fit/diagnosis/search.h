#pragma once

#include <limits>
#include <string>
#include <vector>

#include "fit/diagnosis/cross_validation.h"
#include "fit/diagnosis/law_score.h"
#include "fit/diagnosis/model_fit.h"

namespace clothfit {

/// What is said of a law with which a model was fitted again; NaN where it was refused before that
/// was asked.
struct LawTrial {
  static constexpr double kNotAsked = std::numeric_limits<double>::quiet_NaN();
  /// Standard deviations from neutral that make a law sure. One that is not may be accepted where
  /// the model without it is far off, so that sigmas say little: if it takes a good part of what is
  /// left, and foresees no block that was left out worse.
  static constexpr double kClear = 5;
  Term term;
  double foreseen_fall = 0;                                    ///< of chi-square, by the score
  double fall = kNotAsked;                                     ///< by the fit
  double cross_validated = kNotAsked, without_it = kNotAsked;  ///< chi-square per one left out
  double best_trivial = kNotAsked;      ///< the same of the model without it, mended
  double clear_of_neutral = kNotAsked;  ///< standard deviations, clustered
  std::string refused;                  ///< why it is not accepted; empty: it is
  /// Corrections without physics did as well as it alone: it is accepted for what it does together
  /// with laws accepted after it, with which it beat them.
  bool with_later_ones = false;
};

/// One effect that was accepted, with what speaks for it.
struct AcceptedEffect {
  LawTrial trial;
  std::vector<Term> alike;        ///< laws that these recordings cannot tell from it
  std::vector<LawTrial> refused;  ///< other laws that were fitted in its place
};

struct SearchOptions {
  std::vector<LawShapes> laws;  ///< to test
  int lines = 3;                ///< that are followed side by side
  int refits = 6;               ///< laws of each line that are fitted in one round
  size_t most_effects = 4;
  /// Residuals beyond it count less (Huber), in sigmas; infinite for squares.
  double threshold = 1e300;
};

/// Of the cross-validation, where one recording is fitted.
inline constexpr int kTimeBlocks = 5;

/// Of what a model leaves above the noise, what is too much to be passed over.
inline constexpr double kGoodPart = 0.25;

/// What a law must take of a model's chi-square to be worth a name, however sure it is. Noise is
/// known to three tenths of a per cent at best. And a model whose own numerics err leaves structure
/// that many laws follow a little: what is missing takes a third of all that is surely above the
/// noise, or, where much is missing that no single law explains, a twentieth of all that is left
/// and a quarter of the noise. Nor is the form of a law known better than to a per cent: beside
/// laws that explain much (`explained`, of chi-square), little more is worth a name.
double worth_naming(const ModelFit& model, double threshold, double explained = 0);

struct LawSearch {
  bool cancelled = false;
  ModelFit model;  ///< the best line's
  /// What the search began with where that was refined, or moved to another valley, where it leaves
  /// less; otherwise not usable.
  ModelFit base;
  bool moved = false;                    ///< whether laws have led it to another valley
  double threshold = 0;                  ///< there, as SearchOptions::threshold
  std::vector<AcceptedEffect> accepted;  ///< in the order in which they were
  std::vector<LawTrial> refused;         ///< the last round's
  std::vector<LawScore> first;           ///< scores in the model that the search began with
  double first_share = 1;                ///< of the frames, where they were had
  std::vector<LawScore> last;            ///< what laws that are not in it would still explain
};

/// Adds laws to a model, one after the other: each round scores all of them, fits the model again
/// with the best, and keeps what predicts observations left out. Several lines are followed, always
/// the one that is best; a line costs what its model leaves, and a price for each number more
/// (Bayesian information criterion). `base` is linearised and has its directions, or is hopelessly
/// far off and rough: it is refined where no law takes nearly all of what it leaves. Where even the
/// best law leaves a model far off, laws are identified from scratch; a line whose own model leaves
/// less in the valley that this finds moves there, and laws are judged against it. Laws for a model
/// that is hopelessly far off are chosen on a mesh of half the cells a side.
///
/// Where several causes are at work, corrections without physics may do as well as each one alone,
/// and not as well as all of them. So a law that mends a good part of the rest is followed all the
/// same, and its line owes to leave less, in the end, than those corrections did. A line that still
/// owes it when nothing leads on from it is given up for the best one that does not.
LawSearch search_laws(const DiagnosisSetup& setup, ModelFit base, const SearchOptions& options,
                      const ProgressCallback& progress);

}  // namespace clothfit
