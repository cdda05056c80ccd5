#include <fmt/format.h>

#include <array>

#include "data/number_text.h"
#include "data/recording.h"
#include "data/recording_parts.h"
#include "data/recording_words.h"
#include "data/text_file.h"
#include "data/yaml_writer.h"

namespace clothfit {
namespace {

void write_camera_entry(YamlWriter& out, const CameraEntry& camera, const RelativePaths& relative) {
  out.begin_flow_map().key("name").value(camera.name);
  if (camera.file) out.key("file").value(relative(*camera.file));
  if (camera.images) out.key("images").value(relative(*camera.images));
  if (camera.calibration) {
    const BoardDescription& board = camera.calibration->board;
    out.key("calibration").begin_flow_map();
    out.key("images").value(relative(camera.calibration->images));
    out.key("board").begin_flow_map().key("kind").value("chessboard");
    out.key("columns").value(board.columns).key("rows").value(board.rows);
    out.key("square").value(board.square_m);
    out.end_map().end_map();
  }
  out.end_map();
}

void write_observations(YamlWriter& out, const Recording& recording,
                        const RelativePaths& relative) {
  out.key("observations").begin_flow_map();
  if (recording.tracks3d) out.key("tracks3d").value(relative(*recording.tracks3d));
  if (!recording.tracks2d.empty()) {
    out.key("tracks2d").begin_flow_map();
    for (const auto& [camera, file] : recording.tracks2d) out.key(camera).value(relative(file));
    out.end_map();
  }
  out.end_map();
}

void write_body(YamlWriter& out, const RigidBody& body, const RelativePaths& relative) {
  out.begin_flow_map().key("name").value(body.name).key("file").value(relative(body.file));
  out.key("clock_offset");
  if (body.clock_offset_s)
    out.value(*body.clock_offset_s);
  else
    out.value("unknown");
  out.key("holds").begin_flow_list();
  for (const Eigen::Vector2d& place : body.holds_m) out.value(numbers(place));
  out.end_list().end_map();
}

}  // namespace

std::string to_string(MarkerKind kind) {
  return word_of(marker_kind_words(), kind);
}
std::string to_string(HeldMotion motion) {
  return word_of(held_motion_words(), motion);
}
std::string to_string(StartKind start) {
  return word_of(start_words(), start);
}
std::string to_string(ClothEdge edge) {
  return word_of(cloth_edge_words(), edge);
}

void write_held_path(const HeldPath& path, const std::filesystem::path& file) {
  std::string text = "time,x,y,z\n";
  for (size_t n = 0; n < path.time_s.size(); ++n) {
    const Eigen::Vector3d& p = path.position_m[n];
    text += fmt::format("{},{},{},{}\n", number_text(path.time_s[n]), number_text(p.x()),
                        number_text(p.y()), number_text(p.z()));
  }
  write_text(text, file);
}

void write_recording(const Recording& recording, const std::filesystem::path& folder) {
  const RelativePaths relative(folder);
  YamlWriter out;
  out.begin_map();
  out.key("format").value("clothfit-recording/1");
  out.key("name").value(recording.name);
  if (!recording.origin.empty()) out.key("origin").value(recording.origin);
  write_cloth(out, recording.cloth);

  out.key("markers").begin_flow_map().key("kind").value(to_string(recording.markers.kind));
  if (!recording.markers.family.empty()) out.key("family").value(recording.markers.family);
  if (!recording.markers_file.empty()) out.key("file").value(relative(recording.markers_file));
  out.end_map();

  if (recording.frame_rate_hz)
    out.key("time").begin_flow_map().key("frame_rate").value(*recording.frame_rate_hz).end_map();
  else if (recording.times_file)
    out.key("time").begin_flow_map().key("file").value(relative(*recording.times_file)).end_map();

  const Eigen::Vector3d& gravity = recording.gravity_m_per_s2;
  out.key("gravity").value(std::array{gravity.x(), gravity.y(), gravity.z()});
  write_list(out, "cameras", recording.cameras,
             [&](const CameraEntry& camera) { write_camera_entry(out, camera, relative); });
  write_observations(out, recording, relative);
  if (recording.reference_file) out.key("reference").value(relative(*recording.reference_file));
  if (!recording.bodies.empty()) {
    write_list(out, "bodies", recording.bodies,
               [&](const RigidBody& body) { write_body(out, body, relative); });
  }
  if (recording.clouds) {
    out.key("clouds").begin_flow_map().key("camera").value(recording.clouds->camera);
    out.key("files").value(relative(recording.clouds->folder)).end_map();
  }
  if (recording.obstacle_file) out.key("obstacle").value(relative(*recording.obstacle_file));
  write_list(out, "held", recording.held,
             [&](const HeldPoint& point) { write_held_point(out, point, relative); });
  out.key("start").value(to_string(recording.start));
  write_list(out, "declared", recording.declared,
             [&](const DeclaredEffect& effect) { write_declared_effect(out, effect); });
  if (recording.held_out_from_frame) {
    out.key("held_out").begin_flow_map();
    out.key("from_frame").value(*recording.held_out_from_frame).end_map();
  }
  out.end_map();
  write_text(out.text(), folder / "recording.yaml");
}

}  // namespace clothfit
