#pragma once

#include "fit/diagnosis/analysis.h"

namespace clothfit {

/// Fits the model as declared to all recordings, on the mesh that is to be analysed: twice the
/// cells a side where that leaves clearly less. A model that misfits grossly is left unrefined
/// where a coarser mesh may show what it lacks. Throws GivenUp where no fit works out.
void fit_base(Analysis& analysis, const ProgressCallback& progress);

}  // namespace clothfit
