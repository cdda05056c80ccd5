#pragma once

#include <optional>

#include "fit/diagnosis/analysis.h"

namespace clothfit {

/// Returns chi-square per residual beyond which a model misfits on a coarser mesh as on its own,
/// for FitOptions::coarse_beyond. Infinite where there is no coarser mesh to compare with.
double gross_on_any_mesh(const FitInput& input, const FitOptions& options);

/// Root mean squares, over the noise's, of the error that mesh and time step make of a fit: as it
/// is expected (Adequacy::discretisation_square) and as it was found in the fitted frames
/// (Adequacy::discretisation_found). Both are 0 where the model misfits grossly.
struct DiscretisationOfFit {
  double expected = 0, found = 0;
};

/// Looks for that error by a fit on another mesh from where this one stands. Returns nothing where
/// `progress` says to stop.
std::optional<DiscretisationOfFit> discretisation_of_fit(const FitInput& input,
                                                         const FitOptions& options,
                                                         const FitReport& report,
                                                         const ProgressCallback& progress);

/// Fits the declared model to all recordings, on the mesh that is to be analysed. That mesh has
/// twice the cells a side where the fit leaves clearly less with them. A model that misfits grossly
/// is left unrefined where a coarser mesh may show what it lacks. Throws GivenUp where no fit works
/// out.
void fit_base(Analysis& analysis, const ProgressCallback& progress);

}  // namespace clothfit
