#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
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
  /// Median way of a tag's centre from frame to frame; nothing where no tag is seen twice.
  std::optional<double> moves_px;
  int doubted = 0;  ///< corners
  int corners = 0;
  int repeated = 0;  ///< tags that a picture shows more than once
};

/// Boards of one size over all pictures.
struct SeenBoards {
  int columns = 0, rows = 0;  ///< inner corners
  int pictures = 0;
};

/// Dots on a lattice over all pictures.
struct SeenDots {
  int columns = 0, rows = 0;       ///< of the pattern that names them; 0 where none does
  int pictures = 0;                ///< that show any
  double each_shows = 0;           ///< median over those
  double width_px = 0;             ///< median
  double sigma_px = 0;             ///< median
  std::optional<double> moves_px;  ///< median way of a named dot from frame to frame
  int named = 0, count = 0;        ///< over all pictures
};

struct SeenSummary {
  std::vector<SeenFamily> families;
  SeenDots dots;
  std::vector<SeenBoards> boards;  ///< most pictures first
};

SeenSummary summarise(const LookResult& result);

/// Returns "72 pictures of 960 x 720 px, 1.2 s, 60 per second in the mean".
std::string footage_text(const LookResult& result);

Table summary_table(const SeenSummary& summary);

nlohmann::ordered_json to_json(const LookResult& result, const SeenSummary& summary);

}  // namespace clothfit
