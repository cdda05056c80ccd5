#pragma once

#include <string>

#include "apps/study/louchet1995/landscape.h"
#include "apps/study/louchet1995/race.h"
#include "apps/study/louchet1995/recovery.h"
#include "apps/study/louchet1995/setting.h"

namespace clothfit {

// The journal keeps finished pieces of the study as JSON. Numbers have all their digits, infinite
// ones are null. Anything that the reader knows anyway is not written. Readers throw a
// std::exception where a payload is no such JSON or cannot be of the piece.

std::string to_payload(const SettingSearch& search);
std::string to_payload(const CostLandscape& landscape);
std::string to_payload(const Recovery& recovery);
std::string to_payload(const Race& race);

SettingSearch setting_search_of(const std::string& payload);
CostLandscape landscape_of(const std::string& payload);
/// `parameters` is the number of values of an individual.
Recovery recovery_of(const std::string& payload, Eigen::Index parameters);
Race race_of(const std::string& payload);

}  // namespace clothfit
