// Checks the files for other programs, parsed back by readers of their own. Not checked here: that
// those programs like them (Khronos's validator finds no error in a .glb of one part or of three),
// and tracks (tables_test.cpp).

#include "data/mesh_sequence.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "tests/data/temporary_folder.h"

namespace clothfit {
namespace {

using Json = nlohmann::json;

/// Makes a cloth of 3 columns and 2 rows that hangs (s along x, t down) and moves at random.
MeshSequence moving_cloth(int frames) {
  MeshSequence mesh = grid_sequence(3, 2);
  std::mt19937_64 rng(1);
  for (int f = 0; f < frames; ++f) {
    mesh.time_s.push_back(2 + f / 60.0);
    Eigen::Matrix3Xd position_m(3, 6);
    for (int i = 0; i < 2; ++i)
      for (int j = 0; j < 3; ++j) position_m.col(3 * i + j) << 0.2 * j, 1e-3 * f, -0.3 * i;
    for (double& x : position_m.reshaped())
      x += 0.02 * (static_cast<double>(rng() >> 11) * 0x1p-53 - 0.5);
    mesh.position_m.push_back(position_m);
  }
  return mesh;
}

std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Reads a number in a file's bytes, which are little-endian as this machine is.
template <class Number>
Number at(const std::string& bytes, size_t offset) {
  Number value;
  EXPECT_LE(offset + sizeof value, bytes.size());
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

/// Returns the unit normal of a face by its first three corners, counter-clockwise.
Eigen::Vector3d normal(const Eigen::Matrix3Xd& p, int a, int b, int c) {
  const Eigen::Vector3d first = p.col(b) - p.col(a), second = p.col(c) - p.col(a);
  return first.cross(second).normalized();
}

TEST(Obj, HoldsEveryVertexToTheLastBitAndFacesThatLookAtTheViewer) {
  const TemporaryFolder folder;
  const MeshSequence mesh = moving_cloth(2);

  write_obj(mesh, 1, folder / "a.obj");

  std::ifstream in(folder / "a.obj");
  Eigen::Matrix3Xd position_m(3, 0);
  int textures = 0;
  std::vector<std::vector<int>> faces;
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string kind;
    words >> kind;
    if (kind == "v") {
      position_m.conservativeResize(3, position_m.cols() + 1);
      auto last = position_m.rightCols<1>();
      words >> last(0) >> last(1) >> last(2);
    }
    textures += kind == "vt";
    if (kind != "f") continue;
    faces.emplace_back();
    for (std::string corner; words >> corner;) {
      const int vertex = std::stoi(corner);
      EXPECT_EQ(corner, std::to_string(vertex) + "/" + std::to_string(vertex));
      faces.back().push_back(vertex - 1);
    }
  }

  EXPECT_EQ(position_m, mesh.position_m[1]);
  EXPECT_EQ(textures, 6);
  ASSERT_EQ(faces.size(), 2u);
  for (const std::vector<int>& face : faces) {
    ASSERT_EQ(face.size(), 4u);
    // The printed side's normal is t x s = (0, 0, -1) x (1, 0, 0) = (0, -1, 0), up to the noise.
    EXPECT_LT(normal(position_m, face[0], face[1], face[2]).y(), -0.9);
    EXPECT_LT(normal(position_m, face[0], face[2], face[3]).y(), -0.9);
  }
}

TEST(Obj, NeighbouringFacesRunOppositeWaysAlongTheirCommonEdge) {
  const Eigen::Matrix4Xi cells = grid_sequence(4, 3).face;

  std::map<std::pair<int, int>, int> uses;
  for (Eigen::Index n = 0; n < cells.cols(); ++n)
    for (int c = 0; c < 4; ++c) ++uses[{cells(c, n), cells((c + 1) % 4, n)}];

  EXPECT_EQ(cells.cols(), 6);
  for (const auto& [edge, count] : uses) EXPECT_EQ(count, 1);
}

TEST(Obj, HoldsTrianglesBesideQuads) {
  const TemporaryFolder folder;
  MeshSequence mesh = moving_cloth(1);
  mesh.face.conservativeResize(4, 3);
  mesh.face.col(2) << 0, 3, 1, -1;

  write_obj(mesh, 0, folder / "a.obj");

  EXPECT_THAT(bytes_of(folder / "a.obj"), ::testing::EndsWith("\nf 1/1 4/4 2/2\n"));
}

TEST(Glb, CutsQuadsAndKeepsTriangles) {
  const TemporaryFolder folder;
  MeshSequence mesh = moving_cloth(1);
  mesh.face.conservativeResize(4, 3);
  mesh.face.col(2) << 0, 3, 1, -1;

  write_glb(mesh, folder / "a.glb");

  const std::string bytes = bytes_of(folder / "a.glb");
  const Json json = Json::parse(bytes.substr(20, at<std::uint32_t>(bytes, 12)));
  const size_t indices = json.at("meshes")[0].at("primitives")[0].at("indices");
  EXPECT_EQ(json.at("accessors")[indices].at("count"), 3 * 5);
}

TEST(Pc2, HoldsItsHeaderAndEveryPosition) {
  const TemporaryFolder folder;
  const MeshSequence mesh = moving_cloth(5);

  write_pc2(mesh, folder / "a.pc2");

  const std::string bytes = bytes_of(folder / "a.pc2");
  ASSERT_EQ(bytes.size(), 32u + 5 * 6 * 3 * 4);
  EXPECT_EQ(bytes.substr(0, 12), std::string("POINTCACHE2\0", 12));
  EXPECT_EQ(at<std::int32_t>(bytes, 12), 1);  // version
  EXPECT_EQ(at<std::int32_t>(bytes, 16), 6);  // points
  EXPECT_EQ(at<float>(bytes, 20), 0.0f);      // first frame
  EXPECT_EQ(at<float>(bytes, 24), 1.0f);      // frames per sample
  EXPECT_EQ(at<std::int32_t>(bytes, 28), 5);  // samples
  for (size_t f = 0; f < 5; ++f)
    for (size_t n = 0; n < 18; ++n)
      EXPECT_EQ(at<float>(bytes, 32 + 4 * (18 * f + n)),
                static_cast<float>(mesh.position_m[f].reshaped()[static_cast<Eigen::Index>(n)]));
}

/// A .glb taken apart, its accessors checked against the file's bytes on the way.
class Glb {
 public:
  explicit Glb(const std::filesystem::path& file) {
    const std::string bytes = bytes_of(file);
    EXPECT_EQ(at<std::uint32_t>(bytes, 0), 0x46546C67u);
    EXPECT_EQ(at<std::uint32_t>(bytes, 4), 2u);
    EXPECT_EQ(at<std::uint32_t>(bytes, 8), bytes.size());
    const size_t json_length = at<std::uint32_t>(bytes, 12);
    EXPECT_EQ(json_length % 4, 0u);
    EXPECT_EQ(at<std::uint32_t>(bytes, 16), 0x4E4F534Au);
    json = Json::parse(bytes.substr(20, json_length));
    EXPECT_EQ(at<std::uint32_t>(bytes, 24 + json_length), 0x004E4942u);
    binary_ = bytes.substr(28 + json_length);
    EXPECT_EQ(at<std::uint32_t>(bytes, 20 + json_length), binary_.size());
    EXPECT_EQ(json["buffers"][0]["byteLength"], binary_.size());
    EXPECT_EQ(json["asset"]["version"], "2.0");
  }

  /// Returns components x elements. Bounds that are stated must be those of the data.
  Eigen::MatrixXd values(int accessor) const {
    const Json& a = json["accessors"].at(static_cast<size_t>(accessor));
    const Json& view = json["bufferViews"].at(a["bufferView"].get<size_t>());
    const std::map<std::string, int> widths = {{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}};
    const int width = widths.at(a["type"]);
    const int count = a["count"];
    const auto offset = view["byteOffset"].get<size_t>();
    EXPECT_EQ(offset % 4, 0u);
    EXPECT_EQ(view["byteLength"], 4 * width * count);
    EXPECT_LE(offset + view["byteLength"].get<size_t>(), binary_.size());
    Eigen::MatrixXd result(width, count);
    for (Eigen::Index n = 0; n < result.size(); ++n) {
      const size_t place = offset + 4 * static_cast<size_t>(n);
      result.reshaped()[n] = a["componentType"] == 5126
                                 ? static_cast<double>(at<float>(binary_, place))
                                 : static_cast<double>(at<std::uint32_t>(binary_, place));
    }
    for (Eigen::Index c = 0; a.contains("min") && c < width; ++c) {
      EXPECT_EQ(a["min"][static_cast<size_t>(c)].get<double>(), result.row(c).minCoeff());
      EXPECT_EQ(a["max"][static_cast<size_t>(c)].get<double>(), result.row(c).maxCoeff());
    }
    return result;
  }

  /// Returns the value of the animated `path` of a node at a time, as a viewer finds it; nothing
  /// where the node is not animated there.
  std::optional<Eigen::VectorXd> animated(int node, const std::string& path, double time_s) const {
    const Json& animation = json["animations"][0];
    for (const Json& channel : animation["channels"]) {
      if (channel["target"]["node"] != node || channel["target"]["path"] != path) continue;
      const Json& sampler = animation["samplers"].at(channel["sampler"].get<size_t>());
      const Eigen::MatrixXd times = values(sampler["input"]);
      Eigen::MatrixXd keys = values(sampler["output"]);
      EXPECT_EQ(keys.size() % times.size(), 0);
      keys = keys.reshaped(keys.size() / times.size(), times.size()).eval();
      Eigen::Index next = 0;
      while (next < times.size() && times(0, next) <= time_s) ++next;
      if (next == 0) return keys.col(0);
      if (next == times.size() || sampler["interpolation"] == "STEP") return keys.col(next - 1);
      const double share = (time_s - times(0, next - 1)) / (times(0, next) - times(0, next - 1));
      return (1 - share) * keys.col(next - 1) + share * keys.col(next);
    }
    return std::nullopt;
  }

  /// Returns what a viewer shows at a time: positions of the one mesh that is not scaled to
  /// nothing, in glTF's axes.
  Eigen::Matrix3Xd shown(double time_s) const {
    Eigen::Matrix3Xd visible;
    int count = 0;
    const Json& root = json["nodes"][0];
    for (const int node : root["children"].get<std::vector<int>>()) {
      const auto scale = animated(node, "scale", time_s);
      if (scale && scale->norm() == 0) continue;
      ++count;
      const Json& primitive = json["meshes"].at(
          json["nodes"].at(static_cast<size_t>(node))["mesh"].get<size_t>())["primitives"][0];
      visible = values(primitive["attributes"]["POSITION"]);
      const auto weights = animated(node, "weights", time_s);
      EXPECT_EQ(weights->size(), static_cast<Eigen::Index>(primitive["targets"].size()));
      EXPECT_LE((weights->array() != 0).count(), 2);
      for (Eigen::Index t = 0; t < weights->size(); ++t)
        visible += (*weights)[t] * values(primitive["targets"][static_cast<size_t>(t)]["POSITION"]);
    }
    EXPECT_EQ(count, 1) << "meshes shown at " << time_s;
    const auto q = root["rotation"].get<std::vector<double>>();
    return Eigen::Quaterniond(q[3], q[0], q[1], q[2]).toRotationMatrix() * visible;
  }

  Json json;

 private:
  std::string binary_;
};

TEST(Glb, ShowsEveryFrameAtItsTimeAndBlendsBetweenThem) {
  const TemporaryFolder folder;
  // Sequences have one part, one frame more than a part holds, and three parts.
  for (const int frames :
       {2, kMostMorphTargets + 1, kMostMorphTargets + 2, 2 * kMostMorphTargets + 10}) {
    SCOPED_TRACE(frames);
    const MeshSequence mesh = moving_cloth(frames);

    write_glb(mesh, folder / "a.glb");

    const Glb glb(folder / "a.glb");
    const Eigen::Matrix3d y_up{{1, 0, 0}, {0, 0, 1}, {0, -1, 0}};
    for (int f = 0; f<frames; f += frames> 20 ? 7 : 1) {
      const auto frame = static_cast<size_t>(f);
      const double time_s = static_cast<float>(mesh.time_s[frame] - 2);
      // Numbers below 1 round in single precision once each for base, displacement and weights.
      EXPECT_LT((glb.shown(time_s) - y_up * mesh.position_m[frame]).cwiseAbs().maxCoeff(), 3e-7);
      if (f + 1 == frames) continue;
      const double between_s = 0.5 * (time_s + static_cast<float>(mesh.time_s[frame + 1] - 2));
      const Eigen::Matrix3Xd middle =
          y_up * (0.5 * (mesh.position_m[frame] + mesh.position_m[frame + 1]));
      EXPECT_LT((glb.shown(between_s) - middle).cwiseAbs().maxCoeff(), 3e-7);
    }
  }
}

TEST(Glb, NamesOnlyWhatIsThere) {
  const TemporaryFolder folder;
  const MeshSequence mesh = moving_cloth(2 * kMostMorphTargets + 10);
  write_glb(mesh, folder / "a.glb");
  const Glb glb(folder / "a.glb");

  for (size_t a = 0; a < glb.json["accessors"].size(); ++a) glb.values(static_cast<int>(a));
  ASSERT_EQ(glb.json["meshes"].size(), 3u);
  for (const Json& gltf_mesh : glb.json["meshes"]) {
    const Json& primitive = gltf_mesh["primitives"][0];
    EXPECT_LE(primitive["targets"].size(), static_cast<size_t>(kMostMorphTargets));
    EXPECT_EQ(gltf_mesh["weights"].size(), primitive["targets"].size());
    const Eigen::MatrixXd indices = glb.values(primitive["indices"]);
    EXPECT_EQ(indices.size(), 3 * 4);
    EXPECT_EQ(indices.maxCoeff(), 5);
    const Eigen::Matrix3Xd base = glb.values(primitive["attributes"]["POSITION"]);
    for (Eigen::Index n = 0; n < indices.size(); n += 3)  // as the OBJ's faces
      EXPECT_LT(normal(base, static_cast<int>(indices(n)), static_cast<int>(indices(n + 1)),
                       static_cast<int>(indices(n + 2)))
                    .y(),
                -0.9);
  }
}

TEST(Glb, TurnsAnyUpToItsOwn) {
  const TemporaryFolder folder;
  MeshSequence mesh = moving_cloth(2);
  mesh.up = Eigen::Vector3d(0.3, -0.5, 0.8).normalized();

  write_glb(mesh, folder / "a.glb");

  const auto q = Glb(folder / "a.glb").json["nodes"][0]["rotation"].get<std::vector<double>>();
  const Eigen::Vector3d up = Eigen::Quaterniond(q[3], q[0], q[1], q[2]) * mesh.up;
  EXPECT_LT((up - Eigen::Vector3d::UnitY()).norm(), 1e-12);
}

}  // namespace
}  // namespace clothfit
