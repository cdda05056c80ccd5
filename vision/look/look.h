#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "data/finding.h"
#include "data/markers.h"
#include "data/progress.h"
#include "vision/detect/board_search.h"
#include "vision/look/dots_shown.h"
#include "vision/track/tag_history.h"

namespace clothfit {

/// A tag that a picture shows.
struct SeenTag {
  std::string family;
  TagReading reading;  ///< with the reasons that one picture gives to doubt corners
};

/// A dot of a known sheet.
struct SeenMarker {
  int marker = 0;  ///< index into the sheet's markers
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Zero();
};

struct SeenPicture {
  std::string name;
  int frame = 0;
  std::vector<SeenTag> tags;        ///< by family, then id; of ids that some picture shows well
  std::optional<SeenBoard> board;   ///< looked for where few tags and no dots are seen
  std::vector<SeenDot> dots;        ///< of any sheet
  std::vector<SeenMarker> markers;  ///< dots of LookOptions::sheet
};

struct LookOptions {
  /// Families of tags to look for; empty: those that some of the pictures clearly show.
  std::vector<std::string> families;
  int every = 1;       ///< > 0: looks at every n-th picture
  int looks = 0;       ///< > 0: looks at about so many pictures, spread over all, whatever `every`
  int head = 0;        ///< looks at each of the first so many besides
  bool boards = true;  ///< looks for chessboards
  bool dots = true;    ///< looks for dots on a square lattice
  /// The markers of a cloth with dots, which are then looked for in place of unknown ones; else
  /// null.
  const MarkerSet* sheet = nullptr;
  void validate() const;  ///< throws InputError
};

struct Overlay {
  int frame = 0;
  cv::Mat picture;  ///< 8-bit BGR
};

/// What footage shows.
struct LookResult {
  bool cancelled = false;
  int count = 0;  ///< pictures, those that were not looked at among them
  int width = 0, height = 0;
  std::vector<double> times_s;        ///< of each picture, where the container states them
  std::vector<std::string> families;  ///< that were looked for
  std::optional<DotPattern> pattern;  ///< that names dots
  std::vector<SeenPicture> pictures;  ///< whole ones that were looked at, in order
  std::vector<Overlay> overlays;      ///< of the first, the middle and the last of these
  Findings footage;                   ///< faults of the pictures and their files
  std::string turned;                 ///< nothing is seen, but would be: mirrored, inverted
};

/// Lists what the pictures of a folder or a video show, without a recording that says what to look
/// for. The result does not depend on the number of threads. Throws InputError for pictures that
/// cannot be read.
LookResult look(const std::filesystem::path& images, const LookOptions& options,
                const ProgressCallback& progress);

}  // namespace clothfit
