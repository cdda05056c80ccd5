// Checks that PLY files of every encoding are read, and damaged ones refused with what is wrong.

#include "data/ply_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "data/input_error.h"
#include "data/little_endian.h"
#include "data/text_file.h"
#include "tests/data/temporary_folder.h"

namespace clothfit {
namespace {

SurfaceMesh pyramid() {
  SurfaceMesh mesh;
  mesh.vertex_m.resize(3, 5);
  mesh.vertex_m << 0, 1.1, 1, 0, 0.3, 0, 0, 1, 1, 0.7, 0, 0, 0, 0, 1.0 / 3;
  mesh.triangle.resize(3, 6);
  mesh.triangle << 0, 0, 0, 1, 2, 3, 2, 3, 1, 2, 3, 0, 1, 2, 4, 4, 4, 4;
  return mesh;
}

constexpr const char* kHeader =
    "ply\nformat ascii 1.0\ncomment by hand\nelement vertex 4\nproperty float x\nproperty float y\n"
    "property float z\nproperty uchar red\nelement face 1\nproperty list uchar int vertex_indices\n"
    "end_header\n";

std::string problem_of(const std::string& content) {
  const TemporaryFolder folder;
  write_text(content, folder / "a.ply");
  try {
    read_ply(folder / "a.ply");
  } catch (const InputError& error) {
    return error.problem();
  }
  return "accepted";
}

TEST(PlyMesh, ReadsBackWhatItWrites) {
  const TemporaryFolder folder;
  const SurfaceMesh mesh = pyramid();
  write_ply(mesh, folder / "a.ply");
  const SurfaceMesh read = read_surface(folder / "a.ply");
  EXPECT_EQ(read.vertex_m, mesh.vertex_m);
  EXPECT_EQ(read.triangle, mesh.triangle);
}

TEST(PlyMesh, ReadsTextWithWhatItDoesNotKnow) {
  const TemporaryFolder folder;
  write_text(std::string(kHeader) + "0 0 0 255\n1 0 0 0\n1 1 0 9\n0 1.5 0 1\n4 0 1 2 3\n",
             folder / "a.ply");
  const SurfaceMesh mesh = read_ply(folder / "a.ply");
  EXPECT_EQ(mesh.vertex_m.cols(), 4);
  EXPECT_EQ(mesh.vertex_m(1, 3), 1.5);
  Eigen::Matrix3Xi triangles(3, 2);
  triangles << 0, 0, 1, 2, 2, 3;
  EXPECT_EQ(mesh.triangle, triangles);
}

TEST(PlyMesh, ReadsBigEndianFloats) {
  std::string bytes =
      "ply\r\nformat binary_big_endian 1.0\r\nelement vertex 3\r\nproperty float x\r\nproperty "
      "float y\r\nproperty float z\r\nelement edge 1\r\nproperty short a\r\nelement face 1\r\n"
      "property list uchar uint vertex_index\r\nend_header\r\n";
  const auto append_turned = [&](auto append, auto value) {
    std::string word;
    append(value, word);
    std::ranges::reverse(word);
    bytes += word;
  };
  for (const double x : {0.0, 0.0, 0.0, 2.5, 0.0, 0.0, 0.0, -3.0, 0.0})
    append_turned(append_float32, x);
  bytes += std::string("\0\7", 2);
  bytes += '\3';
  for (const int corner : {0, 1, 2}) append_turned(append_int32, corner);
  const TemporaryFolder folder;
  write_text(bytes, folder / "a.ply");
  const SurfaceMesh mesh = read_ply(folder / "a.ply");
  EXPECT_EQ(mesh.vertex_m(0, 1), 2.5);
  EXPECT_EQ(mesh.vertex_m(1, 2), -3);
}

TEST(PlyMesh, NamesTheLineAndKnowsNamesInUpperCase) {
  const TemporaryFolder folder;
  write_text(std::string(kHeader) + "0 0 0 0\n1 0 x 0\n", folder / "A.PLY");
  try {
    read_surface(folder / "A.PLY");
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("A.PLY:13: number `x`"), std::string::npos)
        << error.what();
  }
}

TEST(PlyMesh, SaysWhatIsWrong) {
  const std::string header = kHeader;
  EXPECT_EQ(problem_of("solid\n"), "does not begin with `ply`");
  EXPECT_EQ(problem_of("ply\nformat ascii 1.0\n"), "ends within its header");
  EXPECT_EQ(problem_of(header + "0 0 0 0\n1 0 0 0\n"), "ends before its last element");
  EXPECT_EQ(problem_of(header + "0 0 0 0\n1 0 0 0\n1 1 0 0\n0 1 0 0\n3 0 1 4\n"),
            "corner 4 of face 0");
  EXPECT_EQ(problem_of(header + "0 0 0 0\n1 0 0 0\n1 1 0 0\n0 1 0 0\n2 0 1\n"),
            "face 0 with 2 corners");
  EXPECT_EQ(problem_of(header + "0 0 0 0\n1 0 x 0\n1 1 0 0\n0 1 0 0\n3 0 1 2\n"), "number `x`");
  EXPECT_EQ(problem_of(header + "0 0 0 0\n1 0 1e9 0\n1 1 0 0\n0 1 0 0\n3 0 1 2\n"),
            "coordinate `1e+09` of vertex 1");
  EXPECT_EQ(problem_of(header + "0 0 0 0\n1 0 0 0\n2 0 0 0\n0 1 0 0\n3 0 1 2\n"),
            "no face has an area");
  EXPECT_EQ(problem_of("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nend_header\n"),
            "vertices without x, y and z");
  EXPECT_EQ(problem_of("ply\nelement vertex 5000000000\n"), "element count `5000000000`");
}

}  // namespace
}  // namespace clothfit
