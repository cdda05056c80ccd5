#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/report/garment/garment_page.h"
#include "data/obj_mesh.h"
#include "model/garment/drape_garment.h"

namespace clothfit {

/// What else a garment's folder holds beside garment.obj.
enum class GarmentFormat {
  ply,  ///< garment.ply
  pc2,  ///< panels.obj and garment.pc2: how the panels were sewn and came to rest
  gltf  ///< garment.glb: the same as an animation
};

/// Returns the formats of a list such as "ply,gltf"; nothing where it is none.
std::optional<std::vector<GarmentFormat>> parse_garment_formats(const std::string& text);

/// Says whether a format shows how the garment was sewn (GarmentOptions::keep_shapes).
bool want_shapes(const std::vector<GarmentFormat>& formats);

/// Writes a garment at rest: garment.obj, body.obj, pictures from three sides (front.png, left.png,
/// back.png), and what `formats` asks for. Returns the pictures.
std::vector<GarmentPicture> write_garment_files(const GarmentDrape& drape, const SurfaceMesh& body,
                                                const std::vector<GarmentFormat>& formats,
                                                const std::filesystem::path& folder);

}  // namespace clothfit
