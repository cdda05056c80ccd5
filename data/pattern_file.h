#pragma once

#include <filesystem>

#include "data/sewing_pattern.h"

namespace clothfit {

/// Reads a sewing pattern: our format clothfit-pattern/1 (YAML, docs/formats.md), or a
/// specification of GarmentCode where the name ends in .json. Darts become corners and a seam.
/// Lengths become metres. Files of fabrics and drawings are named relative to the pattern's
/// folder; drawings are read here, fabrics are not.
///
/// Throws InputError for what is not of the format. What is wrong with outlines and seams
/// themselves, check_pattern() finds.
Pattern read_pattern(const std::filesystem::path& file);

}  // namespace clothfit
