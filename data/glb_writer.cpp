#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "data/input_error.h"
#include "data/little_endian.h"
#include "data/mesh_sequence.h"
#include "data/text_file.h"

namespace clothfit {
namespace {

using Json = nlohmann::ordered_json;

/// Numbers of the glTF 2.0 specification.
constexpr int kUnsignedInt = 5125, kFloat = 5126;
constexpr int kArrayBuffer = 34962, kElementArrayBuffer = 34963;
constexpr std::uint32_t kMagic = 0x46546C67, kVersion = 2;
constexpr std::uint32_t kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;

/// Returns the turn that takes a direction to +y; half a turn about x where it points to -y.
Eigen::Quaterniond turn_to_y(const Eigen::Vector3d& direction) {
  const Eigen::Vector3d from = direction.normalized(), to = Eigen::Vector3d::UnitY();
  const double cosine = to.dot(from);
  constexpr double kOpposite = -1 + 1e-12;
  if (cosine < kOpposite) return {0, 1, 0, 0};
  const double twice_half_cosine = std::sqrt((1 + cosine) * 2);
  const Eigen::Vector3d axis = from.cross(to) * (1 / twice_half_cosine);
  return {0.5 * twice_half_cosine, axis.x(), axis.y(), axis.z()};
}

/// The one buffer of the file, with its views and accessors: one accessor per view.
class Buffer {
 public:
  /// Returns the accessor's index. `values`: components x elements.
  int add_floats(const Eigen::MatrixXf& values, const char* type, bool with_bounds,
                 bool is_vertex_data) {
    const int accessor = begin(kFloat, type, values.cols(), is_vertex_data ? kArrayBuffer : 0);
    if (with_bounds) {
      for (const auto& [key, bounds] :
           {std::pair("min", Eigen::VectorXf(values.rowwise().minCoeff())),
            std::pair("max", Eigen::VectorXf(values.rowwise().maxCoeff()))})
        for (const float bound : bounds) accessors_.back()[key].push_back(bound);
    }
    for (const float value : values.reshaped()) append_float32(value, bytes_);
    end();
    return accessor;
  }
  int add_indices(const std::vector<int>& indices) {
    const int accessor = begin(kUnsignedInt, "SCALAR", static_cast<Eigen::Index>(indices.size()),
                               kElementArrayBuffer);
    for (const int index : indices) append_int32(index, bytes_);
    end();
    return accessor;
  }

  const std::string& bytes() const { return bytes_; }
  void describe(Json& gltf) const {
    gltf["buffers"] = Json::array({{{"byteLength", bytes_.size()}}});
    gltf["bufferViews"] = views_;
    gltf["accessors"] = accessors_;
  }

 private:
  int begin(int component, const char* type, Eigen::Index count, int target) {
    accessors_.push_back({{"bufferView", views_.size()},
                          {"componentType", component},
                          {"count", count},
                          {"type", type}});
    views_.push_back({{"buffer", 0}, {"byteOffset", bytes_.size()}});
    if (target != 0) views_.back()["target"] = target;
    return static_cast<int>(accessors_.size()) - 1;
  }
  void end() {
    Json& view = views_.back();
    view["byteLength"] = bytes_.size() - view["byteOffset"].get<size_t>();
  }

  std::string bytes_;
  Json views_ = Json::array();
  Json accessors_ = Json::array();
};

/// Frames [first, last] as one mesh: the first one, and a morph target for each of the others.
struct Part {
  size_t first = 0;
  size_t last = 0;
  size_t targets() const { return last - first; }
};

/// Divides the frames into parts; neighbouring parts share a frame.
std::vector<Part> parts_of(size_t frames) {
  std::vector<Part> parts;
  size_t first = 0;
  do {
    const size_t last = std::min(first + static_cast<size_t>(kMostMorphTargets), frames - 1);
    parts.push_back({first, last});
    first = last;
  } while (first + 1 < frames);
  return parts;
}

/// Returns the seconds from the first frame, 1 x frames of the part.
Eigen::MatrixXf times_of(const MeshSequence& mesh, const Part& part) {
  Eigen::MatrixXf times(1, static_cast<Eigen::Index>(part.targets() + 1));
  for (size_t f = part.first; f <= part.last; ++f)
    times(0, static_cast<Eigen::Index>(f - part.first)) =
        static_cast<float>(mesh.time_s[f] - mesh.time_s.front());
  return times;
}

class GlbWriter {
 public:
  explicit GlbWriter(const MeshSequence& mesh) : mesh_(mesh) {
    std::vector<int> triangles;
    for (const auto& face : mesh.face.colwise()) {
      triangles.insert(triangles.end(), {face[0], face[1], face[2]});
      if (face[3] >= 0) triangles.insert(triangles.end(), {face[0], face[2], face[3]});
    }
    indices_ = buffer_.add_indices(triangles);
    // glTF's v runs downwards.
    Eigen::MatrixXf uv = mesh.texture.cast<float>();
    uv.row(1).array() = 1 - uv.row(1).array();
    texture_coordinates_ = buffer_.add_floats(uv, "VEC2", false, true);
  }

  void add_part(const Part& part, bool is_only, bool is_last) {
    const Eigen::Matrix3Xd& base_m = mesh_.position_m[part.first];
    Json primitive = {{"attributes",
                       {{"POSITION", buffer_.add_floats(base_m.cast<float>(), "VEC3", true, true)},
                        {"TEXCOORD_0", texture_coordinates_}}},
                      {"indices", indices_},
                      {"material", 0}};
    for (size_t f = part.first + 1; f <= part.last; ++f) {
      const Eigen::MatrixXf moved = (mesh_.position_m[f] - base_m).cast<float>();
      primitive["targets"].push_back({{"POSITION", buffer_.add_floats(moved, "VEC3", true, true)}});
    }
    Json mesh = {{"name", "cloth"}, {"primitives", Json::array({primitive})}};
    if (part.targets() > 0) mesh["weights"] = std::vector<int>(part.targets(), 0);
    const int node = static_cast<int>(meshes_.size()) + 1;  // node 0 is the root
    nodes_.push_back({{"name", "cloth"}, {"mesh", meshes_.size()}});
    meshes_.push_back(std::move(mesh));
    if (part.targets() > 0) add_weights(part, node);
    if (!is_only) add_visibility(part, node, is_last);
  }

  std::string bytes() {
    const Eigen::Quaterniond turn = turn_to_y(mesh_.up);
    Json children = Json::array();
    for (size_t n = 0; n < nodes_.size(); ++n) children.push_back(n + 1);
    Json root = {{"name", "world"},
                 {"rotation", {turn.x(), turn.y(), turn.z(), turn.w()}},
                 {"children", children}};
    nodes_.insert(nodes_.begin(), root);

    Json gltf = {{"asset", {{"version", "2.0"}, {"generator", "clothfit"}}},
                 {"scene", 0},
                 {"scenes", Json::array({{{"nodes", {0}}}})},
                 {"nodes", nodes_},
                 {"meshes", meshes_},
                 {"materials", Json::array({{{"name", "fabric"},
                                             {"doubleSided", true},
                                             {"pbrMetallicRoughness",
                                              {{"baseColorFactor", {0.72, 0.76, 0.82, 1.0}},
                                               {"metallicFactor", 0},
                                               {"roughnessFactor", 0.9}}}}})}};
    if (!channels_.empty()) {
      gltf["animations"] =
          Json::array({{{"name", "motion"}, {"channels", channels_}, {"samplers", samplers_}}});
    }
    buffer_.describe(gltf);
    return packed(gltf.dump());
  }

 private:
  void add_channel(int node, const char* path, int input, int output, const char* interpolation) {
    channels_.push_back(
        {{"sampler", samplers_.size()}, {"target", {{"node", node}, {"path", path}}}});
    samplers_.push_back({{"input", input}, {"output", output}, {"interpolation", interpolation}});
  }

  /// Adds keys: key k gives target k - 1 all the weight, key 0 none.
  void add_weights(const Part& part, int node) {
    const auto targets = static_cast<Eigen::Index>(part.targets());
    Eigen::MatrixXf weights = Eigen::MatrixXf::Zero(targets, targets + 1);
    weights.rightCols(targets).setIdentity();
    const int input = buffer_.add_floats(times_of(mesh_, part), "SCALAR", true, false);
    const int output =
        buffer_.add_floats(weights.reshaped(1, weights.size()), "SCALAR", false, false);
    add_channel(node, "weights", input, output, "LINEAR");
  }

  /// Hides a part outside its frames: a node that is scaled to nothing is not drawn.
  void add_visibility(const Part& part, int node, bool is_last) {
    const Eigen::MatrixXf times = times_of(mesh_, part);
    std::vector<std::pair<float, float>> keys;  // from when on, scale
    if (part.first > 0) keys.emplace_back(0.0f, 0.0f);
    keys.emplace_back(times(0, 0), 1.0f);
    if (!is_last) keys.emplace_back(times(0, times.cols() - 1), 0.0f);
    Eigen::MatrixXf from(1, static_cast<Eigen::Index>(keys.size()));
    Eigen::MatrixXf scale(3, from.cols());
    for (Eigen::Index k = 0; k < from.cols(); ++k) {
      from(0, k) = keys[static_cast<size_t>(k)].first;
      scale.col(k).setConstant(keys[static_cast<size_t>(k)].second);
    }
    const int input = buffer_.add_floats(from, "SCALAR", true, false);
    const int output = buffer_.add_floats(scale, "VEC3", false, false);
    add_channel(node, "scale", input, output, "STEP");
  }

  /// Returns the container: header, JSON chunk padded with blanks, binary chunk. Every number
  /// written takes four bytes, so the binary chunk needs no padding. Empty where it would be too
  /// long.
  std::string packed(std::string json) const {
    json.resize((json.size() + 3) / 4 * 4, ' ');
    const size_t length = 12 + 8 + json.size() + 8 + buffer_.bytes().size();
    if (length > std::numeric_limits<std::uint32_t>::max()) return {};
    const auto size = [](size_t value) { return static_cast<std::uint32_t>(value); };
    std::string bytes;
    for (const std::uint32_t word : {kMagic, kVersion, size(length), size(json.size()), kJsonChunk})
      append_uint32(word, bytes);
    bytes += json;
    append_uint32(size(buffer_.bytes().size()), bytes);
    append_uint32(kBinaryChunk, bytes);
    return bytes + buffer_.bytes();
  }

  const MeshSequence& mesh_;
  Buffer buffer_;
  int indices_ = 0;
  int texture_coordinates_ = 0;
  Json nodes_ = Json::array(), meshes_ = Json::array();
  Json channels_ = Json::array(), samplers_ = Json::array();
};

}  // namespace

void write_glb(const MeshSequence& mesh, const std::filesystem::path& file) {
  GlbWriter writer(mesh);
  const std::vector<Part> parts = parts_of(mesh.position_m.size());
  for (size_t n = 0; n < parts.size(); ++n)
    writer.add_part(parts[n], parts.size() == 1, n + 1 == parts.size());
  const std::string bytes = writer.bytes();
  if (bytes.empty())
    throw InputError(file.string(), "would be longer than the 4 GiB that glTF allows",
                     "fewer frames or a smaller mesh", "write pc2 instead");
  write_text(bytes, file);
}

}  // namespace clothfit
