#pragma once

#include "fit/diagnosis/analysis.h"

namespace clothfit {

/// Fits the declared model to all recordings, on the mesh that is to be analysed. That mesh has
/// twice the cells a side where the fit leaves clearly less with them. A model that misfits grossly
/// is left unrefined where a coarser mesh may show what it lacks. Throws GivenUp where no fit works
/// out.
void fit_base(Analysis& analysis, const ProgressCallback& progress);

}  // namespace clothfit
