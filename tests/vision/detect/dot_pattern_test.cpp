// Checks that printed patterns of dots tell where a neighbourhood lies, and which misreadings show.

#include "vision/detect/dot_pattern.h"

#include <gtest/gtest.h>

#include "data/input_error.h"

namespace clothfit {
namespace {

DotNeighbourhood around(const DotPattern& pattern, int row, int column) {
  DotNeighbourhood symbols{};
  for (int i = 0; i < 9; ++i)
    symbols[static_cast<size_t>(i)] = pattern.symbol(row - 1 + i / 3, column - 1 + i % 3);
  return symbols;
}

/// Returns a neighbourhood as a picture shows it, such that DotPatternPlace's turn undoes it.
DotNeighbourhood as_seen(const DotNeighbourhood& symbols, int quarter_turns, bool mirrored) {
  const DotNeighbourhood back = turned(symbols, (4 - quarter_turns) % 4, false);
  return turned(back, 0, mirrored);
}

TEST(DotPattern, NamesEveryNeighbourhoodInEveryTurnAndMirrored) {
  for (const int across : {3, 17, 40}) {
    const DotPattern pattern = make_dot_pattern(across, across);
    const DotPatternIndex index(pattern);
    for (int row = 1; row + 1 < across; ++row)
      for (int column = 1; column + 1 < across; ++column)
        for (int turn = 0; turn < 4; ++turn)
          for (const bool mirrored : {false, true}) {
            const auto place = index.find(as_seen(around(pattern, row, column), turn, mirrored));
            ASSERT_TRUE(place.has_value());
            ASSERT_EQ(place->row, row);
            ASSERT_EQ(place->column, column);
            ASSERT_EQ(place->quarter_turns, turn);
            ASSERT_EQ(place->mirrored, mirrored);
          }
  }
}

/// Counts single misreadings by up to `steps` sizes that name some neighbourhood.
int unnoticed_misreadings(const DotPattern& pattern, int steps) {
  const DotPatternIndex index(pattern);
  int unnoticed = 0;
  for (int row = 1; row + 1 < pattern.rows; ++row)
    for (int column = 1; column + 1 < pattern.columns; ++column)
      for (size_t dot = 0; dot < 9; ++dot)
        for (int by = -steps; by <= steps; ++by) {
          DotNeighbourhood symbols = around(pattern, row, column);
          symbols[dot] += by;
          if (by != 0) unnoticed += index.find(symbols) ? 1 : 0;
        }
  return unnoticed;
}

TEST(DotPattern, OneMisreadDotIsNoticedOnSheetsUpTo24x24) {
  const DotPattern pattern = make_dot_pattern(24, 24);
  EXPECT_EQ(pattern.margin, DotPatternMargin::any_misread);
  EXPECT_EQ(unnoticed_misreadings(pattern, kDotSymbols - 1), 0);
}

TEST(DotPattern, OneDotMisreadByOneSizeIsNoticedOnSheetsUpTo34x34) {
  const DotPattern pattern = make_dot_pattern(34, 34);
  EXPECT_EQ(pattern.margin, DotPatternMargin::step_misread);
  EXPECT_EQ(unnoticed_misreadings(pattern, 1), 0);
}

TEST(DotPattern, IsTheSameEveryTime) {
  EXPECT_EQ(make_dot_pattern(12, 9).symbols, make_dot_pattern(12, 9).symbols);
  // What sheets that are printed already carry.
  const DotPattern pattern = make_dot_pattern(17, 17);
  std::uint64_t sum = 0;
  for (const std::uint8_t symbol : pattern.symbols) sum = 31 * sum + symbol;
  EXPECT_EQ(sum, 7404233929376244103U);
}

TEST(DotPattern, ReadsSizesByRatio) {
  for (int symbol = 0; symbol < kDotSymbols; ++symbol) {
    EXPECT_EQ(nearest_dot_symbol(1.1 * dot_radius_over_spacing(symbol)), symbol);
    EXPECT_EQ(nearest_dot_symbol(dot_radius_over_spacing(symbol) / 1.1), symbol);
  }
  EXPECT_EQ(nearest_dot_symbol(0.05), -1);
  EXPECT_EQ(nearest_dot_symbol(0.45), -1);
}

TEST(DotPattern, RefusesSheetsThatAreTooSmallOrTooLarge) {
  EXPECT_THROW(make_dot_pattern(2, 9), InputError);
  EXPECT_THROW(make_dot_pattern(9, 65), InputError);
}

}  // namespace
}  // namespace clothfit
