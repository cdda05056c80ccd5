#pragma once

#include <optional>
#include <string_view>

#include "data/drawn_outline.h"

namespace clothfit {

/// Reads text of SVG attributes: numbers that commas, spaces or nothing separate.
class SvgScanner {
 public:
  explicit SvgScanner(std::string_view text) : text_(text) {}

  /// Says whether nothing but separators follows.
  bool at_end();
  /// Returns the next character behind separators and goes on; 0 at the end.
  char letter();
  /// Says whether a number comes next.
  bool at_number();
  /// Returns the next number; nothing where none comes, and stays there.
  std::optional<double> number();
  /// Returns the next flag of an arc, one digit; nothing where none comes.
  std::optional<bool> flag();
  /// Returns what follows up to `end`, and goes behind it; all where there is no `end`.
  std::string_view up_to(char end);
  /// Returns what was not read yet.
  std::string_view rest() const { return text_; }

 private:
  void skip_separators();

  std::string_view text_;
};

/// Draws the data of an SVG path into `drawn`, which is empty, in user units and as closed. Arcs of
/// circles become arcs where `keep_circles`, otherwise curves. Throws InputError for data that are
/// none, several subpaths and an outline that is not closed.
void draw_svg_path(std::string_view data, bool keep_circles, DrawnOutline& drawn);

}  // namespace clothfit
