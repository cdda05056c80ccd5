#include "apps/verbs/garment_files.h"

#include <algorithm>
#include <numbers>
#include <optional>

#include "data/mesh_sequence.h"
#include "data/ply_mesh.h"
#include "data/text_file.h"
#include "vision/encode/encode_picture.h"
#include "vision/render/render_surfaces.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

/// Returns the surface of a garment: vertices that a seam joins are one. Triangles that a seam has
/// drawn to a line are left out.
SurfaceMesh sewn_surface(const GarmentDrape& drape) {
  const GarmentMesh& mesh = drape.mesh;
  SurfaceMesh surface;
  surface.vertex_m.resize(3, mesh.particles);
  for (size_t v = 0; v < mesh.particle_of.size(); ++v)
    surface.vertex_m.col(mesh.particle_of[v]) = drape.position_m.col(static_cast<Eigen::Index>(v));
  std::vector<Eigen::Vector3i> triangles;
  const Eigen::Matrix3Xi all = mesh.cloth.triangles();
  for (const auto& corners : all.colwise()) {
    Eigen::Vector3i of;
    for (int k = 0; k < 3; ++k) of[k] = mesh.particle_of[static_cast<size_t>(corners[k])];
    if (of[0] != of[1] && of[1] != of[2] && of[2] != of[0]) triangles.push_back(of);
  }
  surface.triangle.resize(3, static_cast<Eigen::Index>(triangles.size()));
  for (size_t t = 0; t < triangles.size(); ++t)
    surface.triangle.col(static_cast<Eigen::Index>(t)) = triangles[t];
  return surface;
}

/// Returns the shapes from the panels that wait to the garment at rest, every panel with vertices
/// of its own. Their texture is the flat cloth, fitted into a square.
MeshSequence sequence_of(const GarmentDrape& drape) {
  MeshSequence sequence;
  const Eigen::Matrix3Xi triangles = drape.mesh.cloth.triangles();
  sequence.face.resize(4, triangles.cols());
  sequence.face << triangles, Eigen::RowVectorXi::Constant(triangles.cols(), -1);
  const Eigen::Matrix2Xd& flat_m = drape.mesh.cloth.material_m;
  const Eigen::Vector2d low_m = flat_m.rowwise().minCoeff();
  sequence.texture = (flat_m.colwise() - low_m) / (flat_m.rowwise().maxCoeff() - low_m).maxCoeff();
  // A second of the animation for every ten shapes: computing took another time with every mesh.
  constexpr double kSecondsPerShape = 0.1;
  for (const GarmentShape& shape : drape.shapes) {
    sequence.time_s.push_back(kSecondsPerShape * static_cast<double>(sequence.time_s.size()));
    sequence.position_m.push_back(shape.position_m);
  }
  return sequence;
}

std::vector<GarmentPicture> pictures_of(const SurfaceMesh& garment, const SurfaceMesh& body) {
  const std::vector<ColouredSurface> surfaces{
      {body.vertex_m, body.triangle, {0.55, 0.50, 0.45}, {0.3, 0.3, 0.3}},
      {garment.vertex_m, garment.triangle, {0.25, 0.42, 0.65}, {0.5, 0.3, 0.2}}};
  constexpr double kAside = 0.35;
  std::vector<GarmentPicture> pictures;
  for (const auto& [name, azimuth_rad] : {std::pair("front", kAside),
                                          {"left", 0.5 * std::numbers::pi},
                                          {"back", std::numbers::pi - kAside}})
    pictures.push_back({name, encode_png(render_surfaces(surfaces, {.azimuth_rad = azimuth_rad}))});
  return pictures;
}

}  // namespace

std::optional<std::vector<GarmentFormat>> parse_garment_formats(const std::string& text) {
  std::vector<GarmentFormat> formats;
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find(',', begin), text.size());
    const std::string word = text.substr(begin, end - begin);
    begin = end + 1;
    if (word == "ply")
      formats.push_back(GarmentFormat::ply);
    else if (word == "pc2")
      formats.push_back(GarmentFormat::pc2);
    else if (word == "gltf")
      formats.push_back(GarmentFormat::gltf);
    else if (word != "obj")  // which is always written
      return std::nullopt;
  }
  return formats;
}

bool want_shapes(const std::vector<GarmentFormat>& formats) {
  return std::ranges::any_of(formats,
                             [](GarmentFormat format) { return format != GarmentFormat::ply; });
}

std::vector<GarmentPicture> write_garment_files(const GarmentDrape& drape, const SurfaceMesh& body,
                                                const std::vector<GarmentFormat>& formats,
                                                const fs::path& folder) {
  const auto wants = [&](GarmentFormat format) {
    return std::ranges::find(formats, format) != formats.end();
  };
  const SurfaceMesh garment = sewn_surface(drape);
  write_obj(garment, folder / "garment.obj");
  write_obj(body, folder / "body.obj");
  if (wants(GarmentFormat::ply)) write_ply(garment, folder / "garment.ply");
  if (wants(GarmentFormat::pc2) || wants(GarmentFormat::gltf)) {
    const MeshSequence sequence = sequence_of(drape);
    if (wants(GarmentFormat::pc2)) {
      write_obj(sequence, 0, folder / "panels.obj");
      write_pc2(sequence, folder / "garment.pc2");
    }
    if (wants(GarmentFormat::gltf)) write_glb(sequence, folder / "garment.glb");
  }
  std::vector<GarmentPicture> pictures = pictures_of(garment, body);
  for (const GarmentPicture& picture : pictures)
    write_text(picture.png, folder / (picture.name + ".png"));
  return pictures;
}

}  // namespace clothfit
