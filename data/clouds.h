#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <map>

namespace clothfit {

/// Measured points of the surface by frame, 3 x n, m.
using PointClouds = std::map<int, Eigen::Matrix3Xd>;

/// Reads the clouds of a folder: one table x, y, z per frame, named by its number, such as
/// 000012.csv or 000012.csv.gz. Throws InputError also for other tables and for one without points.
PointClouds read_point_clouds(const std::filesystem::path& folder);

}  // namespace clothfit
