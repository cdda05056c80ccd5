#pragma once

#include <vector>

#include "apps/study/louchet1995/paper_problem.h"

namespace clothfit {

/// A choice among readings of the paper where it states neither words nor numbers of its
/// experiment. Each leaves four numbers open.
struct SettingReading {
  StrainLimitMode limit = StrainLimitMode::positions;
  PaperRelease release = PaperRelease::level;
};
/// Returns all readings that are searched.
std::vector<SettingReading> setting_readings();

struct ScannedSetting {
  PaperExperiment experiment;
  PaperCost cost = PaperCost::full;
  ListingMatch match;
  bool searched = false;  ///< CMA-ES found it; else it is from the grid
};

/// A setting that came near, over all transitions. It is compared with the paper's words on how far
/// the printed individuals move from the original: "about one twentieth of the springs' natural
/// length" and "slightly less than half".
struct NearSetting {
  ScannedSetting setting;
  double good_off_m = 0, bad_off_m = 0;
};

/// A motion in which springs stretch to more than so many times their limit is not the paper's. The
/// paper says of its procedure that springs do not exceed it.
inline constexpr double kMostOvershoot = 3;

/// Returns the distance to the printed costs; infinite where the motion is not the paper's.
double rank(const ScannedSetting& setting);

/// The settings of one reading that come nearest to the printed listing.
struct SettingSearch {
  /// A grid of masses, steps, durations and dampings, both costs. For speed, the full cost is over
  /// some of its transitions.
  std::vector<ScannedSetting> grid;
  /// The grid's best three for each cost and CMA-ES's result from the best, nearest first.
  std::vector<NearSetting> nearest;
};
SettingSearch search_setting(const SettingReading& reading, bool quick);

}  // namespace clothfit
