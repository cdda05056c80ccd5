#pragma once

#include <string>
#include <vector>

#include "apps/terminal/table.h"
#include "model/garment/drape_garment.h"

namespace clothfit {

/// A picture of a garment on its body.
struct GarmentPicture {
  std::string name;  ///< the side that is seen: "front"
  std::string png;   ///< content of the file
};

/// What a page says of a garment beside its drape.
struct GarmentPage {
  std::string title;
  std::string summary;  ///< a sentence
  std::vector<GarmentPicture> pictures;
  std::vector<std::string> notes;
  std::string command, version;
};

/// Returns a row for every mesh of the way to rest.
Table garment_levels(const GarmentDrape& drape);

/// Writes the page of a garment at rest: pictures, meshes, and against time its energy, residual
/// force and average spring error [lethanh2007].
std::string garment_page_html(const GarmentDrape& drape, const GarmentPage& page);

}  // namespace clothfit
