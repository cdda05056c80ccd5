#include "fit/verdict/contradicting.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "data/median.h"

namespace clothfit {
namespace {

using Row = FitReport::Residuals::Row;

/// Sigmas per coordinate from which Huber's loss, which bends at three, weighs a row a fifth.
constexpr double kHardlyWeighed = 15;
/// Times what half of the markers are off in the same frame.
constexpr double kBeyondOthers = 8;
constexpr int kStretch = 5;
/// Sigmas that half of the markers may be off in the mean: a model that leaves more does not tell.
constexpr double kExplained = 5;
/// Share of the markers up to which they are to blame, and not the model. Of few it is one, of ten
/// on two.
constexpr double kFew = 0.1;

bool are_few(size_t found, size_t all) {
  const double at_least = all < 10 ? 1 : 2;
  return static_cast<double>(found) <= std::max(at_least, kFew * static_cast<double>(all)) &&
         2 * found < all;
}

double sigmas(const Row& row) {
  return (row.observed - row.predicted).norm() /
         (row.sigma * std::sqrt(static_cast<double>(row.observed.size())));
}

/// Returns what half of the markers are off in each frame, in sigmas.
std::map<int, double> usual_by_frame(const std::vector<Row>& rows) {
  std::map<int, std::vector<double>> by_frame;
  for (const Row& row : rows) by_frame[row.frame].push_back(sigmas(row));
  std::map<int, double> usual;
  for (auto& [frame, off] : by_frame) usual[frame] = median(std::move(off));
  return usual;
}

/// The longest run of a marker's rows that lie off.
struct Stretch {
  int rows = 0, first = 0, last = 0;
  double square = 0;
};

std::map<int, Stretch> longest_stretches(const std::vector<Row>& rows,
                                         const std::map<int, double>& usual) {
  std::map<int, Stretch> now, longest;
  for (const Row& row : rows) {
    const double off = sigmas(row);
    Stretch& stretch = now[row.marker];
    if (off < kHardlyWeighed || off < kBeyondOthers * usual.at(row.frame)) {
      stretch = {};
      continue;
    }
    if (stretch.rows++ == 0) stretch.first = row.frame;
    stretch.last = row.frame;
    stretch.square += (row.observed - row.predicted).squaredNorm();
    if (stretch.rows > longest[row.marker].rows) longest[row.marker] = stretch;
  }
  std::erase_if(longest, [](const auto& one) { return one.second.rows < kStretch; });
  return longest;
}

/// The share of a marker's error from which a neighbour on the cloth has it too. Others may have an
/// eighth of it (kBeyondOthers). A lower value excuses wrong tracks where the model leaves
/// something, a higher one blames tracks at the edge of a part that something acts on.
constexpr double kShared = 0.3;
constexpr size_t kNeighbours = 4;

/// Another marker beside one that lies off.
struct Neighbour {
  double distance_m = 0;  ///< on the cloth
  int marker = 0;
  double along = 0, square = 0;  ///< its error times the marker's, and the marker's squared
  int frames = 0;
};

/// Tells whether half of the nearest markers lie off the same way over the same frames. Then the
/// cloth does, where something acts on a part of it, and no track is to blame; an edge folds there
/// with two of four. Exchanged tracks lie off in opposite directions. Corners of one tag go
/// together, whatever it shows, and are no neighbours.
bool is_shared_by_neighbours(const MarkerSet& markers, const std::vector<Row>& rows, int marker,
                             const Stretch& stretch) {
  const auto of = [&](int index) -> const Marker& {
    return markers.markers[static_cast<size_t>(index)];
  };
  std::map<int, Eigen::VectorXd> own;
  for (const Row& row : rows)
    if (row.marker == marker && row.frame >= stretch.first && row.frame <= stretch.last)
      own[row.frame] = row.observed - row.predicted;
  std::map<int, Neighbour> others;
  for (const Row& row : rows) {
    const bool same_tag = of(marker).tag && of(row.marker).tag == of(marker).tag;
    if (row.marker == marker || same_tag || !own.contains(row.frame)) continue;
    const Eigen::VectorXd& error = own[row.frame];
    Neighbour& other = others[row.marker];
    other.marker = row.marker;
    other.distance_m =
        std::hypot(of(row.marker).s_m - of(marker).s_m, of(row.marker).t_m - of(marker).t_m);
    other.along += (row.observed - row.predicted).dot(error);
    other.square += error.squaredNorm();
    ++other.frames;
  }
  std::vector<Neighbour> nearest;
  for (const auto& [index, other] : others)
    if (2 * other.frames >= std::ssize(own)) nearest.push_back(other);
  if (nearest.size() < kNeighbours) return false;
  std::ranges::stable_sort(nearest, {}, &Neighbour::distance_m);
  nearest.resize(kNeighbours);
  const auto sharing = std::ranges::count_if(
      nearest, [](const Neighbour& one) { return one.along > kShared * one.square; });
  return 2 * sharing >= std::ssize(nearest);
}

/// Sigmas per coordinate from which a single observation is an outlier, if those before and after
/// it are explained to kOnTrack: no cloth jumps there and back between frames. A wrong track jumps
/// farther than noise ever does. One of 10^8 normal errors lies beyond six.
constexpr double kOutlier = 6;
constexpr double kOnTrack = 3;
/// Frames within which the track must be back.
constexpr int kBackWithin = 2;
/// Share of its error that an outlier jumps by itself. Else the model jumps, and the track does
/// not.
constexpr double kOwnJump = 0.5;
/// Share of the observations up to which the tracks are to blame for outliers, and not the model.
constexpr double kFewOutliers = 0.02;

bool jumps_there_and_back(const Row& before, const Row& row, const Row& after) {
  if (sigmas(before) > kOnTrack || sigmas(after) > kOnTrack || sigmas(row) < kOutlier) return false;
  if (row.frame - before.frame > kBackWithin || after.frame - row.frame > kBackWithin) return false;
  const double share = static_cast<double>(row.frame - before.frame) / (after.frame - before.frame);
  const Eigen::VectorXd jump =
      row.observed - before.observed - share * (after.observed - before.observed);
  const Eigen::VectorXd error = row.observed - row.predicted;
  return jump.dot(error) > kOwnJump * error.squaredNorm();
}

/// Returns the rows that jump away from their marker's track and back, by index; none where there
/// are many. Markers that are left out are passed over.
std::set<size_t> single_outliers(const std::vector<Row>& rows, const std::map<int, double>& usual,
                                 const std::set<int>& left_out) {
  std::map<int, std::vector<size_t>> of_marker;
  for (size_t n = 0; n < rows.size(); ++n)
    if (!left_out.contains(rows[n].marker)) of_marker[rows[n].marker].push_back(n);
  std::set<size_t> found;
  for (const auto& [marker, track] : of_marker)
    for (size_t k = 1; k + 1 < track.size(); ++k) {
      const Row& row = rows[track[k]];
      if (sigmas(row) > kBeyondOthers * usual.at(row.frame) &&
          jumps_there_and_back(rows[track[k - 1]], row, rows[track[k + 1]]))
        found.insert(track[k]);
    }
  const bool few =
      static_cast<double>(found.size()) <= kFewOutliers * static_cast<double>(rows.size());
  return few ? found : std::set<size_t>();
}

/// What the errors leave out: markers, and rows by index.
struct LeftOut {
  std::set<int> markers;
  std::set<size_t> rows;
};

ErrorSummary error_of(const std::vector<Row>& rows, const LeftOut& without, bool held_out) {
  double square = 0;
  int points = 0;
  Eigen::Index dimension = 1;
  for (size_t n = 0; n < rows.size(); ++n) {
    const Row& row = rows[n];
    if (row.held_out != held_out || without.markers.contains(row.marker) ||
        without.rows.contains(n))
      continue;
    square += (row.observed - row.predicted).squaredNorm();
    dimension = row.observed.size();
    ++points;
  }
  if (points == 0) return {};
  const double distance = std::sqrt(square / points);
  return {.rms = distance / std::sqrt(static_cast<double>(dimension)),
          .rms_distance = distance,
          .count = points};
}

}  // namespace

void name_contradicting(const MarkerSet& markers, FitReport& report) {
  for (size_t k = 0; k < report.residuals.size(); ++k) {
    const FitReport::Residuals& residuals = report.residuals[k];
    std::set<int> all;
    for (const Row& row : residuals.rows) all.insert(row.marker);
    const std::map<int, double> usual = usual_by_frame(residuals.rows);
    double mean = 0;
    for (const auto& [frame, off] : usual) mean += off / static_cast<double>(usual.size());
    if (mean > kExplained) continue;
    std::map<int, Stretch> found = longest_stretches(residuals.rows, usual);
    if (!are_few(found.size(), all.size())) found.clear();
    std::erase_if(found, [&](const auto& one) {
      return is_shared_by_neighbours(markers, residuals.rows, one.first, one.second);
    });
    LeftOut without;
    for (const auto& [marker, stretch] : found) {
      without.markers.insert(marker);
      report.result.contradicting.push_back(
          {.marker = markers.markers[static_cast<size_t>(marker)].name,
           .kind = residuals.kind,
           .first_frame = stretch.first,
           .last_frame = stretch.last,
           .off = std::sqrt(stretch.square / stretch.rows)});
    }
    without.rows = single_outliers(residuals.rows, usual, without.markers);
    if (without.markers.empty() && without.rows.empty()) continue;
    ObservationErrors& errors = report.result.errors[k];
    errors.outliers = static_cast<int>(without.rows.size());
    errors.fitted_without = error_of(residuals.rows, without, false);
    if (errors.held_out.count > 0)
      errors.held_out_without = error_of(residuals.rows, without, true);
  }
}

}  // namespace clothfit
