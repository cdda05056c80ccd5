#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/verbs/garment_files.h"
#include "model/garment/drape_garment.h"

namespace clothfit {

/// The request to drape a sewing pattern.
struct PatternRequest {
  std::filesystem::path pattern;
  std::filesystem::path body;    ///< OBJ or PLY; empty: the bundled mannequin
  std::filesystem::path fabric;  ///< data sheet of all panels; empty: those that the pattern names
  GarmentOptions options;
  std::vector<GarmentFormat> formats;
  std::filesystem::path out;  ///< empty: named after the pattern
};

/// Sews and drapes the pattern, writes report.html, garment.json, garment.csv and the files of
/// write_garment_files(), and says how it went. Returns an exit code; throws InputError, NoResult
/// where a seam stays open or the garment finds no rest, and Cancelled.
int drape_pattern(const PatternRequest& request, const std::string& command);

}  // namespace clothfit
