#include "data/model_description.h"

#include <fmt/format.h>

#include <cmath>
namespace clothfit {

std::string ModelDescription::where(int line) const {
  if (file.empty()) return name;
  return line > 0 ? fmt::format("{}:{}", file, line) : file;
}

std::optional<std::vector<double>> frame_times(double frame_rate_hz, double duration_s) {
  // A duration in decimals may miss its last frame by rounding.
  const double intervals = std::floor(duration_s * frame_rate_hz + 1e-6);
  if (!(intervals >= 1 && intervals <= kMostModelFrames - 1)) return std::nullopt;
  std::vector<double> times_s;
  for (int frame = 0; frame <= static_cast<int>(intervals); ++frame)
    times_s.push_back(frame / frame_rate_hz);
  return times_s;
}

}  // namespace clothfit
