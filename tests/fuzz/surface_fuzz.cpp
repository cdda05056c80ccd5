// A surface in OBJ. Its triangles name vertices that are there, and it reads again as written.

#include "data/obj_mesh.h"
#include "tests/fuzz/scratch_folder.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, size_t size) {
  using namespace clothfit;
  const auto file = write_scratch("table.obj", text_of(data, size));
  SurfaceMesh mesh;
  try {
    mesh = read_obj(file);
  } catch (const InputError&) {
    return 0;
  }
  if (mesh.triangle.minCoeff() < 0 || mesh.triangle.maxCoeff() >= mesh.vertex_m.cols())
    __builtin_trap();
  write_obj(mesh, file);
  if (read_obj(file).vertex_m != mesh.vertex_m) __builtin_trap();
  return 0;
}
