#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

namespace clothfit {

/// Number of sizes that a dot of a pattern may have. Symbol 0 is the smallest.
inline constexpr int kDotSymbols = 4;
/// Number of dots that a pattern may have along a side.
inline constexpr int kFewestPatternDots = 3, kMostPatternDots = 64;

/// Returns the radius of a dot over the spacing of dots: 0.13, 0.164, 0.206 or 0.26. Steps of 1.26
/// are some twenty standard deviations of the radius that a fit finds in a picture with dots 8 px
/// wide, noise of 8 grey levels and 3 px of motion blur.
double dot_radius_over_spacing(int symbol);

/// Returns the symbol whose radius is nearest by ratio; -1 where it is more than half a step beyond
/// the smallest or the largest.
int nearest_dot_symbol(double radius_over_spacing);

/// What tells the 3 x 3 neighbourhoods of a pattern apart, in every turn and mirrored.
enum class DotPatternMargin {
  any_misread,   ///< they differ in two or more dots: one misread dot makes none of them
  step_misread,  ///< the same where a dot was misread by one size
  none           ///< each is unique
};

/// Sizes of dots on a grid such that every 3 x 3 neighbourhood is found once, whichever way the
/// sheet is turned, and never mirrored.
struct DotPattern {
  int columns = 0;
  int rows = 0;
  DotPatternMargin margin = DotPatternMargin::none;
  std::vector<std::uint8_t> symbols;  ///< row by row

  int symbol(int row, int column) const {
    return symbols[static_cast<std::size_t>(row * columns + column)];
  }
};

/// Makes the pattern of a sheet, the same one every time. The margin is the best that is found:
/// `any_misread` up to about 24 x 24 dots, `step_misread` up to about 34 x 34. Throws InputError
/// below 3 x 3 dots and above 64 x 64.
DotPattern make_dot_pattern(int columns, int rows);

/// Returns the name of a pattern's dot, such as d03_11.
std::string dot_name(int row, int column);

/// Where a neighbourhood lies in a pattern. A picture's neighbourhood, turned clockwise by
/// `quarter_turns` after being mirrored left to right where `mirrored`, reads as the pattern's.
struct DotPatternPlace {
  int row = 0;  ///< of its middle
  int column = 0;
  int quarter_turns = 0;
  bool mirrored = false;
};

/// Symbols of a 3 x 3 neighbourhood, row by row.
using DotNeighbourhood = std::array<int, 9>;

/// Turns a neighbourhood as DotPatternPlace says.
DotNeighbourhood turned(const DotNeighbourhood& symbols, int quarter_turns, bool mirrored);

/// Finds neighbourhoods in a pattern.
class DotPatternIndex {
 public:
  explicit DotPatternIndex(const DotPattern& pattern);

  /// Returns the one place where the neighbourhood reads so, whichever way it is turned; nothing
  /// where there is none or a symbol is -1.
  std::optional<DotPatternPlace> find(const DotNeighbourhood& symbols) const;

 private:
  std::unordered_map<int, std::pair<int, int>> place_by_code_;  ///< row and column, upright
};

}  // namespace clothfit
