#include "data/tracks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <numeric>

#include "data/csv_reader.h"
#include "data/nearest_name.h"
#include "data/number_limits.h"
#include "data/number_text.h"
#include "data/reading.h"
#include "data/text_writer.h"

namespace clothfit {
namespace {

int read_marker(const CsvReader& table, int column, const MarkerSet& markers) {
  const std::string name = table.name(column);
  const auto found = markers.index.find(name);
  if (found == markers.index.end())
    table.refuse(fmt::format("unknown marker `{}`", name), "a marker that markers.csv names",
                 "add it there, or remove its rows here");
  return found->second;
}

/// Numbers beyond these, far from any measurement in metres or pixels, are slips in the exponent.
constexpr double kSmallestSigma = 1e-9;
constexpr double kLargestSigma = 1e6;

/// Reads a sigma; 0 where the file does not say.
double read_sigma(const CsvReader& table, int column, const std::string& unit) {
  if (table.empty(column)) return 0;
  const double sigma = table.number(column);
  if (sigma < kSmallestSigma || sigma > kLargestSigma)
    table.refuse(fmt::format("sigma = {}", sigma),
                 fmt::format("one standard deviation per coordinate ({}), {} to {}", unit,
                             kSmallestSigma, kLargestSigma),
                 "leave the field empty where it is not known");
  return sigma;
}

/// Returns the reason of `rejected:REASON`; empty for `ok`.
std::string read_status(const CsvReader& table, int column) {
  const std::string_view status = table.text(column);
  if (status.empty() || status == "ok") return "";
  constexpr std::string_view kRejected = "rejected:";
  if (!status.starts_with(kRejected) || status.size() == kRejected.size())
    table.refuse(fmt::format("status = `{}`", table.name(column)), "`ok` or `rejected:REASON`");
  return table.name(column).substr(kRejected.size());
}

/// A longer gap without any row is a mistyped frame number, not a pause. It is refused because a
/// fit has to simulate all of its frames.
constexpr int kLongestGap = 10'000;

/// Refuses a row like the one before it in order, and a frame far beyond.
template <class Position>
void check_order(const CsvReader& table, const Position& row, int line, const Position* before,
                 int line_before, const MarkerSet& markers) {
  if (before != nullptr && row.frame == before->frame && row.marker == before->marker)
    table.refuse_line(
        line,
        fmt::format("marker `{}` in frame {} stands on line {} already",
                    markers.markers[static_cast<size_t>(row.marker)].name, row.frame, line_before),
        "one row per frame and marker", "remove one of the two rows");
  const int frame_before = before != nullptr ? before->frame : 0;
  if (row.frame - frame_before > kLongestGap)
    table.refuse_line(line,
                      fmt::format("frame {} comes next after frame {}", row.frame, frame_before),
                      fmt::format("{} frames without any row at most", kLongestGap),
                      "correct the number, or make two recordings of it");
}

/// Sorts rows by frame, then marker; `lines` are theirs. Those in order already, as long tables
/// are, take no further memory.
template <class Position>
void sort_rows(const CsvReader& table, const std::vector<int>& lines, const MarkerSet& markers,
               std::vector<Position>& rows) {
  const auto place = [](const Position& row) { return std::pair(row.frame, row.marker); };
  const bool in_order = std::ranges::is_sorted(rows, {}, place);
  std::vector<size_t> order;
  if (!in_order) {
    order.resize(rows.size());
    std::iota(order.begin(), order.end(), size_t{0});
    std::ranges::stable_sort(order, {}, [&](size_t row) { return place(rows[row]); });
  }
  const auto nth = [&](size_t n) { return in_order ? n : order[n]; };
  for (size_t n = 0; n < rows.size(); ++n) {
    const size_t row = nth(n), before = nth(n > 0 ? n - 1 : 0);
    check_order(table, rows[row], lines[row], n > 0 ? &rows[before] : nullptr, lines[before],
                markers);
  }
  if (in_order) return;
  std::vector<Position> sorted;
  sorted.reserve(rows.size());
  for (const size_t row : order) sorted.push_back(std::move(rows[row]));
  rows = std::move(sorted);
}

const std::string& marker_name(const MarkerSet& markers, int marker) {
  assert(marker >= 0 && marker < static_cast<int>(markers.markers.size()));
  return markers.markers[static_cast<size_t>(marker)].name;
}

std::string sigma_field(double sigma) {
  return sigma > 0 ? fmt::format(",{}", number_text(sigma)) : ",";
}

Tracks3d parsed_tracks3d(const std::filesystem::path& file, const MarkerSet& markers) {
  enum Column { kFrame, kMarker, kX, kY, kZ, kSigma };
  CsvReader table(file, {{"frame"}, {"marker"}, {"x"}, {"y"}, {"z"}, {"sigma", false}});
  Tracks3d tracks;
  std::vector<int> lines;
  while (table.next()) {
    Position3d position;
    position.frame = table.whole_number(kFrame, 0);
    position.marker = read_marker(table, kMarker, markers);
    position.position_m = table.vector_within<3>(kX, kFarthest_m, "metres");
    position.sigma_m = read_sigma(table, kSigma, "metres");
    tracks.push_back(position);
    lines.push_back(table.line());
  }
  sort_rows(table, lines, markers, tracks);
  return tracks;
}

}  // namespace

Tracks3d read_tracks3d(const std::filesystem::path& file, const MarkerSet& markers) {
  return reading(file, [&] { return parsed_tracks3d(file, markers); });
}

namespace {

Tracks2d parsed_tracks2d(const std::filesystem::path& file, const MarkerSet& markers) {
  enum Column { kFrame, kMarker, kU, kV, kSigma, kStatus };
  CsvReader table(file, {{"frame"}, {"marker"}, {"u"}, {"v"}, {"sigma", false}, {"status", false}});
  Tracks2d tracks;
  std::vector<int> lines;
  while (table.next()) {
    Position2d position;
    position.frame = table.whole_number(kFrame, 0);
    position.marker = read_marker(table, kMarker, markers);
    position.position_px = table.vector_within<2>(kU, kFarthest_px, "pixels");
    position.sigma_px = read_sigma(table, kSigma, "pixels");
    position.rejected = read_status(table, kStatus);
    tracks.push_back(std::move(position));
    lines.push_back(table.line());
  }
  sort_rows(table, lines, markers, tracks);
  return tracks;
}

}  // namespace

Tracks2d read_tracks2d(const std::filesystem::path& file, const MarkerSet& markers) {
  return reading(file, [&] { return parsed_tracks2d(file, markers); });
}

void write_tracks3d(const Tracks3d& tracks, const MarkerSet& markers,
                    const std::filesystem::path& file) {
  const bool sigma =
      std::any_of(tracks.begin(), tracks.end(), [](const Position3d& p) { return p.sigma_m > 0; });
  TextWriter out(file);
  out.append(sigma ? "frame,marker,x,y,z,sigma\n" : "frame,marker,x,y,z\n");
  for (const Position3d& p : tracks)
    out.append(fmt::format("{},{},{},{},{}{}\n", p.frame, csv_name(marker_name(markers, p.marker)),
                           number_text(p.position_m.x()), number_text(p.position_m.y()),
                           number_text(p.position_m.z()), sigma ? sigma_field(p.sigma_m) : ""));
  out.close();
}

void write_tracks2d(const Tracks2d& tracks, const MarkerSet& markers,
                    const std::filesystem::path& file) {
  const bool status = std::any_of(tracks.begin(), tracks.end(),
                                  [](const Position2d& p) { return !p.rejected.empty(); });
  const bool sigma = status || std::any_of(tracks.begin(), tracks.end(),
                                           [](const Position2d& p) { return p.sigma_px > 0; });
  TextWriter out(file);
  std::string text = "frame,marker,u,v";
  if (sigma) text += ",sigma";
  if (status) text += ",status";
  out.append(text + "\n");
  for (const Position2d& p : tracks) {
    text = fmt::format("{},{},{},{}", p.frame, csv_name(marker_name(markers, p.marker)),
                       number_text(p.position_px.x()), number_text(p.position_px.y()));
    if (sigma) text += sigma_field(p.sigma_px);
    if (status) text += p.rejected.empty() ? ",ok" : fmt::format(",rejected:{}", p.rejected);
    out.append(text + "\n");
  }
  out.close();
}

}  // namespace clothfit
