#include "vision/detect/tag_family.h"

#include <apriltag/apriltag.h>
#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h10.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagCircle21h7.h>
#include <apriltag/tagCircle49h12.h>
#include <apriltag/tagCustom48h12.h>
#include <apriltag/tagStandard41h12.h>
#include <apriltag/tagStandard52h13.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cassert>

#include "data/input_error.h"

namespace clothfit {
namespace {

struct Family {
  const char* name;
  apriltag_family_t* (*create)();
  void (*destroy)(apriltag_family_t*);
};

/// Makes tag36h11 as Kalibr prints its AprilGrid: with a black border of two cells.
apriltag_family_t* create_36h11_border2() {
  apriltag_family_t* family = tag36h11_create();
  family->width_at_border += 2;
  family->total_width += 2;
  for (uint32_t bit = 0; bit < family->nbits; ++bit) {
    ++family->bit_x[bit];
    ++family->bit_y[bit];
  }
  return family;
}

constexpr std::array kFamilies = {
    // alphabetical
    Family{"tag16h5", tag16h5_create, tag16h5_destroy},
    Family{"tag25h9", tag25h9_create, tag25h9_destroy},
    Family{"tag36h10", tag36h10_create, tag36h10_destroy},
    Family{"tag36h11", tag36h11_create, tag36h11_destroy},
    Family{"tag36h11_border2", create_36h11_border2, tag36h11_destroy},
    Family{"tagCircle21h7", tagCircle21h7_create, tagCircle21h7_destroy},
    Family{"tagCircle49h12", tagCircle49h12_create, tagCircle49h12_destroy},
    Family{"tagCustom48h12", tagCustom48h12_create, tagCustom48h12_destroy},
    Family{"tagStandard41h12", tagStandard41h12_create, tagStandard41h12_destroy},
    Family{"tagStandard52h13", tagStandard52h13_create, tagStandard52h13_destroy},
};

}  // namespace

std::vector<std::string> tag_families() {
  std::vector<std::string> names;
  for (const Family& family : kFamilies) names.emplace_back(family.name);
  return names;
}

TagFamily make_tag_family(const std::string& name) {
  const auto found = std::find_if(kFamilies.begin(), kFamilies.end(),
                                  [&](const Family& family) { return name == family.name; });
  if (found == kFamilies.end())
    throw InputError("markers", fmt::format("unknown tag family '{}'", name),
                     fmt::format("one of {}", fmt::join(tag_families(), ", ")));
  return {found->create(), found->destroy};
}

void require_tags(const std::string& family, const std::set<int>& ids, const std::string& where) {
  const int count = static_cast<int>(make_tag_family(family)->ncodes);
  for (const int id : ids)
    if (id < 0 || id >= count)
      throw InputError(where, fmt::format("there is no tag {} in {}", id, family),
                       fmt::format("0 to {}", count - 1), "name the family that was printed");
}

TagPattern printed_tag(apriltag_family& family, int id) {
  if (id < 0 || static_cast<uint32_t>(id) >= family.ncodes)
    throw InputError("markers", fmt::format("there is no tag {} in {}", id, family.name),
                     fmt::format("0 to {}", family.ncodes - 1));
  const std::unique_ptr<image_u8_t, void (*)(image_u8_t*)> image(
      apriltag_to_image(&family, static_cast<uint32_t>(id)), image_u8_destroy);
  TagPattern pattern{
      .border_cells = family.width_at_border, .total_cells = family.total_width, .white = {}};
  assert(image->width == pattern.total_cells && image->height == pattern.total_cells);
  for (int row = 0; row < image->height; ++row)
    for (int column = 0; column < image->width; ++column)
      pattern.white.push_back(image->buf[row * image->stride + column] > 127 ? 1.0F : 0.0F);
  return pattern;
}

}  // namespace clothfit
