#pragma once

#include <string>

namespace clothfit {

// Limits of memory. What is larger is refused before it begins.

/// Bytes that the arrays of one job may take, by estimate: positions of every frame, derivatives,
/// observations.
inline constexpr double kMostBytes = 4e9;
/// Held points of a cloth; an edge counts as one at each of its vertices. Each moves with all
/// others where they touch the same cells, so that memory grows with the square of their number and
/// the time to make them ready with its cube.
inline constexpr int kMostHeldPoints = 1024;

/// Throws InputError at `where` for what would take more than kMostBytes.
void require_memory(double bytes, const std::string& where, const std::string& what,
                    const std::string& remedy);

}  // namespace clothfit
