#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "apps/study/recordings/study_row.h"

namespace clothfit {

/// Writes a row as study.json and a study's journal have it; a number that is not one is null.
nlohmann::ordered_json to_json(const StudyRow& row);

/// Write all digits and words of some rows as one line, and read them back.
std::string rows_to_text(const std::vector<StudyRow>& rows);
std::vector<StudyRow> rows_from_text(const std::string& text);

}  // namespace clothfit
