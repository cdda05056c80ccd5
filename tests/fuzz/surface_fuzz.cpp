// A surface in OBJ or PLY. Its triangles name vertices that are there, and it reads again as
// written in both.

#include "data/ply_mesh.h"
#include "tests/fuzz/scratch_folder.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, size_t size) {
  using namespace clothfit;
  const std::string_view text = text_of(data, size);
  const auto file = write_scratch(text.starts_with("ply") ? "surface.ply" : "surface.obj", text);
  SurfaceMesh mesh;
  try {
    mesh = read_surface(file);
  } catch (const InputError&) {
    return 0;
  }
  if (mesh.triangle.minCoeff() < 0 || mesh.triangle.maxCoeff() >= mesh.vertex_m.cols())
    __builtin_trap();
  write_obj(mesh, file);
  if (read_obj(file).vertex_m != mesh.vertex_m) __builtin_trap();
  write_ply(mesh, file);
  if (read_ply(file).vertex_m != mesh.vertex_m) __builtin_trap();
  return 0;
}
