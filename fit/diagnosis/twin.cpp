#include "fit/diagnosis/twin.h"

#include <algorithm>
#include <map>
#include <utility>

#include "fit/jobs/draws.h"

namespace clothfit {
namespace {

using Place = std::pair<int, int>;  ///< frame, marker

/// Replaces a kind's rows by a model's predictions with noise.
template <class Tracks, class SetPlace>
void reseed(Tracks& tracks, const FitReport::Residuals& truth, Draws& noise,
            const SetPlace& set_place) {
  std::map<Place, const FitReport::Residuals::Row*> seen;
  for (const FitReport::Residuals::Row& row : truth.rows) seen[{row.frame, row.marker}] = &row;
  std::erase_if(tracks, [&](auto& observed) {
    const auto row = seen.find({observed.frame, observed.marker});
    if (row == seen.end()) return false;  // drives a held point, or was rejected
    Eigen::VectorXd place = row->second->predicted;
    for (double& coordinate : place) coordinate += row->second->sigma * noise.normal();
    set_place(observed, place, row->second->sigma);
    return !place.allFinite();
  });
}

}  // namespace

FitInput twin_of(FitInput recording, const FitReport& truth, std::uint64_t seed) {
  constexpr int kSeries = 0x7717;
  for (size_t k = 0; k < truth.residuals.size(); ++k) {
    const FitReport::Residuals& kind = truth.residuals[k];
    Draws noise(seed, kSeries, static_cast<int>(k));
    if (kind.unit == "m") {
      reseed(recording.tracks3d, kind, noise,
             [](Position3d& at, const Eigen::VectorXd& place, double sigma) {
               at.position_m = place;
               at.sigma_m = sigma;
             });
    } else if (const auto tracks = recording.tracks2d.find(kind.kind);
               tracks != recording.tracks2d.end()) {
      reseed(tracks->second, kind, noise,
             [](Position2d& at, const Eigen::VectorXd& place, double sigma) {
               at.position_px = place;
               at.sigma_px = sigma;
             });
    }
  }
  recording.clouds.clear();
  return recording;
}

}  // namespace clothfit
