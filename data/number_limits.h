#pragma once

/// Numbers beyond these, far from any measurement of a cloth, are slips in a unit or an exponent.
namespace clothfit {

inline constexpr double kFarthest_m = 1e6;       ///< a coordinate
inline constexpr double kFarthest_px = 1e6;      ///< a coordinate in a picture
inline constexpr double kFastest_m_per_s = 1e4;  ///< a component of a velocity
inline constexpr double kLatest_s = 1e10;        ///< a time; clocks that count from 1970 read 2e9

}  // namespace clothfit
