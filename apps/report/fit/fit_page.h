#pragma once

#include <string>
#include <vector>

#include "apps/report/fit/background_picture.h"
#include "data/recording.h"
#include "fit/interface/fit_report.h"

namespace clothfit {

/// Writes report.html of a fit: one self-contained page, readable without JavaScript and in print.
std::string fit_page_html(const FitReport& report, const Recording& recording,
                          const std::vector<BackgroundPicture>& pictures);

/// Draws the page's overlay of observed and predicted markers as a file of its own (SVG). It shows
/// the first kind of observation and is empty when nothing was observed.
std::string overlay_svg(const FitReport& report, const Recording& recording,
                        const std::vector<BackgroundPicture>& pictures);

}  // namespace clothfit
