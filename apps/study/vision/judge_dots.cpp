#include "apps/study/vision/judge_dots.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "data/csv_reader.h"
#include "data/median.h"

namespace clothfit {
namespace {

constexpr double kFalse_px = 3;  // a row further away is another dot's

}  // namespace

std::vector<TrueSighting> read_true_sightings(const std::filesystem::path& file,
                                              const MarkerSet& markers) {
  CsvReader table(
      file,
      {{.name = "frame"}, {.name = "marker"}, {.name = "u"}, {.name = "v"}, {.name = "visible"}});
  std::vector<TrueSighting> truth;
  while (table.next()) {
    const std::string name = table.name(1);
    const auto marker = markers.index.find(name);
    if (marker == markers.index.end()) table.refuse("'" + name + "'", "a known marker");
    truth.push_back({.frame = table.whole_number(0, 0),
                     .marker = marker->second,
                     .pixel_px = {table.number(2), table.number(3)},
                     .visible = table.whole_number(4, 0) == 1});
  }
  return truth;
}

DotJudgement judge_dots(const Tracks2d& tracks, const std::vector<TrueSighting>& truth,
                        const MarkerSet& markers) {
  std::map<std::pair<int, int>, const TrueSighting*> true_by_row;
  DotJudgement judgement;
  for (const TrueSighting& sighting : truth) {
    if (markers.markers[static_cast<size_t>(sighting.marker)].tag) continue;
    true_by_row[{sighting.frame, sighting.marker}] = &sighting;
    judgement.visible += sighting.visible ? 1 : 0;
  }
  std::vector<double> distances, scaled;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double squares = 0, scaled_squares = 0;
  for (const Position2d& row : tracks) {
    const auto found = true_by_row.find({row.frame, row.marker});
    if (!row.rejected.empty() || found == true_by_row.end()) continue;
    const Eigen::Vector2d error = row.position_px - found->second->pixel_px;
    if (!found->second->visible) ++judgement.invisible_reported;
    if (error.norm() > kFalse_px) ++judgement.false_identities;
    if (error.norm() > kFalse_px || !found->second->visible) continue;
    distances.push_back(error.norm());
    scaled.push_back(error.norm() / row.sigma_px);
    sum += error;
    squares += error.squaredNorm() / 2;
    scaled_squares += error.squaredNorm() / 2 / (row.sigma_px * row.sigma_px);
  }
  judgement.found = static_cast<int>(distances.size());
  if (distances.empty()) return judgement;
  const auto count = static_cast<double>(distances.size());
  std::sort(distances.begin(), distances.end());
  judgement.median_px = distances[distances.size() / 2];
  judgement.percentile95_px = distances[static_cast<size_t>(0.95 * count)];
  judgement.rms_px = std::sqrt(squares / count);
  judgement.mean_u_px = sum.x() / count;
  judgement.mean_v_px = sum.y() / count;
  judgement.error_over_sigma = std::sqrt(scaled_squares / count);
  const double usual = std::sqrt(2 * std::log(2.0));  // median of a normal error's length
  judgement.robust_error_over_sigma = median(std::move(scaled)) / usual;
  return judgement;
}

}  // namespace clothfit
