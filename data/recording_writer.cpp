#include <array>
#include <cassert>

#include "data/recording.h"
#include "data/recording_words.h"
#include "data/text_file.h"
#include "data/yaml_writer.h"

namespace clothfit {
namespace {

template <class Choice>
std::string word_of(const Words<Choice>& words, Choice choice) {
  for (const auto& [word, known] : words) {
    if (known == choice) return word;
  }
  assert(false && "every choice has a word");
  return {};
}

std::array<double, 2> numbers(const Eigen::Vector2d& v) {
  return {v.x(), v.y()};
}

/// Names files relative to the folder that recording.yaml is written to.
class RelativePaths {
 public:
  explicit RelativePaths(const std::filesystem::path& folder)
      : folder_(std::filesystem::weakly_canonical(std::filesystem::absolute(folder))) {}
  std::string operator()(const std::filesystem::path& path) const {
    const std::filesystem::path whole = std::filesystem::absolute(path).lexically_normal();
    const std::filesystem::path parent = std::filesystem::weakly_canonical(whole.parent_path());
    return (parent / whole.filename()).lexically_relative(folder_).generic_string();
  }

 private:
  std::filesystem::path folder_;
};

void write_cloth(YamlWriter& out, const ClothDescription& cloth) {
  out.key("cloth").begin_map();
  out.key("size").value(std::array{cloth.width_m, cloth.height_m});
  out.key("mass");
  if (cloth.mass_kg) {
    out.value(*cloth.mass_kg);
  } else {
    out.null();
  }
  out.key("masses").value(word_of(mass_distribution_words(), cloth.masses));
  out.key("mesh").begin_flow_map();
  out.key("columns").value(cloth.mesh_columns).key("rows").value(cloth.mesh_rows);
  out.end_map().end_map();
}

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
  if (body.clock_offset_s) {
    out.value(*body.clock_offset_s);
  } else {
    out.value("unknown");
  }
  out.key("holds").begin_flow_list();
  for (const Eigen::Vector2d& place : body.holds_m) out.value(numbers(place));
  out.end_list().end_map();
}

void write_held_point(YamlWriter& out, const HeldPoint& point, const RelativePaths& relative) {
  out.begin_flow_map();
  if (point.edge) {
    out.key("edge").value(to_string(*point.edge));
  } else {
    out.key("at").value(numbers(point.at_m));
  }
  out.key("motion").value(to_string(point.motion));
  if (point.file) out.key("file").value(relative(*point.file));
  out.end_map();
}

void write_declared_effect(YamlWriter& out, const DeclaredEffect& effect) {
  out.begin_flow_map().key("effect").value(effect.name);
  if (!effect.parameters.empty()) {
    out.key("parameters").begin_flow_map();
    for (const auto& [name, values] : effect.parameters) {
      out.key(name);
      if (values.size() == 1) {
        out.value(values.front());
      } else {
        out.value(values);
      }
    }
    out.end_map();
  }
  out.end_map();
}

/// A list with an item per line; `[]` when there is none.
template <class Item, class WriteItem>
void write_list(YamlWriter& out, const std::string& key, const std::vector<Item>& items,
                const WriteItem& write_item) {
  out.key(key);
  if (items.empty()) {
    out.begin_flow_list().end_list();
    return;
  }
  out.begin_list();
  for (const Item& item : items) write_item(item);
  out.end_list();
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

  assert(recording.frame_rate_hz.has_value() != recording.times_file.has_value());
  out.key("time").begin_flow_map();
  if (recording.frame_rate_hz) {
    out.key("frame_rate").value(*recording.frame_rate_hz);
  } else {
    out.key("file").value(relative(*recording.times_file));
  }
  out.end_map();

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
