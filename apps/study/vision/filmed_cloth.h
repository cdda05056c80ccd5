#pragma once

#include <filesystem>

#include "apps/study/vision/chain_result.h"
#include "data/progress.h"

namespace clothfit {

/// Follows a real cloth by its print through the pictures of a set that brings tracks and measured
/// clouds, and holds the surface that follows from either tracks against the clouds. The surface is
/// the set's template, bent (template_sheet.h): what moved the cloth is not known, so no model of
/// its motion is asked for. Files of the set: pictures, `reference.json`, `template_mesh.csv`,
/// `track_points.csv`, `tracks.csv`, `point_clouds_mm.csv`.
///
/// The numbers are the share of markers found (%); of the surface from our tracks and from those
/// of the set the rms distance of the clouds' points from it (mm) and the Chamfer distance (m²),
/// means over all frames; and the ratio of the Chamfer distances. The recording is written below
/// `steps`. Throws InputError, NoResult, Cancelled.
ChainResult surface_from_texture(const std::filesystem::path& set,
                                 const std::filesystem::path& steps,
                                 const ProgressCallback& progress);

}  // namespace clothfit
