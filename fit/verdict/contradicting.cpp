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

ErrorSummary error_of(const std::vector<Row>& rows, const std::set<int>& without, bool held_out) {
  double square = 0;
  int points = 0;
  Eigen::Index dimension = 1;
  for (const Row& row : rows) {
    if (row.held_out != held_out || without.contains(row.marker)) continue;
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
    std::set<int> all, named;
    for (const Row& row : residuals.rows) all.insert(row.marker);
    const std::map<int, double> usual = usual_by_frame(residuals.rows);
    double mean = 0;
    for (const auto& [frame, off] : usual) mean += off / static_cast<double>(usual.size());
    if (mean > kExplained) continue;
    const std::map<int, Stretch> found = longest_stretches(residuals.rows, usual);
    if (found.empty() || !are_few(found.size(), all.size())) continue;
    for (const auto& [marker, stretch] : found) {
      named.insert(marker);
      report.result.contradicting.push_back(
          {.marker = markers.markers[static_cast<size_t>(marker)].name,
           .kind = residuals.kind,
           .first_frame = stretch.first,
           .last_frame = stretch.last,
           .off = std::sqrt(stretch.square / stretch.rows)});
    }
    ObservationErrors& errors = report.result.errors[k];
    errors.fitted_without = error_of(residuals.rows, named, false);
    if (errors.held_out.count > 0) errors.held_out_without = error_of(residuals.rows, named, true);
  }
}

}  // namespace clothfit
