#pragma once

#include <string>
#include <vector>

#include "apps/report/fit/background_picture.h"
#include "data/recording.h"
#include "fit/interface/fit_report.h"

namespace clothfit {

/// Figures of a fit, each one <svg> element.

/// rms residual in each frame, beside the trivial predictors and the noise; held-out frames shaded.
std::string residual_over_time_svg(const FitReport::Residuals& residuals,
                                   const ObservationErrors& errors, const Recording& recording);

/// rms residual of each marker over the flat cloth: fitted frames, held-out frames. Colours end at
/// `largest`, in the shown unit; at the largest value where it is 0.
std::string residual_map_svg(const FitReport::Residuals& residuals, const Recording& recording,
                             double largest = 0);

/// The largest value of such a map, in the shown unit.
double largest_marker_rms(const FitReport::Residuals& residuals);

/// Observed and predicted places in one frame, on its picture where there is one.
std::string observed_and_predicted_svg(const FitReport::Residuals& residuals,
                                       const Recording& recording,
                                       const std::vector<BackgroundPicture>& pictures);

/// Best cost after each generation of the search.
std::string search_cost_svg(const std::vector<double>& cost);

}  // namespace clothfit
