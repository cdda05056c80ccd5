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

/// Returns chi-square per residual beyond which a model misfits grossly.
double grossly_misfitting(bool starts_in_motion);

/// Parameters of one recording's problem by name.
using NamedValues = std::map<std::string, double>;

/// The input that all fits of a diagnosis share: recordings of one cloth.
struct DiagnosisSetup {
  std::span<const FitInput> inputs;
  const FitOptions& options;
  int columns = 0, rows = 0;  ///< of the mesh
};

/// The progress of a fit.
enum class FitState {
  not_run,
  failed,     ///< no fit worked out, or the model does not run
  unrefined,  ///< its derivatives were updated alone, or it was not refined on its own mesh
  complete    ///< residuals and derivatives are those where it stands
};

/// The place where a model of the recordings stands, as plain data. restored() makes the model
/// again from it, on any machine.
struct ModelFit {
  struct OfRecording {
    NamedValues values;
    int frames = 0;
    TimeSteps steps = 0;
  };
  std::vector<Hypothesis> hypotheses;
  std::vector<OfRecording> recordings;
};

/// A model of the recordings with some hypotheses, fitted to their first frames. It holds its
/// problems, and its values and derivatives where it stands.
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
  /// Returns residuals of all recordings in turn, less what the discretisation explains.
  Eigen::VectorXd residual() const;
  /// Returns chi-square per residual, over the residuals of residual().
  double misfit() const;
  /// Tells whether it leaves so much that any mesh shows what it lacks. A finer mesh is not what it
  /// lacks then. Its time steps are often short, because far too much damping stands in for what is
  /// missing.
  bool misfits_grossly() const;
  /// Returns twice the cost: the sum of squares, linear beyond `threshold` sigmas (Huber), and of
  /// priors.
  double chi_square(double threshold) const;
};

/// Makes each recording's problem, with all constants of the model's hypotheses.
std::vector<std::shared_ptr<const FitProblem>> problems_of(
    const DiagnosisSetup& setup, const std::vector<Hypothesis>& hypotheses);

/// Returns a recording's options with hypotheses, and priors of the shapes that these fit. Only the
/// first recording's options say what is known of shared parameters.
FitOptions options_with(const DiagnosisSetup& setup, const std::vector<Hypothesis>& hypotheses,
                        size_t recording);

/// Returns the same options on the mesh that is analysed, whatever a recording suggests.
FitOptions options_on_mesh(const DiagnosisSetup& setup, const std::vector<Hypothesis>& hypotheses,
                           size_t recording);

/// Returns a problem's parameters at values known by name. Where a value is not known, an amplitude
/// of an effect is neutral, and any other parameter is where a fit begins.
Eigen::VectorXd values_of(const FitProblem& problem, const NamedValues& known);

/// Makes the model at values known by name, over all fitted frames. It is not linearised.
FittedModel model_at(const DiagnosisSetup& setup, const std::vector<Hypothesis>& hypotheses,
                     const std::vector<NamedValues>& values);

/// Makes the model where a fit stands. It is not linearised.
FittedModel restored(const DiagnosisSetup& setup, const ModelFit& fit);

/// Sets a hypothesis' amplitudes in values by name, counted from neutral. Those of the measurement
/// are each recording's own: they come one recording after the other.
void set_amplitudes(const Hypothesis& hypothesis, const Eigen::VectorXd& beyond_neutral,
                    std::vector<NamedValues>& values);

/// Returns how many frames are such a share of a recording's fitted ones: a handful at least.
int frames_of_share(const FitProblem& problem, double share);

/// Returns the same model over that share of the frames. What is known of the longer run is kept,
/// for the shorter run is its beginning.
FittedModel shortened(const FittedModel& model, double share);

struct StageOptions {
  int rounds = 2;
  int iterations = 20;
  /// Exact derivatives of each recording in one fit. They cost tens of runs, and a model that takes
  /// more of them is wrong, or near enough.
  int linearisations = 8;
  /// A step that promises less than this of half chi-square is the last one. The default moves no
  /// parameter by a seventh of its sigma.
  double least_decrease = 0.01;
  bool own_only = false;   ///< what recordings share stays
  bool unrefined = false;  ///< with the derivatives that it has, updated (fit/refine/pooled_fit.h)
};

/// A model that still lacks much, or runs a race, need not stand at its optimum.
inline constexpr StageOptions kNearEnough{.linearisations = 3};
/// What it leaves there beyond another model may yet fall by this factor.
inline constexpr double kNearEnoughFallsBy = 10;

/// Refines a model from where it stands, with the derivatives that it has or new ones.
void refine_model(FittedModel& model, const DiagnosisSetup& setup, const StageOptions& options,
                  const ProgressCallback& progress);

/// Computes exact derivatives where the model stands.
void linearise_model(FittedModel& model);

/// Returns the setup with a mesh of half the cells a side, for derivatives that only choose. The
/// mesh does not go below 9 x 9 vertices or the nodes of a start in motion. Where natural lengths
/// are those of one mesh, it stays the same.
DiagnosisSetup with_coarse_mesh(const DiagnosisSetup& setup);

/// Tells whether a mesh has fewer vertices a side than another.
bool is_coarser(const DiagnosisSetup& mesh, const DiagnosisSetup& than);

/// Returns the model where it stands, with its residuals and the derivatives of another mesh. The
/// meshes' predictions hardly differ, and a mesh of half the cells a side costs a sixteenth. The
/// model has failed where the other mesh does not run.
FittedModel with_derivatives_of(const DiagnosisSetup& other_mesh, const FittedModel& model);

/// Returns the model on another mesh where it stands, linearised, with the difference of the meshes
/// there as a correction. So it leaves what `model` leaves. The model has failed where the other
/// mesh does not run.
FittedModel corrected_on_mesh(const DiagnosisSetup& other_mesh, const FittedModel& model);

}  // namespace clothfit
