#pragma once

#include <string>
#include <vector>

#include "apps/report/fit/fit_tables.h"
#include "apps/study/louchet1995/study.h"

namespace clothfit {

/// A table of the study of the founding paper: with all digits for its CSV file, short for people.
struct StudyTable {
  std::string file;  ///< "scan.csv"
  Table table;
};

/// Returns every table and the numbers behind every figure; nothing measured by a clock.
std::vector<StudyTable> louchet1995_files(const Louchet1995Study& study);
/// Returns the time of the recoveries here: seed, parameters, seconds; without resumed ones.
StudyTable louchet1995_timing(const Louchet1995Study& study);

Table nearest_settings_table(const Louchet1995Study& study);
Table landscape_table(const Louchet1995Study& study);
/// Lists ten individuals beside the printed ones; `bad` for the bad situation.
Table listing_table(const Louchet1995Study& study, bool bad);
Table success_table(const Louchet1995Study& study);
Table eighteen_table(const Louchet1995Study& study);
/// Lists generations (and computed costs) until a relative cost is reached: median and quartiles.
Table race_table(const Louchet1995Study& study);
Table place_table(const Louchet1995Study& study);
Table reconstruction_table(const Louchet1995Study& study);
/// Lists targets, the measured values, and whether they met them. Cells that a clock measured are
/// marked by "measured: ".
Table target_table(const Louchet1995Study& study);

/// Counts recoveries of all five parameters within `share`; of the 18 (where determined).
int recovered_five(const Louchet1995Study& study, double share);
int recovered_eighteen(const Louchet1995Study& study, double share);
/// Returns the longest of the trials that were timed; negative when none was.
double longest_seconds(const RecoveryTrials& trials);

/// Returns a quantile of values, infinite ones among them, by the nearest rank.
double quantile(std::vector<double> values, double share);

std::string to_string(StrainLimitMode limit, PaperRelease release);

}  // namespace clothfit
