#pragma once

#include <vector>

#include "apps/study/louchet1995/paper_problem.h"

namespace clothfit {

/// What the founding paper says neither in words nor in numbers of its experiment: a choice among
/// readings, and in each four numbers.
struct SettingReading {
  StrainLimitMode limit = StrainLimitMode::positions;
  PaperRelease release = PaperRelease::level;
};
/// All readings that are searched.
std::vector<SettingReading> setting_readings();

struct ScannedSetting {
  PaperExperiment experiment;
  PaperCost cost = PaperCost::full;
  ListingMatch match;
  bool searched = false;  ///< CMA-ES found it; else it is of the grid
};

/// A setting that came near, over all transitions, and what it makes of the paper's words on how
/// far the printed individuals move from the original: "about one twentieth of the springs' natural
/// length" and "slightly less than half".
struct NearSetting {
  ScannedSetting setting;
  double good_off_m = 0, bad_off_m = 0;
};

/// A motion in which springs stretch to more than so many times their limit is not the paper's,
/// which says of its procedure that springs do not exceed it.
inline constexpr double kMostOvershoot = 3;

/// Distance to the printed costs; infinite where the motion is not the paper's.
double rank(const ScannedSetting& setting);

/// The settings of one reading that come nearest to the printed listing.
struct SettingSearch {
  /// A grid of masses, steps, durations and dampings, both costs; the full cost over some of its
  /// transitions, for speed.
  std::vector<ScannedSetting> grid;
  /// Of each cost the grid's best three and what CMA-ES makes of the best, nearest first.
  std::vector<NearSetting> nearest;
};
SettingSearch search_setting(const SettingReading& reading, bool quick);

}  // namespace clothfit
