#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "vision/detect/dot_pattern.h"
#include "vision/track/dot_identity.h"

namespace clothfit {

/// Names found dots by the printed pattern, without any tag. Dots are linked to their neighbours on
/// a lattice by the outline's own metric, in which the nearest are those along rows and columns.
/// Every full 3 x 3 neighbourhood is looked up, and all must agree on where, how turned and whether
/// mirrored the lattice lies. Returns false, and places nothing, where fewer than 3 are found or
/// less than nine in ten agree. `layout` is a full grid.
bool name_by_pattern(const DotLayout& layout, const DotPattern& pattern,
                     const DotPatternIndex& index, const std::vector<Dot>& found,
                     PlacedDots& placed);

/// Dots of a picture that lie on a square lattice, in some turn.
struct SeenLattice {
  int columns = 0, rows = 0;             ///< that its dots reach over
  std::vector<std::optional<Dot>> dots;  ///< row by row; nothing where none is seen
  std::vector<int> symbols;              ///< sizes, as a pattern has them; -1 where not read
  int count = 0;                         ///< of dots
};

/// Returns the largest lattice that some of the found dots make; nothing where none do.
std::optional<SeenLattice> find_lattice(const std::vector<Dot>& found);

/// Returns where each site of a lattice lies in a pattern, row and column; nothing where
/// `name_by_pattern` would find too few neighbourhoods or too much contradiction.
std::optional<std::vector<std::pair<int, int>>> places_in_pattern(const SeenLattice& lattice,
                                                                  const DotPatternIndex& index);

}  // namespace clothfit
