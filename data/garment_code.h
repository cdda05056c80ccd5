#pragma once

#include <filesystem>

#include "data/sewing_pattern.h"

namespace clothfit {

/// Reads a sewing pattern of GarmentCode [korosteleva2023]: a JSON specification with `pattern`
/// (panels with vertices, edges, translation and rotation; stitches of two edges each). Its axes
/// (y up, the body looks along z) become ours (z up, the body looks along -y). All panels are of
/// one fabric, `cloth`, its warp along their y axes. Gathers count as meant.
///
/// Throws InputError for a file that is no such specification, and for what is not read: stitches
/// that turn a side round.
Pattern read_garment_code(const std::filesystem::path& file);

}  // namespace clothfit
