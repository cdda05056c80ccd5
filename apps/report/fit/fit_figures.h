#pragma once

#include <string>
#include <vector>

#include "apps/report/fit/background_picture.h"
#include "data/recording.h"
#include "fit/interface/fit_report.h"

namespace clothfit {

/// Each of these figures of a fit is one <svg> element.

/// Draws the rms residual in each frame, beside the trivial predictors and the noise, with held-out
/// frames shaded.
std::string residual_over_time_svg(const FitReport::Residuals& residuals,
                                   const ObservationErrors& errors, const Recording& recording);

/// Draws the rms residual of each marker over the flat cloth: fitted frames, held-out frames.
/// Colours end at `largest`, in the shown unit; at the largest value where it is 0.
std::string residual_map_svg(const FitReport::Residuals& residuals, const Recording& recording,
                             double largest = 0);

/// Returns the largest value of such a map, in the shown unit.
double largest_marker_rms(const FitReport::Residuals& residuals);

/// Draws observed and predicted places in one frame, on its picture where there is one.
std::string observed_and_predicted_svg(const FitReport::Residuals& residuals,
                                       const Recording& recording,
                                       const std::vector<BackgroundPicture>& pictures);

/// Draws the best cost after each generation of the search.
std::string search_cost_svg(const std::vector<double>& cost);

}  // namespace clothfit
