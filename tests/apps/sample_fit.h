#pragma once

#include "data/recording.h"
#include "fit/fit.h"

namespace clothfit::test {

/// A made-up fit of a made-up recording of 24 frames, 16 of them fitted. A careless writer of HTML
/// would stumble over its names and reasons. The residuals are a fixed pattern.
struct SampleFit {
  Recording recording;
  FitReport report;
};

/// `coordinates`: 2 for one camera's pixels, 3 for positions in space.
SampleFit sample_fit(int coordinates);

}  // namespace clothfit::test
