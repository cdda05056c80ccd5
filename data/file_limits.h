#pragma once

#include <cstddef>
#include <cstdint>

/// What files may hold, as docs/formats.md lists it. A file beyond is refused before it can fill
/// the memory. Raising a limit costs memory: the factor stands beside it.
namespace clothfit {

/// Recordings, models and cameras in YAML. Their parser takes about 400 times as many bytes at
/// worst.
inline constexpr std::uintmax_t kMostYamlBytes = 1'000'000;
/// Results in JSON; 16 times as many bytes at worst.
inline constexpr std::uintmax_t kMostJsonBytes = 20'000'000;
/// Triangles and vertices of a surface in OBJ; 12 and 24 bytes each.
inline constexpr size_t kMostObjElements = 4'000'000;
/// Drawings of patterns in SVG and DXF; 20 times as many bytes at worst. Each panel reads its own.
inline constexpr std::uintmax_t kMostDrawingBytes = 10'000'000;
/// Edges of one outline in a drawing, of which each is held against every other.
inline constexpr size_t kMostDrawnEdges = 2000;
/// Checkpoints, journals and other text that is kept as a whole; as many bytes.
inline constexpr std::uintmax_t kMostTextBytes = 256'000'000;
/// Rows of a table, which may be longer than the memory; 129 x 129 markers in 2,000 frames have 33
/// million. A row takes 40 to 80 bytes.
inline constexpr int kMostTableRows = 50'000'000;
/// One line of a table or an OBJ.
inline constexpr size_t kMostLineBytes = 65'536;
/// Unpacked bytes for each packed one, once a file unpacks to more than kAlwaysUnpackedBytes.
/// Tables of measurements reach 3 to 20; deflate can reach 1,030.
inline constexpr std::uintmax_t kMostUnpackedPerPacked = 200;
inline constexpr std::uintmax_t kAlwaysUnpackedBytes = 16'000'000;

}  // namespace clothfit
