#include "apps/study/vision/filmed_cloth.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "apps/steps/track_step.h"
#include "apps/study/vision/template_sheet.h"
#include "apps/terminal/exit_code.h"
#include "data/camera_parameters.h"
#include "data/clouds.h"
#include "data/csv_reader.h"
#include "data/input_error.h"
#include "data/number_limits.h"
#include "data/recording.h"
#include "data/text_file.h"
#include "data/tracks.h"
#include "fit/observe/cloud_errors.h"
#include "model/topology/surface.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

constexpr const char* kCamera = "camera";

/// What reference.json says of the camera, whose picture was cut, and of the cloth.
struct ClothSetup {
  CameraParameters camera;  ///< of the cut picture, at the origin of the clouds' axes
  Eigen::Vector2d cut_px = Eigen::Vector2d::Zero();  ///< pixel of the whole picture at (0, 0)
  double width_m = 0, height_m = 0;
};

ClothSetup read_setup(const fs::path& file) {
  ClothSetup setup;
  try {
    const auto json = nlohmann::json::parse(read_text(file));
    const auto& focal = json.at("K");
    const auto& cut = json.at("crop_offset_xy");
    setup.cut_px = {cut.at(0).get<double>(), cut.at(1).get<double>()};
    setup.camera.name = kCamera;
    setup.camera.image_width = json.at("crop_size").at(0).get<int>();
    setup.camera.image_height = json.at("crop_size").at(1).get<int>();
    setup.camera.focal_px = {focal.at("fx").get<double>(), focal.at("fy").get<double>()};
    setup.camera.centre_px =
        Eigen::Vector2d(focal.at("cx").get<double>(), focal.at("cy").get<double>()) - setup.cut_px;
    setup.camera.camera_from_world = CameraPose();
    setup.width_m = json.at("mesh").at("side_a_m").get<double>();
    setup.height_m = json.at("mesh").at("side_b_m").get<double>();
  } catch (const nlohmann::json::exception& error) {
    throw InputError(file.string(), error.what(), "camera, cut and mesh of the set");
  }
  return setup;
}

std::vector<Marker> read_points(const fs::path& file) {
  CsvReader table(file, {{"point"}, {"a_m"}, {"b_m"}, {"fb_error_px", false}});
  std::vector<Marker> markers;
  while (table.next())
    markers.push_back({.name = table.name(0),
                       .s_m = table.number(1),
                       .t_m = table.number(2),
                       .tag = {},
                       .corner = {}});
  return markers;
}

/// Reads tracks in pixels of the whole picture; the result is in those of the cut one.
Tracks2d read_given(const fs::path& file, const MarkerSet& markers, const Eigen::Vector2d& cut_px) {
  CsvReader table(
      file,
      {{"point"}, {"frame"}, {"u_px"}, {"v_px"}, {"X_m", false}, {"Y_m", false}, {"Z_m", false}});
  Tracks2d tracks;
  while (table.next()) {
    const auto marker = markers.index.find(table.name(0));
    if (marker == markers.index.end())
      table.refuse("names an unknown point", "points of track_points.csv");
    tracks.push_back({.frame = table.whole_number(1, 0),
                      .marker = marker->second,
                      .position_px = Eigen::Vector2d(table.number(2), table.number(3)) - cut_px,
                      .sigma_px = 0,
                      .rejected = {}});
  }
  table.require_rows("tracks");
  std::ranges::sort(tracks, {}, [](const auto& row) { return std::pair(row.frame, row.marker); });
  return tracks;
}

PointClouds read_clouds(const fs::path& file) {
  CsvReader table(file, {{"frame"}, {"X_mm"}, {"Y_mm"}, {"Z_mm"}});
  std::map<int, std::vector<Eigen::Vector3d>> points_m;
  while (table.next())
    points_m[table.whole_number(0, 0)].emplace_back(1e-3 * table.number(1), 1e-3 * table.number(2),
                                                    1e-3 * table.number(3));
  PointClouds clouds;
  for (const auto& [frame, points] : points_m) {
    Eigen::Matrix3Xd& cloud = clouds[frame];
    cloud.resize(3, static_cast<Eigen::Index>(points.size()));
    for (size_t k = 0; k < points.size(); ++k) cloud.col(static_cast<Eigen::Index>(k)) = points[k];
  }
  return clouds;
}

/// Writes the set as a recording that is tracked from where the given tracks begin.
Recording write_as_recording(const fs::path& set, const ClothSetup& setup, const fs::path& folder) {
  fs::create_directories(folder);
  Recording recording;
  recording.folder = folder;
  recording.name = set.filename().string();
  recording.cloth.width_m = setup.width_m;
  recording.cloth.height_m = setup.height_m;
  recording.markers.kind = MarkerKind::texture;
  recording.markers.markers = read_points(set / "track_points.csv");
  for (const Marker& marker : recording.markers.markers)
    recording.markers.index.emplace(marker.name, static_cast<int>(recording.markers.index.size()));
  recording.frame_rate_hz = 30;  // the format asks for one; no number here depends on it
  recording.start = StartKind::unknown;
  recording.markers_file = folder / "markers.csv";
  recording.cameras = {{.name = kCamera,
                        .file = folder / "camera.yaml",
                        .images = fs::absolute(set),
                        .calibration = {}}};
  recording.tracks2d[kCamera] = folder / "given.csv.gz";
  write_markers(recording.markers.markers, recording.markers_file);
  write_camera(setup.camera, *recording.cameras.front().file);
  write_tracks2d(read_given(set / "tracks.csv", recording.markers, setup.cut_px), recording.markers,
                 recording.tracks2d.at(kCamera));
  write_recording(recording, folder);
  return read_recording(folder);
}

/// Reads the grid of vertices; those at both ends of the upper edge are held.
TemplateSheet read_template(const fs::path& file, const ClothSetup& setup) {
  CsvReader table(
      file,
      {{"vertex"}, {"a"}, {"b"}, {"X_m"}, {"Y_m"}, {"Z_m"}, {"u0_px", false}, {"v0_px", false}});
  struct Vertex {
    int column = 0, row = 0;
    Eigen::Vector3d position_m;
  };
  std::vector<Vertex> vertices;
  Mesh mesh{0, 0, setup.width_m, setup.height_m};
  while (table.next()) {
    vertices.push_back({.column = table.whole_number(1, 0),
                        .row = table.whole_number(2, 0),
                        .position_m = table.vector_within<3>(3, kFarthest_m, "metres")});
    mesh.columns = std::max(mesh.columns, vertices.back().column + 1);
    mesh.rows = std::max(mesh.rows, vertices.back().row + 1);
  }
  table.require_rows("vertices");
  if (!is_possible_mesh(mesh.columns, mesh.rows) || table.rows() != mesh.vertex_count())
    table.refuse("ends no full grid", "a vertex for each a and b");
  Eigen::Matrix3Xd position_m(3, mesh.vertex_count());
  for (const Vertex& vertex : vertices)
    position_m.col(mesh.vertex(vertex.row, vertex.column)) = vertex.position_m;
  return {.mesh = mesh, .position_m = position_m, .fixed = {0, mesh.columns - 1}};
}

/// Adds how far the surface from some tracks is from the clouds. Returns the Chamfer distance (m²).
double add_distances(const std::string& whose, const PointClouds& clouds, const Mesh& mesh,
                     const std::vector<Eigen::Matrix3Xd>& position_m,
                     std::vector<ChainNumber>& numbers) {
  constexpr int kAcross = 113;  // points; 5 mm apart, fine beside what the surfaces are off
  const Mesh fine{kAcross, kAcross, mesh.width_m, mesh.height_m};
  const Surface surface = make_surface(mesh.columns, mesh.rows, mesh.width_m, mesh.height_m,
                                       flat_positions(fine).topRows<2>());
  double square_m2 = 0;
  int frames = 0;
  for (const auto& [frame, cloud_m] : clouds) {
    if (frame >= static_cast<int>(position_m.size())) continue;
    square_m2 += mean_square_to_nearest_m2(
        cloud_m, surface.evaluate(position_m[static_cast<size_t>(frame)]));
    ++frames;
  }
  const double chamfer_m2 =
      cloud_errors(clouds, mesh, position_m, static_cast<int>(position_m.size())).all.chamfer_m2;
  numbers.push_back({.name = "clouds from surface, " + whose,
                     .unit = "mm",
                     .value = 1e3 * std::sqrt(square_m2 / frames)});
  numbers.push_back({.name = "Chamfer, " + whose, .unit = "m2", .value = chamfer_m2});
  return chamfer_m2;
}

}  // namespace

ChainResult surface_from_texture(const fs::path& set, const fs::path& steps,
                                 const ProgressCallback& progress) {
  const ClothSetup setup = read_setup(set / "reference.json");
  const Recording recording = write_as_recording(set, setup, steps / "recording");
  const fs::path folder = steps / "tracked";
  fs::create_directories(folder);
  const TrackStepResult step = track_step(recording, {kCamera}, {}, folder, progress);
  const Tracks2d& ours = step.cameras.front().result.tracks;
  const Tracks2d given = read_tracks2d(recording.tracks2d.at(kCamera), recording.markers);
  const PointClouds clouds = read_clouds(set / "point_clouds_mm.csv");
  const TemplateSheet sheet = read_template(set / "template_mesh.csv", setup);

  ChainResult chain;
  const auto good =
      std::ranges::count_if(ours, [](const auto& row) { return row.rejected.empty(); });
  chain.numbers.push_back(
      {.name = "found",
       .unit = "%",
       .value = 100 * static_cast<double>(good) / static_cast<double>(given.size())});
  const auto distances = [&](const std::string& whose, const Tracks2d& tracks) {
    return add_distances(whose, clouds, sheet.mesh,
                         follow_template(sheet, tracks, setup.camera, recording.markers, progress),
                         chain.numbers);
  };
  const double own_m2 = distances("own tracks", ours);
  const double given_m2 = distances("given tracks", given);
  chain.numbers.push_back({.name = "Chamfer ratio", .unit = "", .value = own_m2 / given_m2});
  return chain;
}

}  // namespace clothfit
