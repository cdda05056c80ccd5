#pragma once

#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "fit/interface/fit_input.h"
#include "fit/interface/fit_options.h"
#include "fit/interface/hypothesis.h"
#include "fit/refine/pooled_fit.h"

namespace clothfit {

/// Parameters of one recording's problem by name.
using NamedValues = std::map<std::string, double>;

/// What all fits of a diagnosis share: recordings of one cloth.
struct DiagnosisSetup {
  std::span<const FitInput> inputs;
  const FitOptions& options;
  int columns = 0, rows = 0;  ///< of the mesh
};

/// How far a fit has come.
enum class FitState {
  not_run,
  failed,     ///< no fit worked out, or the model does not run
  unrefined,  ///< its derivatives were updated alone, or it was not refined on its own mesh
  complete    ///< residuals and derivatives are those where it stands
};

/// Where a model of the recordings stands: plain data, from which restored() makes it again on any
/// machine.
struct ModelFit {
  struct OfRecording {
    NamedValues values;
    int frames = 0;
    TimeSteps steps = 0;
  };
  std::vector<Hypothesis> hypotheses;
  std::vector<OfRecording> recordings;
};

/// A model of the recordings with some hypotheses, fitted to their first frames: where it stands,
/// with its problems and derivatives.
struct FittedModel {
  std::vector<Hypothesis> hypotheses;
  std::vector<std::shared_ptr<const FitProblem>> problems;  ///< of each recording
  std::vector<PooledPart> parts;                            ///< where each stands, linearised
  FitState state = FitState::not_run;

  bool usable() const { return state >= FitState::unrefined; }
  bool is_unrefined() const { return state == FitState::unrefined; }

  std::vector<const FitProblem*> problem_pointers() const;
  TrajectoryObjective objective(size_t recording) const;
  std::vector<NamedValues> values() const;
  ModelFit fit() const;
  Eigen::Index residual_count() const;
  /// Residuals of all recordings, one after the other, less what the discretisation explains.
  Eigen::VectorXd residual() const;
  /// Chi-square per residual of these.
  double misfit() const;
  /// Whether it leaves so much that any mesh shows what it lacks, and a finer one is not it. Its
  /// time steps are often short, because far too much damping stands in for what is missing.
  bool misfits_grossly() const;
  /// Twice the cost: the sum of squares, beyond `threshold` sigmas linear (Huber), and of priors.
  double chi_square(double threshold) const;
};

/// The model's problem of each recording, with all constants of its hypotheses.
std::vector<std::shared_ptr<const FitProblem>> problems_of(
    const DiagnosisSetup& setup, const std::vector<Hypothesis>& hypotheses);

/// Recording `recording`'s options with hypotheses, and priors of the shapes that these fit. Only
/// the first recording's say what is known of shared parameters.
FitOptions options_with(const DiagnosisSetup& setup, const std::vector<Hypothesis>& hypotheses,
                        size_t recording);

/// The same, on the mesh that is analysed, whatever a recording suggests.
FitOptions options_on_mesh(const DiagnosisSetup& setup, const std::vector<Hypothesis>& hypotheses,
                           size_t recording);

/// A problem's parameters at values known by name. Of those that are not known, amplitudes of
/// effects are neutral and others where a fit begins.
Eigen::VectorXd values_of(const FitProblem& problem, const NamedValues& known);

/// The model at values known by name, over all fitted frames. Not linearised.
FittedModel model_at(const DiagnosisSetup& setup, const std::vector<Hypothesis>& hypotheses,
                     const std::vector<NamedValues>& values);

/// The model where a fit stands. Not linearised.
FittedModel restored(const DiagnosisSetup& setup, const ModelFit& fit);

/// Frames of a recording that are such a share of its fitted ones; a handful at least.
int frames_of_share(const FitProblem& problem, double share);

/// The same model over that share of the frames. It keeps what is known of the longer run, whose
/// beginning it is.
FittedModel shortened(const FittedModel& model, double share);

struct StageOptions {
  int rounds = 2;
  int iterations = 12;
  /// A step that promises less than this of half chi-square is the last one; the default moves no
  /// parameter by a seventh of its sigma.
  double least_decrease = 0.01;
  bool own_only = false;   ///< what is shared by recordings stays
  bool unrefined = false;  ///< with the derivatives that it has, updated (fit/refine/pooled_fit.h)
};

/// Refines a model from where it stands, with the derivatives that it has or new ones.
void refine_model(FittedModel& model, const DiagnosisSetup& setup, const StageOptions& options,
                  const ProgressCallback& progress);

/// Has exact derivatives where the model stands.
void linearise_model(FittedModel& model);

/// A mesh of half the cells a side, for derivatives that only choose; not below 9 x 9 vertices or
/// the nodes of a start in motion. The same mesh where natural lengths are those of one.
DiagnosisSetup with_coarse_mesh(const DiagnosisSetup& setup);

/// Whether a mesh has fewer vertices a side than another.
bool is_coarser(const DiagnosisSetup& mesh, const DiagnosisSetup& than);

/// The model where it stands, with its residuals and the derivatives of another mesh. Their
/// predictions hardly differ, and a mesh of half the cells a side costs a sixteenth. Failed where
/// the other mesh does not run.
FittedModel with_derivatives_of(const DiagnosisSetup& other_mesh, const FittedModel& model);

}  // namespace clothfit
