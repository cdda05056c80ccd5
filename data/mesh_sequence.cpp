#include "data/mesh_sequence.h"

#include <fmt/format.h>

#include "data/little_endian.h"
#include "data/number_text.h"
#include "data/text_file.h"

namespace clothfit {

MeshSequence grid_sequence(int columns, int rows) {
  MeshSequence mesh;
  mesh.face.resize(4, (columns - 1) * (rows - 1));
  mesh.texture.resize(2, columns * rows);
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < columns; ++j) {
      const int corner = i * columns + j;
      mesh.texture.col(corner) << static_cast<double>(j) / (columns - 1),
          1 - static_cast<double>(i) / (rows - 1);
      if (i + 1 == rows || j + 1 == columns) continue;
      // The corners run down along t, right along s and up again.
      mesh.face.col(i * (columns - 1) + j) << corner, corner + columns, corner + columns + 1,
          corner + 1;
    }
  return mesh;
}

void write_obj(const MeshSequence& mesh, int frame, const std::filesystem::path& file) {
  const Eigen::Matrix3Xd& position_m = mesh.position_m[static_cast<size_t>(frame)];
  std::string text = fmt::format("# frame {}, {} s; metres\no cloth\n", frame,
                                 number_text(mesh.time_s[static_cast<size_t>(frame)]));
  for (const auto& p : position_m.colwise())
    text += fmt::format("v {} {} {}\n", number_text(p.x()), number_text(p.y()), number_text(p.z()));
  for (const auto& uv : mesh.texture.colwise())
    text += fmt::format("vt {} {}\n", number_text(uv.x()), number_text(uv.y()));
  for (const auto& face : mesh.face.colwise()) {
    text += 'f';
    for (const int corner : face)
      if (corner >= 0) text += fmt::format(" {0}/{0}", corner + 1);  // OBJ counts from 1
    text += '\n';
  }
  write_text(text, file);
}

void write_pc2(const MeshSequence& mesh, const std::filesystem::path& file) {
  std::string bytes("POINTCACHE2\0", 12);
  append_int32(1, bytes);
  append_int32(static_cast<int>(mesh.texture.cols()), bytes);
  append_float32(0, bytes);
  append_float32(1, bytes);
  append_int32(static_cast<int>(mesh.position_m.size()), bytes);
  for (const Eigen::Matrix3Xd& position_m : mesh.position_m)
    for (const double coordinate : position_m.reshaped()) append_float32(coordinate, bytes);
  write_text(bytes, file);
}

}  // namespace clothfit
