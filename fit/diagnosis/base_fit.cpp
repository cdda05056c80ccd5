#include "fit/diagnosis/base_fit.h"

#include <cmath>
#include <limits>
#include <utility>

#include "fit/diagnosis/adequacy.h"
#include "fit/diagnosis/criteria.h"
#include "fit/diagnosis/discretisation.h"
#include "fit/diagnosis/refit.h"
#include "fit/fit.h"
#include "fit/jobs/stop_token.h"
#include "fit/problem/parameterised_model.h"

namespace clothfit {
namespace {

/// Fits the model that a fit of the first recording found to all of them, and linearises it.
FittedModel fitted_to_all(const DiagnosisSetup& setup, const FitReport& first,
                          const ProgressCallback& progress) {
  const std::vector<NamedValues> values(setup.inputs.size(), first.values);
  FittedModel base = model_at(setup, {}, values);
  if (setup.inputs.size() > 1) return fit_on_mesh(setup, base, progress);
  PooledPart& part = base.parts.front();
  const FitProblem& problem = *base.problems.front();
  part.steps = time_steps_of_run(problem.cloth, parameter_set(problem, part.values),
                                 first.result.time_step_s);
  linearise_model(base);
  return base;
}

/// Fits the model on a finer mesh: identified there from scratch, or led there from its own.
FittedModel on_finer_mesh(const DiagnosisSetup& finer, const FittedModel& own,
                          const ProgressCallback& progress) {
  // A fit from where the declared mesh's optimum lies can end in another basin.
  if (finer.inputs.size() == 1)
    if (FittedModel model = identified_from_scratch(finer, {}, progress); model.usable())
      return model;
  FittedModel model = fit_on_mesh(finer, own, progress);
  if (model.usable() && model.is_unrefined()) {
    // Optima are compared, and updated derivatives stop short of them.
    for (PooledPart& part : model.parts) part.linear = {};
    refine_model(model, finer, {}, progress);
  }
  if (model.usable()) linearise_model(model);
  return model;
}

/// Returns the model on the mesh that is to be analysed, and gives that mesh to `setup`.
/// Derivatives of a mesh that cannot follow the cloth mistake one effect for another.
FittedModel on_mesh_to_analyse(FittedModel own, DiagnosisSetup& setup,
                               const ProgressCallback& progress) {
  if (setup.options.spring_set != SpringSet::fabric) return own;
  const DiagnosisSetup other = with_other_mesh(setup);
  if (other.columns < setup.columns) return own;
  FittedModel finer = on_finer_mesh(other, own, progress);
  const double least_gain = kCriteria.finer_mesh_gain * static_cast<double>(own.residual_count());
  if (!finer.usable() || own.residual().squaredNorm() - finer.residual().squaredNorm() < least_gain)
    return own;
  setup.columns = other.columns;
  setup.rows = other.rows;
  return finer;
}

/// Returns chi-square per residual beyond which a fit need only follow a coarser mesh
/// (FitOptions::coarse_beyond), for what is missing shows on any. Infinite where there is no
/// coarser one, or a finer one may be analysed.
double coarse_will_do_beyond(const DiagnosisSetup& setup) {
  const bool will_do =
      is_coarser(with_coarse_mesh(setup), setup) && is_coarser(with_other_mesh(setup), setup);
  if (!will_do) return std::numeric_limits<double>::infinity();
  return grossly_misfitting(setup.inputs.front().recording.start == StartKind::unknown);
}

}  // namespace

double gross_on_any_mesh(const FitInput& input, const FitOptions& options) {
  const ClothDescription& cloth = input.recording.cloth;
  const DiagnosisSetup setup{
      .inputs = {&input, 1},
      .options = options,
      .columns = options.mesh_columns > 0 ? options.mesh_columns : cloth.mesh_columns,
      .rows = options.mesh_rows > 0 ? options.mesh_rows : cloth.mesh_rows};
  if (!is_coarser(with_coarse_mesh(setup), setup)) return std::numeric_limits<double>::infinity();
  return grossly_misfitting(input.recording.start == StartKind::unknown);
}

std::optional<DiscretisationOfFit> discretisation_of_fit(const FitInput& input,
                                                         const FitOptions& options,
                                                         const FitReport& report,
                                                         const ProgressCallback& progress) try {
  FitOptions own = options;
  own.is_cancelled = throwing_check(options.is_cancelled);
  const DiagnosisSetup setup{.inputs = {&input, 1},
                             .options = own,
                             .columns = report.result.mesh_columns,
                             .rows = report.result.mesh_rows};
  FittedModel model = fitted_to_all(setup, report, progress);
  if (!model.usable() || model.misfits_grossly()) return DiscretisationOfFit{};
  refine_with_discretisation(model, setup, progress);
  if (!model.usable()) return DiscretisationOfFit{};
  return DiscretisationOfFit{.expected = std::sqrt(discretisation_expected(model)),
                             .found = std::sqrt(discretisation_found(model))};
} catch (const StopRequested&) {
  return std::nullopt;
}

void fit_base(Analysis& analysis, const ProgressCallback& progress) {
  // A model that lacks something large is drawn far away, at ever shorter time steps. Its optimum
  // says no more than what a part of the work finds.
  FitOptions options = analysis.options;
  options.work *= kCriteria.first_work;
  DiagnosisSetup& setup = analysis.setup;
  const ClothDescription& cloth = setup.inputs.front().recording.cloth;
  setup.columns = options.mesh_columns > 0 ? options.mesh_columns : cloth.mesh_columns;
  setup.rows = options.mesh_rows > 0 ? options.mesh_rows : cloth.mesh_rows;
  options.coarse_beyond = coarse_will_do_beyond(setup);
  const bool coarse_will_do = std::isfinite(options.coarse_beyond);

  analysis.first = fit(setup.inputs.front(), options, progress);
  if (analysis.first.stop == FitStop::cancelled) throw StopRequested();
  if (!analysis.first.usable()) throw GivenUp{analysis.first.stop, analysis.first.message};
  FittedModel base = fitted_to_all(setup, analysis.first, progress);
  if (!base.usable())
    throw GivenUp{FitStop::diverged, "the derivatives at the optimum could not be computed"};
  base = on_mesh_to_analyse(std::move(base), setup, progress);
  base.state = coarse_will_do && base.misfits_grossly() ? FitState::unrefined : FitState::complete;
  if (!base.is_unrefined()) refine_with_discretisation(base, setup, progress);
  if (!base.usable())
    throw GivenUp{FitStop::diverged, "the fit went astray where it was to be refined"};
  analysis.base = std::move(base);
}

}  // namespace clothfit
