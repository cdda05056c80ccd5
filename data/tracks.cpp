#include "data/tracks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <numeric>

#include "data/csv_table.h"
#include "data/nearest_name.h"
#include "data/number_text.h"
#include "data/text_file.h"

namespace clothfit {
namespace {

int read_marker(const CsvTable& table, int row, int column, const MarkerSet& markers) {
  const std::string name = table.name(row, column);
  const auto found = markers.index.find(name);
  if (found == markers.index.end())
    table.refuse(row, fmt::format("unknown marker `{}`", name), "a marker that markers.csv names",
                 "add it there, or remove its rows here");
  return found->second;
}

/// Numbers beyond these, far from any measurement in metres or pixels, are slips in the exponent.
constexpr double kSmallestSigma = 1e-9;
constexpr double kLargestSigma = 1e6;

/// Reads a sigma; 0 where the file does not say.
double read_sigma(const CsvTable& table, int row, int column, const std::string& unit) {
  if (table.empty(row, column)) return 0;
  const double sigma = table.number(row, column);
  if (sigma < kSmallestSigma || sigma > kLargestSigma)
    table.refuse(row, fmt::format("sigma = {}", sigma),
                 fmt::format("one standard deviation per coordinate ({}), {} to {}", unit,
                             kSmallestSigma, kLargestSigma),
                 "leave the field empty where it is not known");
  return sigma;
}

/// Returns the reason of `rejected:REASON`; empty for `ok`.
std::string read_status(const CsvTable& table, int row, int column) {
  const std::string_view status = table.text(row, column);
  if (status.empty() || status == "ok") return "";
  constexpr std::string_view kRejected = "rejected:";
  if (!status.starts_with(kRejected) || status.size() == kRejected.size())
    table.refuse(row, fmt::format("status = `{}`", table.name(row, column)),
                 "`ok` or `rejected:REASON`");
  return table.name(row, column).substr(kRejected.size());
}

/// A longer gap without any row is a mistyped frame number, not a pause. It is refused because a
/// fit has to simulate all of its frames.
constexpr int kLongestGap = 10'000;

/// Sorts rows (given in the table's order) by frame, then marker. Refuses a pair that comes twice
/// and a frame far beyond the one before.
template <class Position>
std::vector<Position> sorted(const CsvTable& table, std::vector<Position> rows,
                             const MarkerSet& markers) {
  std::vector<int> order(rows.size());
  std::iota(order.begin(), order.end(), 0);
  const auto at = [&rows](int row) -> const Position& { return rows[static_cast<size_t>(row)]; };
  std::stable_sort(order.begin(), order.end(), [&at](int a, int b) {
    return std::pair(at(a).frame, at(a).marker) < std::pair(at(b).frame, at(b).marker);
  });
  std::vector<Position> result;
  result.reserve(rows.size());
  int previous = -1;
  for (const int row : order) {
    if (previous >= 0 && at(row).frame == at(previous).frame &&
        at(row).marker == at(previous).marker) {
      table.refuse(row,
                   fmt::format("marker `{}` in frame {} stands on line {} already",
                               markers.markers[static_cast<size_t>(at(row).marker)].name,
                               at(row).frame, table.line(previous)),
                   "one row per frame and marker", "remove one of the two rows");
    }
    const int frame_before = previous >= 0 ? at(previous).frame : 0;
    if (at(row).frame - frame_before > kLongestGap)
      table.refuse(row,
                   fmt::format("frame {} comes next after frame {}", at(row).frame, frame_before),
                   fmt::format("{} frames without any row at most", kLongestGap),
                   "correct the number, or make two recordings of it");
    result.push_back(at(row));
    previous = row;
  }
  return result;
}

const std::string& marker_name(const MarkerSet& markers, int marker) {
  assert(marker >= 0 && marker < static_cast<int>(markers.markers.size()));
  return markers.markers[static_cast<size_t>(marker)].name;
}

std::string sigma_field(double sigma) {
  return sigma > 0 ? fmt::format(",{}", number_text(sigma)) : ",";
}

}  // namespace

Tracks3d read_tracks3d(const std::filesystem::path& file, const MarkerSet& markers) {
  enum Column { kFrame, kMarker, kX, kY, kZ, kSigma };
  const CsvTable table(file, {{"frame"}, {"marker"}, {"x"}, {"y"}, {"z"}, {"sigma", false}});
  Tracks3d tracks;
  tracks.reserve(static_cast<size_t>(table.rows()));
  for (int row = 0; row < table.rows(); ++row) {
    Position3d position;
    position.frame = table.whole_number(row, kFrame, 0);
    position.marker = read_marker(table, row, kMarker, markers);
    position.position_m = {table.number(row, kX), table.number(row, kY), table.number(row, kZ)};
    position.sigma_m = read_sigma(table, row, kSigma, "metres");
    tracks.push_back(position);
  }
  return sorted(table, std::move(tracks), markers);
}

Tracks2d read_tracks2d(const std::filesystem::path& file, const MarkerSet& markers) {
  enum Column { kFrame, kMarker, kU, kV, kSigma, kStatus };
  const CsvTable table(file,
                       {{"frame"}, {"marker"}, {"u"}, {"v"}, {"sigma", false}, {"status", false}});
  Tracks2d tracks;
  tracks.reserve(static_cast<size_t>(table.rows()));
  for (int row = 0; row < table.rows(); ++row) {
    Position2d position;
    position.frame = table.whole_number(row, kFrame, 0);
    position.marker = read_marker(table, row, kMarker, markers);
    position.position_px = {table.number(row, kU), table.number(row, kV)};
    position.sigma_px = read_sigma(table, row, kSigma, "pixels");
    position.rejected = read_status(table, row, kStatus);
    tracks.push_back(std::move(position));
  }
  return sorted(table, std::move(tracks), markers);
}

void write_tracks3d(const Tracks3d& tracks, const MarkerSet& markers,
                    const std::filesystem::path& file) {
  const bool sigma =
      std::any_of(tracks.begin(), tracks.end(), [](const Position3d& p) { return p.sigma_m > 0; });
  std::string text = sigma ? "frame,marker,x,y,z,sigma\n" : "frame,marker,x,y,z\n";
  for (const Position3d& p : tracks)
    text += fmt::format("{},{},{},{},{}{}\n", p.frame, marker_name(markers, p.marker),
                        number_text(p.position_m.x()), number_text(p.position_m.y()),
                        number_text(p.position_m.z()), sigma ? sigma_field(p.sigma_m) : "");
  write_text(text, file);
}

void write_tracks2d(const Tracks2d& tracks, const MarkerSet& markers,
                    const std::filesystem::path& file) {
  const bool status = std::any_of(tracks.begin(), tracks.end(),
                                  [](const Position2d& p) { return !p.rejected.empty(); });
  const bool sigma = status || std::any_of(tracks.begin(), tracks.end(),
                                           [](const Position2d& p) { return p.sigma_px > 0; });
  std::string text = "frame,marker,u,v";
  if (sigma) text += ",sigma";
  if (status) text += ",status";
  text += "\n";
  for (const Position2d& p : tracks) {
    text += fmt::format("{},{},{},{}", p.frame, marker_name(markers, p.marker),
                        number_text(p.position_px.x()), number_text(p.position_px.y()));
    if (sigma) text += sigma_field(p.sigma_px);
    if (status) text += p.rejected.empty() ? ",ok" : fmt::format(",rejected:{}", p.rejected);
    text += "\n";
  }
  write_text(text, file);
}

}  // namespace clothfit
