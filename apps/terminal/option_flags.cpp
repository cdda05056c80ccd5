#include "apps/terminal/option_flags.h"

#include <algorithm>
#include <map>
#include <regex>

namespace clothfit {
namespace {

/// Returns the flag that sets a member: its name with dashes, but for these.
std::string flag_of(std::string member) {
  static const std::map<std::string, std::string> kOthers = {
      {"allowed", "allow-outside"},
      {"beam_width", "lines"},
      {"budget_s", "budget"},
      {"columns", "grid"},
      {"disc_diameter_m", "disc"},
      {"dots_per_inch", "dpi"},
      {"effects", "effect"},
      {"height_m", "size"},
      {"hold_off_m", "hold-off"},
      {"self_distance_m", "self-distance"},
      {"marker_offset_sigma_m", "marker-offsets"},
      {"mesh_columns", "mesh"},
      {"mesh_rows", "mesh"},
      {"plants", "plant"},
      {"priors", "prior"},
      {"spacing_m", "spacing"},
      {"specimen_diameter_m", "specimen"},
      {"spring_set", "springs"},
      {"square_m", "square"},
      {"tag_m", "tag"},
      {"width_m", "size"},
  };
  if (const auto other = kOthers.find(member); other != kOthers.end()) return "--" + other->second;
  std::ranges::replace(member, '_', '-');
  return "--" + member;
}

}  // namespace

std::string with_flags(const std::string& message) {
  static const std::regex kMember(
      R"((?:[A-Z][A-Za-z]*Options|JournalStart|OutsideFiles)::([a-z_]+)( = )?)");
  std::string result;
  auto rest = message.begin();
  for (std::sregex_iterator match(message.begin(), message.end(), kMember), end; match != end;
       ++match) {
    result.append(rest, message.begin() + match->position());
    result += flag_of((*match)[1]) + ((*match)[2].matched ? " " : "");
    rest = message.begin() + match->position() + match->length();
  }
  return result.append(rest, message.end());
}

}  // namespace clothfit
