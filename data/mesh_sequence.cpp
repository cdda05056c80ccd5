#include "data/mesh_sequence.h"

#include <fmt/format.h>

#include "data/little_endian.h"
#include "data/number_text.h"
#include "data/text_file.h"

namespace clothfit {

Eigen::Matrix4Xi quads(const MeshSequence& mesh) {
  Eigen::Matrix4Xi cells(4, (mesh.columns - 1) * (mesh.rows - 1));
  for (int i = 0; i + 1 < mesh.rows; ++i) {
    for (int j = 0; j + 1 < mesh.columns; ++j) {
      const int corner = i * mesh.columns + j;
      // The corners run down along t, right along s and up again.
      cells.col(i * (mesh.columns - 1) + j) << corner, corner + mesh.columns,
          corner + mesh.columns + 1, corner + 1;
    }
  }
  return cells;
}

Eigen::Matrix2Xd texture_coordinates(const MeshSequence& mesh) {
  Eigen::Matrix2Xd uv(2, mesh.columns * mesh.rows);
  for (int i = 0; i < mesh.rows; ++i) {
    for (int j = 0; j < mesh.columns; ++j)
      uv.col(i * mesh.columns + j) << static_cast<double>(j) / (mesh.columns - 1),
          1 - static_cast<double>(i) / (mesh.rows - 1);
  }
  return uv;
}

void write_obj(const MeshSequence& mesh, int frame, const std::filesystem::path& file) {
  const Eigen::Matrix3Xd& position_m = mesh.position_m[static_cast<size_t>(frame)];
  std::string text = fmt::format("# frame {}, {} s; metres\no cloth\n", frame,
                                 number_text(mesh.time_s[static_cast<size_t>(frame)]));
  for (const auto& p : position_m.colwise())
    text += fmt::format("v {} {} {}\n", number_text(p.x()), number_text(p.y()), number_text(p.z()));
  const Eigen::Matrix2Xd texture = texture_coordinates(mesh);
  for (const auto& uv : texture.colwise())
    text += fmt::format("vt {} {}\n", number_text(uv.x()), number_text(uv.y()));
  const Eigen::Matrix4Xi cells = quads(mesh);
  for (const auto& q : cells.colwise()) {  // OBJ counts from 1
    text +=
        fmt::format("f {0}/{0} {1}/{1} {2}/{2} {3}/{3}\n", q[0] + 1, q[1] + 1, q[2] + 1, q[3] + 1);
  }
  write_text(text, file);
}

void write_pc2(const MeshSequence& mesh, const std::filesystem::path& file) {
  std::string bytes("POINTCACHE2\0", 12);
  append_int32(1, bytes);
  append_int32(mesh.columns * mesh.rows, bytes);
  append_float32(0, bytes);
  append_float32(1, bytes);
  append_int32(static_cast<int>(mesh.position_m.size()), bytes);
  for (const Eigen::Matrix3Xd& position_m : mesh.position_m)
    for (const double coordinate : position_m.reshaped()) append_float32(coordinate, bytes);
  write_text(bytes, file);
}

}  // namespace clothfit
