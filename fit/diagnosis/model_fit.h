#pragma once

#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "fit/diagnosis/term.h"
#include "fit/refine/pooled_fit.h"

namespace clothfit {

/// Chi-square per residual beyond which a model is hopelessly far off.
inline constexpr double kHopeless = 30;

/// Parameters of one recording's problem by name.
using NamedValues = std::map<std::string, double>;

/// What all fits of a diagnosis share: recordings of one cloth.
struct DiagnosisSetup {
  std::span<const FitInput> inputs;
  const FitOptions& options;
  int columns = 0, rows = 0;  ///< of the mesh
};

/// A model of the recordings with some effects, fitted to their first frames.
struct ModelFit {
  std::vector<Term> terms;
  std::vector<std::shared_ptr<const FitProblem>> problems;  ///< of each recording
  std::vector<PooledPart> parts;                            ///< where each stands, linearised
  bool usable = false;
  bool cancelled = false;
  bool rough = false;  ///< as StageOptions::rough left it, or not refined on its mesh at all

  std::vector<const FitProblem*> problem_pointers() const;
  TrajectoryObjective objective(size_t recording) const;
  std::vector<NamedValues> values() const;
  Eigen::Index residual_count() const;
  /// Of all recordings, one after the other, with what the discretisation explains taken out.
  Eigen::VectorXd residual() const;
  /// Whether it leaves so much that any mesh shows what it lacks, and a finer one is not it. Its
  /// time steps are often short: what is missing is made up for by far too much damping.
  bool is_hopeless() const;
  /// Twice the cost: the sum of squares, beyond `threshold` sigmas linear (Huber), and of priors.
  double chi_square(double threshold) const;
};

/// The model's problem of each recording; all constants of its terms are in.
std::vector<std::shared_ptr<const FitProblem>> problems_of(const DiagnosisSetup& setup,
                                                           const std::vector<Term>& terms);

/// Recording `recording`'s options, with the priors of the shapes that terms fit. What is known of
/// shared parameters is told once.
FitOptions options_with(const DiagnosisSetup& setup, const std::vector<Term>& terms,
                        size_t recording);

/// A problem's parameters at values known by name. Of those that are not known, amplitudes of
/// effects are neutral and others where a fit begins.
Eigen::VectorXd values_of(const FitProblem& problem, const NamedValues& known);

/// The model at values known by name. Not linearised.
ModelFit model_at(const DiagnosisSetup& setup, const std::vector<Term>& terms,
                  const std::vector<NamedValues>& values);

/// Frames of a recording that are such a share of its fitted ones; a handful at least.
int frames_of_share(const FitProblem& problem, double share);

/// The same model over that share of the frames: with what is known of the longer run, which it is
/// the beginning of.
ModelFit shortened(const ModelFit& model, double share);

struct StageOptions {
  int rounds = 2;
  int iterations = 12;
  /// A step that promises less than this of half chi-square is the last one; the default moves no
  /// parameter by a seventh of its sigma.
  double least_fall = 0.01;
  bool own_only = false;  ///< what is shared by recordings stays
  bool rough = false;     ///< with the derivatives that it has, updated (fit/refine/pooled_fit.h)
};

/// Refines a model from where it stands: with the derivatives that it has, or anew.
void refine_model(ModelFit& model, const DiagnosisSetup& setup, const StageOptions& options,
                  const ProgressCallback& progress);

/// Has exact derivatives where the model stands.
void linearise_model(ModelFit& model);

/// On a mesh of half the cells a side, for derivatives that only choose; not below 9 x 9 vertices
/// or what a start in motion has nodes. The same mesh where natural lengths are those of one.
DiagnosisSetup with_coarse_mesh(const DiagnosisSetup& setup);

/// Whether a mesh has fewer vertices a side than another.
bool is_coarser(const DiagnosisSetup& mesh, const DiagnosisSetup& than);

/// The model where it stands with the derivatives of another mesh: what they foresee hardly
/// differs, and of a mesh of half the cells a side they cost a sixteenth. The residuals are the
/// model's. Not usable where the other mesh does not run.
ModelFit with_derivatives_of(const DiagnosisSetup& other_mesh, const ModelFit& model);

}  // namespace clothfit
