#include "apps/study/vision/judge_texture.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <map>
#include <set>

#include "apps/study/vision/pictures_in_memory.h"
#include "data/input_error.h"
#include "data/tracks.h"
#include "vision/render/render_cloth.h"
#include "vision/track/track.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

constexpr int kDrawnAcross = 161;  // vertices; cells of about 2 px

/// The markers' places as a grid with uneven lines, and their truth over time.
struct MarkerGrid {
  std::vector<double> s_m, t_m;
  std::vector<std::vector<Eigen::Matrix3Xd>> rows_m;  ///< by frame and line of t: 3 x lines of s
};

std::vector<double> lines_of(const std::vector<Marker>& markers, double Marker::*coordinate) {
  std::set<long> micrometres;
  for (const Marker& marker : markers) micrometres.insert(std::lround(1e6 * (marker.*coordinate)));
  std::vector<double> lines;
  for (const long line : micrometres) lines.push_back(1e-6 * static_cast<double>(line));
  return lines;
}

Eigen::Index line_at(const std::vector<double>& lines, double place) {
  return std::ranges::lower_bound(lines, place - 0.5e-6) - lines.begin();
}

MarkerGrid read_grid(const fs::path& file, const MarkerSet& markers) {
  MarkerGrid grid{.s_m = lines_of(markers.markers, &Marker::s_m),
                  .t_m = lines_of(markers.markers, &Marker::t_m),
                  .rows_m = {}};
  const Tracks3d tracks = read_tracks3d(file, markers);
  const size_t nodes = grid.s_m.size() * grid.t_m.size();
  const int frames = tracks.empty() ? 0 : tracks.back().frame + 1;
  if (grid.s_m.size() < 4 || grid.t_m.size() < 4 || nodes != markers.markers.size() ||
      tracks.size() != nodes * static_cast<size_t>(frames))
    throw InputError(file.string(), fmt::format("{} places of {} markers", tracks.size(), nodes),
                     "a full grid of 4 x 4 markers or more, in every frame");
  grid.rows_m.assign(
      static_cast<size_t>(frames),
      std::vector<Eigen::Matrix3Xd>(
          grid.t_m.size(), Eigen::Matrix3Xd(3, static_cast<Eigen::Index>(grid.s_m.size()))));
  for (const Position3d& row : tracks) {
    const Marker& marker = markers.markers[static_cast<size_t>(row.marker)];
    const auto down = static_cast<size_t>(line_at(grid.t_m, marker.t_m));
    grid.rows_m[static_cast<size_t>(row.frame)][down].col(line_at(grid.s_m, marker.s_m)) =
        row.position_m;
  }
  return grid;
}

std::vector<double> even_places(double length_m) {
  std::vector<double> places;
  for (int k = 0; k < kDrawnAcross; ++k) places.push_back(length_m * k / (kDrawnAcross - 1));
  return places;
}

/// Draws the sheet from the grid's motion.
class MovingSheet {
 public:
  MovingSheet(MarkerGrid grid, const ClothDescription& cloth, const SheetPrint& print)
      : grid_(std::move(grid)),
        print_(print),
        across_(cubic_spline_weights(grid_.s_m, even_places(cloth.width_m))),
        down_(cubic_spline_weights(grid_.t_m, even_places(cloth.height_m))) {}

  int frames() const { return static_cast<int>(grid_.rows_m.size()); }

  /// Places the sheet at a time in frames, by the parabola through the frames around it.
  PlacedSheet at(double frame) const {
    const int middle = std::clamp(static_cast<int>(std::lround(frame)), 1, frames() - 2);
    const double x = frame - middle;
    const Eigen::Vector3d weight(0.5 * x * (x - 1), 1 - x * x, 0.5 * x * (x + 1));
    PlacedSheet sheet{.print = &print_,
                      .columns = kDrawnAcross,
                      .rows = kDrawnAcross,
                      .position_m = Eigen::Matrix3Xd::Zero(3, kDrawnAcross * kDrawnAcross)};
    for (Eigen::Index line = 0; line < down_.cols(); ++line) {
      Eigen::Matrix3Xd row_m = Eigen::Matrix3Xd::Zero(3, across_.cols());
      for (int k = 0; k < 3; ++k)
        row_m += weight[k] *
                 grid_.rows_m[static_cast<size_t>(middle - 1 + k)][static_cast<size_t>(line)];
      const Eigen::Matrix3Xd drawn_m = row_m * across_.transpose();
      for (Eigen::Index i = 0; i < kDrawnAcross; ++i)
        sheet.position_m.middleCols(i * kDrawnAcross, kDrawnAcross) += down_(i, line) * drawn_m;
    }
    return sheet;
  }

 private:
  MarkerGrid grid_;
  const SheetPrint& print_;
  Eigen::MatrixXd across_, down_;
};

/// Makes textured markers of all but the tags nearest to the sheet's corners.
MarkerSet textured_markers(const MarkerSet& tags, const ClothDescription& cloth) {
  std::map<int, Eigen::Vector2d> middle_m;
  for (const Marker& marker : tags.markers)
    if (marker.tag)
      middle_m.try_emplace(*marker.tag, Eigen::Vector2d::Zero()).first->second +=
          0.25 * Eigen::Vector2d(marker.s_m, marker.t_m);
  std::set<int> anchors;
  for (const double s_m : {0.0, cloth.width_m})
    for (const double t_m : {0.0, cloth.height_m})
      anchors.insert(std::ranges::min_element(middle_m, {}, [&](const auto& one) {
                       return (one.second - Eigen::Vector2d(s_m, t_m)).norm();
                     })->first);
  MarkerSet textured = tags;
  textured.kind = MarkerKind::texture;
  for (Marker& marker : textured.markers)
    if (marker.tag && !anchors.contains(*marker.tag)) marker.tag = marker.corner = std::nullopt;
  return textured;
}

}  // namespace

Eigen::MatrixXd cubic_spline_weights(const std::vector<double>& nodes,
                                     const std::vector<double>& places) {
  const auto count = static_cast<Eigen::Index>(nodes.size());
  const auto step = [&](Eigen::Index i) {
    return nodes[static_cast<size_t>(i + 1)] - nodes[static_cast<size_t>(i)];
  };
  // The second derivatives at the nodes follow linearly from the values [deboor1978].
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(count, count);
  Eigen::MatrixXd values = Eigen::MatrixXd::Zero(count, count);
  for (Eigen::Index i = 1; i + 1 < count; ++i) {
    system.row(i).segment<3>(i - 1) << step(i - 1) / 6, (step(i - 1) + step(i)) / 3, step(i) / 6;
    values.row(i).segment<3>(i - 1) << 1 / step(i - 1), -1 / step(i - 1) - 1 / step(i), 1 / step(i);
  }
  system.row(0).head<3>() << step(1), -step(0) - step(1), step(0);
  system.row(count - 1).tail<3>() << step(count - 2), -step(count - 3) - step(count - 2),
      step(count - 3);
  const Eigen::MatrixXd second = system.partialPivLu().solve(values);
  Eigen::MatrixXd weights(static_cast<Eigen::Index>(places.size()), count);
  for (size_t p = 0; p < places.size(); ++p) {
    const auto above = std::ranges::upper_bound(nodes, places[p]) - nodes.begin();
    const Eigen::Index i = std::clamp<Eigen::Index>(above - 1, 0, count - 2);
    const double h = step(i), b = (places[p] - nodes[static_cast<size_t>(i)]) / h, a = 1 - b;
    Eigen::RowVectorXd row = (a * a * a - a) * h * h / 6 * second.row(i) +
                             (b * b * b - b) * h * h / 6 * second.row(i + 1);
    row[i] += a;
    row[i + 1] += b;
    weights.row(static_cast<Eigen::Index>(p)) = row;
  }
  return weights;
}

TexturedFootage render_textured(const fs::path& folder, const TexturedFootageOptions& options) {
  TexturedFootage footage{.recording = read_recording(folder), .pictures = {}, .truth = {}};
  Recording& recording = footage.recording;
  if (recording.cameras.empty() || recording.markers.kind != MarkerKind::apriltag)
    throw InputError(folder.string(), "is no recording of tags", "tags, seen by a camera");
  CameraEntry entry = recording.cameras.front();
  const fs::path true_camera = folder / ("truth_camera_" + entry.name + ".yaml");
  if (fs::exists(true_camera)) entry.file = true_camera;
  CameraParameters camera = read_camera(entry.file.value_or(true_camera));
  entry.images = "rendered pictures";
  recording.cameras = {entry};
  recording.tracks2d.clear();
  recording.reference.clear();
  MarkerGrid grid = read_grid(folder / "truth_tracks3d.csv.gz", recording.markers);
  recording.markers = textured_markers(recording.markers, recording.cloth);

  const SheetPrint print(recording.markers, recording.cloth.width_m, recording.cloth.height_m,
                         {.texture = options.texture});
  const MovingSheet sheet(std::move(grid), recording.cloth, print);
  const CameraRays rays(camera);
  const RenderOptions render{
      .samples = 2, .noise_levels = options.noise_levels, .shot_levels = options.shot_levels};
  const int frames = options.frames > 0 ? std::min(options.frames, sheet.frames()) : sheet.frames();
  for (int frame = 0; frame < frames; ++frame) {
    std::vector<std::vector<PlacedSheet>> instants;
    for (int k = 0; k < options.instants; ++k) {
      const double from_middle = (k - options.instants / 2) / static_cast<double>(options.instants);
      // It is held still until frame 0.
      instants.push_back({sheet.at(std::max(0.0, frame + options.shutter * from_middle))});
    }
    footage.pictures.push_back(render_cloth(
        rays, instants, render, options.texture.seed + static_cast<std::uint64_t>(frame)));
    footage.truth.push_back(true_markers(camera, std::vector<PlacedSheet>{sheet.at(frame)}, 0,
                                         recording.markers.markers));
  }
  return footage;
}

TagScore score_texture(const TexturedFootage& footage) {
  PicturesInMemory pictures(footage.pictures);
  const TrackResult result =
      track(footage.recording, footage.recording.cameras.front(), pictures, TrackOptions(), {});
  TagScore score;
  for (size_t frame = 1; frame < footage.truth.size(); ++frame)
    for (const TrueMarker& marker : footage.truth[frame])
      score.visible += marker.sight == MarkerSight::seen ? 1 : 0;
  for (const Position2d& row : result.tracks) {
    if (!row.rejected.empty() || row.frame == 0) continue;
    const TrueMarker& marker =
        footage.truth[static_cast<size_t>(row.frame)][static_cast<size_t>(row.marker)];
    if (marker.sight != MarkerSight::seen) {
      ++score.hidden_reported;
      continue;
    }
    ++score.found;
    const double error_px = (row.position_px - marker.pixel_px).norm();
    score.error_px.push_back(error_px);
    score.error_over_sigma.push_back(error_px / row.sigma_px);
  }
  return score;
}

}  // namespace clothfit
