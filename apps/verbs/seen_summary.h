#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <set>
#include <string>
#include <vector>

#include "apps/terminal/table.h"
#include "vision/look/look.h"

namespace clothfit {

/// The tags of one family over all pictures.
struct SeenFamily {
  std::string name;
  std::set<int> ids;
  int pictures = 0;       ///< that show any
  double each_shows = 0;  ///< median over those
  double width_px = 0;    ///< median side of a tag
  double sigma_px = 0;    ///< median of corners that are not doubted
  double moves_px = 0;    ///< median way of a tag's centre from frame to frame
  int doubted = 0;        ///< corners
  int corners = 0;
  int repeated = 0;  ///< tags that a picture shows more than once
};

/// Boards of one size over all pictures.
struct SeenBoards {
  int columns = 0, rows = 0;  ///< inner corners
  int pictures = 0;
};

struct SeenSummary {
  std::vector<SeenFamily> families;
  std::vector<SeenBoards> boards;  ///< most pictures first
};

SeenSummary summarise(const LookResult& result);

/// Returns "frames: 72 pictures of 960 x 720 px, 60 per second".
std::string footage_text(const LookResult& result);

Table summary_table(const SeenSummary& summary);

nlohmann::ordered_json to_json(const LookResult& result, const SeenSummary& summary);

}  // namespace clothfit
