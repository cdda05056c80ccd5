#pragma once

#include <string>
#include <vector>

#include "data/recording.h"
#include "fit/interface/fit_report.h"

namespace clothfit {

/// One picture of a recording, for a figure to draw on.
struct BackgroundPicture {
  std::string kind;  ///< as ObservationErrors::kind: the camera's name
  int frame = 0;
  int width = 0;   ///< px
  int height = 0;  ///< px
  std::string jpeg;
};

/// Returns the frame that an overlay shows: the last one that still shows at least half as many
/// markers as the best frame does. It is held out where any are. The last is the hardest to
/// predict. -1 when there are no rows.
int overlay_frame(const FitReport::Residuals& residuals);

/// Reads the picture of the overlay frame for each camera that was fitted and has pictures. A
/// picture that cannot be read is left out: the fit does not depend on it.
std::vector<BackgroundPicture> background_pictures(const FitReport& report,
                                                   const Recording& recording);

}  // namespace clothfit
