#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "data/markers.h"

namespace clothfit {

/// The weights of markers in an error, by name. A marker that is not named counts nothing.
using MarkerWeights = std::map<std::string, double>;

/// Reads a table with the columns marker, weight (>= 0, not all 0). Throws InputError.
MarkerWeights read_marker_weights(const std::filesystem::path& file);

/// Returns one weight per marker of the set, in its order. Throws InputError where the set lacks a
/// marker that is named: the weights were meant for another one.
std::vector<double> weights_of(const MarkerSet& markers, const MarkerWeights& weights);

}  // namespace clothfit
