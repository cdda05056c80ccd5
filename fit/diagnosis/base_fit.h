#pragma once

#include <optional>

#include "fit/diagnosis/analysis.h"

namespace clothfit {

/// Returns chi-square per residual beyond which a fit need only follow a coarser mesh
/// (FitOptions::coarse_beyond), for what is missing shows on any. Infinite where there is no
/// coarser one, or a finer one may be analysed.
double coarse_will_do_beyond(const DiagnosisSetup& setup);

/// Returns the mean square, over the noise's, of the error that mesh and time step were found to
/// make of a fit (Adequacy::discretisation_found). 0 where the model misfits grossly: it is not
/// looked for then. Nothing where `progress` says to stop. Takes a fit on another mesh from where
/// this one stands.
std::optional<double> discretisation_of_fit(const FitInput& input, const FitOptions& options,
                                            const FitReport& report,
                                            const ProgressCallback& progress);

/// Fits the declared model to all recordings, on the mesh that is to be analysed. That mesh has
/// twice the cells a side where the fit leaves clearly less with them. A model that misfits grossly
/// is left unrefined where a coarser mesh may show what it lacks. Throws GivenUp where no fit works
/// out.
void fit_base(Analysis& analysis, const ProgressCallback& progress);

}  // namespace clothfit
