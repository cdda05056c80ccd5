#pragma once

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "vision/detect/tag_pattern.h"

struct apriltag_family;  // AprilTag's own; its headers stay out of ours

namespace clothfit {

/// Returns all tag families that can be read and printed, such as tag36h11; alphabetical. Those of
/// Kalibr's AprilGrid, whose border is two cells wide, are tag36h11_border2.
std::vector<std::string> tag_families();

/// AprilTag's description of a family, freed with it.
using TagFamily = std::unique_ptr<apriltag_family, void (*)(apriltag_family*)>;

/// Makes the family of that name. Throws InputError for an unknown one and lists the known ones.
TagFamily make_tag_family(const std::string& name);

/// Throws InputError, which names `where` the tags are listed, for one that the family lacks.
void require_tags(const std::string& family, const std::set<int>& ids, const std::string& where);

/// Returns tag `id` of a family as it is printed, the white around it included. Throws InputError
/// when the family has no such tag.
TagPattern printed_tag(apriltag_family& family, int id);

}  // namespace clothfit
