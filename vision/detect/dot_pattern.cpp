#include "vision/detect/dot_pattern.h"

#include <fmt/core.h>

#include <cmath>
#include <cstdlib>
#include <optional>
#include <random>

#include "data/input_error.h"

namespace clothfit {
namespace {

constexpr double kSmallestRadius = 0.13;  // of the spacing; the largest leaves half of it as paper
const double kRadiusStep = std::cbrt(2.0);

constexpr int kTurns = 8;  // four, and four mirrored

/// Writes a neighbourhood as a number to the base kDotSymbols.
int code_of(const DotNeighbourhood& symbols) {
  int code = 0;
  for (const int symbol : symbols) code = code * kDotSymbols + symbol;
  return code;
}

DotNeighbourhood turned_by(const DotNeighbourhood& symbols, int turn) {
  return turned(symbols, turn % 4, turn >= 4);
}

/// Fills a pattern dot by dot, row by row, and steps back by chance where no symbol fits.
class PatternSearch {
 public:
  PatternSearch(int columns, int rows, DotPatternMargin margin)
      : columns_(columns),
        margin_(margin),
        symbols_(static_cast<std::size_t>(columns * rows)),
        left_(symbols_.size()) {
    int codes = 1;
    for (int i = 0; i < 9; ++i) codes *= kDotSymbols;
    taken_.assign(static_cast<std::size_t>(codes), false);
  }

  /// Returns nothing after `most_tries` symbols.
  std::optional<std::vector<std::uint8_t>> run(long most_tries);

 private:
  /// The neighbourhood that a dot completes, if any.
  std::optional<DotNeighbourhood> completed_by(std::size_t place) const;
  bool fits(const DotNeighbourhood& symbols) const;
  bool is_taken_nearby(const DotNeighbourhood& symbols) const;
  void take(std::size_t place, bool taken);
  void offer_all_symbols(std::size_t place);

  int columns_ = 0;
  DotPatternMargin margin_;
  std::vector<std::uint8_t> symbols_;
  std::vector<std::vector<std::uint8_t>> left_;  ///< symbols still to be tried at each dot
  std::vector<bool> taken_;                      ///< by code, all turns
  std::mt19937 random_{20250101};                ///< the same pattern every time
};

std::optional<DotNeighbourhood> PatternSearch::completed_by(std::size_t place) const {
  const int row = static_cast<int>(place) / columns_, column = static_cast<int>(place) % columns_;
  if (row < 2 || column < 2) return std::nullopt;
  DotNeighbourhood symbols{};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      symbols[static_cast<std::size_t>(3 * i + j)] =
          symbols_[static_cast<std::size_t>((row - 2 + i) * columns_ + column - 2 + j)];
  return symbols;
}

bool PatternSearch::is_taken_nearby(const DotNeighbourhood& symbols) const {
  if (taken_[static_cast<std::size_t>(code_of(symbols))]) return true;
  if (margin_ == DotPatternMargin::none) return false;
  DotNeighbourhood misread = symbols;
  for (std::size_t i = 0; i < 9; ++i) {
    for (int symbol = 0; symbol < kDotSymbols; ++symbol) {
      const int steps = std::abs(symbol - symbols[i]);
      if (steps == 0 || (margin_ == DotPatternMargin::step_misread && steps > 1)) continue;
      misread[i] = symbol;
      if (taken_[static_cast<std::size_t>(code_of(misread))]) return true;
    }
    misread[i] = symbols[i];
  }
  return false;
}

/// The neighbourhood must differ from its own turned and mirrored selves as from all others.
bool PatternSearch::fits(const DotNeighbourhood& symbols) const {
  const int least = margin_ == DotPatternMargin::none ? 1 : 2;
  for (int turn = 1; turn < kTurns; ++turn) {
    const DotNeighbourhood other = turned_by(symbols, turn);
    int different = 0;
    for (std::size_t i = 0; i < 9; ++i) different += other[i] != symbols[i] ? 1 : 0;
    if (different < least) return false;
  }
  return !is_taken_nearby(symbols);
}

void PatternSearch::take(std::size_t place, bool taken) {
  const std::optional<DotNeighbourhood> symbols = completed_by(place);
  if (!symbols) return;
  for (int turn = 0; turn < kTurns; ++turn)
    taken_[static_cast<std::size_t>(code_of(turned_by(*symbols, turn)))] = taken;
}

void PatternSearch::offer_all_symbols(std::size_t place) {
  std::vector<std::uint8_t>& left = left_[place];
  left.clear();
  for (int symbol = 0; symbol < kDotSymbols; ++symbol)
    left.push_back(static_cast<std::uint8_t>(symbol));
  for (std::size_t i = left.size() - 1; i > 0; --i) std::swap(left[i], left[random_() % (i + 1)]);
}

std::optional<std::vector<std::uint8_t>> PatternSearch::run(long most_tries) {
  std::size_t place = 0;
  offer_all_symbols(0);
  for (long tries = 0; tries < most_tries;) {
    if (left_[place].empty()) {
      const std::size_t back = 1 + random_() % static_cast<std::size_t>(2 * columns_);
      for (std::size_t i = 0; i < back && place > 0; ++i) take(--place, false);
      offer_all_symbols(place);
      continue;
    }
    ++tries;
    symbols_[place] = left_[place].back();
    left_[place].pop_back();
    const std::optional<DotNeighbourhood> symbols = completed_by(place);
    if (symbols && !fits(*symbols)) continue;
    take(place, true);
    if (++place == symbols_.size()) return symbols_;
    offer_all_symbols(place);
  }
  return std::nullopt;
}

}  // namespace

double dot_radius_over_spacing(int symbol) {
  return kSmallestRadius * std::pow(kRadiusStep, symbol);
}

int nearest_dot_symbol(double radius_over_spacing) {
  const double steps = std::log(radius_over_spacing / kSmallestRadius) / std::log(kRadiusStep);
  if (!(steps > -0.5 && steps < kDotSymbols - 0.5)) return -1;
  return static_cast<int>(std::lround(steps));
}

DotPattern make_dot_pattern(int columns, int rows) {
  if (std::min(columns, rows) < kFewestPatternDots || std::max(columns, rows) > kMostPatternDots)
    throw InputError(
        "dots", fmt::format("{} x {}", columns, rows),
        fmt::format("{} to {} dots along each side", kFewestPatternDots, kMostPatternDots));
  constexpr long kTries = 200000;  // the margins named in the header are found within a tenth
  for (const DotPatternMargin margin :
       {DotPatternMargin::any_misread, DotPatternMargin::step_misread, DotPatternMargin::none}) {
    std::optional<std::vector<std::uint8_t>> symbols =
        PatternSearch(columns, rows, margin).run(kTries);
    if (symbols)
      return {.columns = columns, .rows = rows, .margin = margin, .symbols = std::move(*symbols)};
  }
  throw InputError("dots", fmt::format("no pattern of {} x {} was found", columns, rows),
                   "another number of dots");
}

std::string dot_name(int row, int column) {
  return fmt::format("d{:02}_{:02}", row, column);
}

DotNeighbourhood turned(const DotNeighbourhood& symbols, int quarter_turns, bool mirrored) {
  DotNeighbourhood result = symbols;
  if (mirrored)
    for (std::size_t row = 0; row < 9; row += 3) std::swap(result[row], result[row + 2]);
  for (int turn = 0; turn < quarter_turns; ++turn) {
    const DotNeighbourhood before = result;
    for (std::size_t row = 0; row < 3; ++row)
      for (std::size_t column = 0; column < 3; ++column)
        result[3 * column + 2 - row] = before[3 * row + column];
  }
  return result;
}

DotPatternIndex::DotPatternIndex(const DotPattern& pattern) {
  for (int row = 1; row + 1 < pattern.rows; ++row)
    for (int column = 1; column + 1 < pattern.columns; ++column) {
      DotNeighbourhood symbols{};
      for (int i = 0; i < 9; ++i)
        symbols[static_cast<std::size_t>(i)] = pattern.symbol(row - 1 + i / 3, column - 1 + i % 3);
      place_by_code_.emplace(code_of(symbols), std::pair(row, column));
    }
}

std::optional<DotPatternPlace> DotPatternIndex::find(const DotNeighbourhood& symbols) const {
  for (const int symbol : symbols)
    if (symbol < 0 || symbol >= kDotSymbols) return std::nullopt;
  for (int turn = 0; turn < kTurns; ++turn) {
    const auto found = place_by_code_.find(code_of(turned_by(symbols, turn)));
    if (found != place_by_code_.end())
      return DotPatternPlace{.row = found->second.first,
                             .column = found->second.second,
                             .quarter_turns = turn % 4,
                             .mirrored = turn >= 4};
  }
  return std::nullopt;
}

}  // namespace clothfit
