#pragma once

#include <string>

#include "apps/study/louchet1995/landscape.h"
#include "apps/study/louchet1995/race.h"
#include "apps/study/louchet1995/recovery.h"
#include "apps/study/louchet1995/setting.h"

namespace clothfit {

// The journal keeps finished pieces of the study as JSON. Numbers have all their digits, infinite
// ones are null. Anything that the reader knows anyway is not written.

std::string to_payload(const SettingSearch& search);
std::string to_payload(const CostLandscape& landscape);
std::string to_payload(const Recovery& recovery);
std::string to_payload(const Race& race);

SettingSearch setting_search_of(const std::string& payload);
CostLandscape landscape_of(const std::string& payload);
Recovery recovery_of(const std::string& payload);
Race race_of(const std::string& payload);

}  // namespace clothfit
