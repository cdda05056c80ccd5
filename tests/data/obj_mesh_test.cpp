// Checks surfaces in Wavefront OBJ files. Not checked here: obstacles made of them
// (tests/model/topology/obstacle_test.cpp), compressed and damaged files (corruption_test.cpp).

#include "data/obj_mesh.h"

#include <limits>

#include "tests/data/expect_refused.h"

namespace clothfit {
namespace {

TEST(ObjMesh, IsItsVerticesAndFacesWhateverElseTheFileHolds) {
  const TemporaryFolder folder;
  const auto file = folder.write("table.obj",
                                 "# a table\n"
                                 "mtllib wood.mtl\n"
                                 "o table\n"
                                 "v 0 0 0.7 # a corner\n"
                                 "v 1.5 0 0.7 1.0\n"
                                 "v\t1.5 -1e-1 0.7\n"
                                 "vn 0 0 1\n"
                                 "vt 0.5 0.5\n"
                                 "f 1/1/1 2//1 3/1\n"
                                 "s off\n");

  const SurfaceMesh mesh = read_obj(file);

  ASSERT_EQ(mesh.vertex_m.cols(), 3);
  EXPECT_EQ(mesh.vertex_m.col(2), Eigen::Vector3d(1.5, -0.1, 0.7));
  ASSERT_EQ(mesh.triangle.cols(), 1);
  EXPECT_EQ(mesh.triangle.col(0), Eigen::Vector3i(0, 1, 2));
}

TEST(ObjMesh, CutsFacesAndCountsBackwards) {
  const TemporaryFolder folder;
  const auto file = folder.write("square.obj",
                                 "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
                                 "f -4 -3 -2 -1\n"
                                 "v 0 0 1\n"
                                 "f 1 2 -1");

  const SurfaceMesh mesh = read_obj(file);

  ASSERT_EQ(mesh.triangle.cols(), 3);
  EXPECT_EQ(mesh.triangle.col(0), Eigen::Vector3i(0, 1, 2));
  EXPECT_EQ(mesh.triangle.col(1), Eigen::Vector3i(0, 2, 3));
  EXPECT_EQ(mesh.triangle.col(2), Eigen::Vector3i(0, 1, 4));
}

TEST(ObjMesh, ReadsBackAsWrittenToTheLastBit) {
  const TemporaryFolder folder;
  SurfaceMesh mesh{Eigen::Matrix3Xd(3, 4), Eigen::Matrix3Xi(3, 2)};
  mesh.vertex_m << 0, 1.0 / 3, 1e-300, -1e6,  //
      0, 0, 0.1 + 0.2, 1,                     //
      std::numeric_limits<double>::denorm_min(), -0.7, 0.7, 2;
  mesh.triangle << 0, 3, 1, 2, 2, 0;

  write_obj(mesh, folder / "body.obj");
  const SurfaceMesh again = read_obj(folder / "body.obj");

  EXPECT_EQ(again.vertex_m, mesh.vertex_m);
  EXPECT_EQ(again.triangle, mesh.triangle);
}

TEST(ObjMesh, RefusesWhatIsNoSurface) {
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& text, const std::string& beginning) {
    const auto file = folder.write("body.obj", text);
    expect_refused(folder, beginning, [&] { read_obj(file); });
  };
  const std::string corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\n";
  refused("", "body.obj: no faces");
  refused(corners, "body.obj: no faces");
  refused("v 0 0\n", "body.obj:1: coordinate ``");
  refused("v 0 0 nan\n", "body.obj:1: coordinate `nan`");
  refused("v 0 0 2e6\n", "body.obj:1: coordinate `2e6`; metres, 1e+06 at most");
  refused("\nv 0 one 0\n", "body.obj:2: coordinate `one`");
  refused(corners + "f 1 2 2\n", "body.obj: no face has an area");
  refused(corners + "f 1 2\n", "body.obj:4: a face with 2 corners");
  for (const char* corner : {"0", "4", "-4", "x", "1.5", "/1", "99999999999"})
    refused(corners + "f 1 2 " + corner + "\n", "body.obj:4: corner `" + std::string(corner) + "`");
}

}  // namespace
}  // namespace clothfit
