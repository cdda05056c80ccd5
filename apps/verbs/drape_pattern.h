#pragma once

#include <filesystem>
#include <string>

#include "model/garment/drape_garment.h"

namespace clothfit {

/// The request to drape a sewing pattern.
struct PatternRequest {
  std::filesystem::path pattern;
  std::filesystem::path body;    ///< OBJ; empty: the bundled mannequin
  std::filesystem::path fabric;  ///< data sheet of all panels; empty: those that the pattern names
  GarmentOptions options;
  std::filesystem::path out;  ///< empty: named after the pattern
};

/// Sews and drapes the pattern, writes garment.obj, body.obj, garment.json and garment.csv, and
/// says how it went. Returns an exit code; throws InputError, NoResult where a seam stays open or
/// the garment finds no rest, and Cancelled.
int drape_pattern(const PatternRequest& request, const std::string& command);

}  // namespace clothfit
