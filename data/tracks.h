#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "data/markers.h"

namespace clothfit {

/// One measured 3D position of a marker.
struct Position3d {
  int frame = 0;
  int marker = 0;  ///< index into MarkerSet::markers
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  double sigma_m = 0;  ///< one standard deviation per coordinate; 0 when the file does not say
};

/// One measured pixel position of a marker.
struct Position2d {
  int frame = 0;
  int marker = 0;  ///< index into MarkerSet::markers
  Eigen::Vector2d position_px = Eigen::Vector2d::Zero();
  double sigma_px = 0;   ///< one standard deviation per coordinate; 0 when the file does not say
  std::string rejected;  ///< empty when good, otherwise the reason; rejected rows are never fitted
};

using Tracks3d = std::vector<Position3d>;  ///< sorted by frame, then marker
using Tracks2d = std::vector<Position2d>;  ///< sorted by frame, then marker

/// Reads measured tracks (CSV, gzip-compressed when the name ends in .gz). Refuses what the format
/// does not allow: unknown or missing columns, unknown markers, duplicate rows, numbers that are
/// not finite, negative sigma or frame, a frame thousands after the one before. Throws InputError
/// with file and line.
Tracks3d read_tracks3d(const std::filesystem::path& file, const MarkerSet& markers);
Tracks2d read_tracks2d(const std::filesystem::path& file, const MarkerSet& markers);

void write_tracks3d(const Tracks3d& tracks, const MarkerSet& markers,
                    const std::filesystem::path& file);
void write_tracks2d(const Tracks2d& tracks, const MarkerSet& markers,
                    const std::filesystem::path& file);

}  // namespace clothfit
