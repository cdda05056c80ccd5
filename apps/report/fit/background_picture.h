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

/// The frame that an overlay shows: the last one, held out where there are any, that still shows
/// at least half as many markers as the best frame does. The last is the hardest to predict.
/// -1 when there are no rows.
int overlay_frame(const FitReport::Residuals& residuals);

/// For each camera that was fitted and has pictures, the picture of its overlay frame. A picture
/// that cannot be read is left out: the fit does not depend on it.
std::vector<BackgroundPicture> background_pictures(const FitReport& report,
                                                   const Recording& recording);

}  // namespace clothfit
