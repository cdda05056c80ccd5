#pragma once

#include <string>
#include <vector>

#include "apps/report/fit/fit_tables.h"
#include "apps/study/recordings/recordings_study.h"

namespace clothfit {

/// All digits, in the rows' units (CSV).
Table study_table(const std::vector<StudyRow>& rows);

/// The same for people, metres as millimetres. Columns that no row has a number for are left out.
Table short_study_table(const std::vector<StudyRow>& rows);

/// Per model and unit: recordings fitted, medians over them, and how many beat the rigid guess.
Table study_summary(const std::vector<StudyRow>& rows);

/// Per model: of the recordings with a weighted error, in how many it is below that of what moves
/// rigidly, below the published one, and below the lower of both, beside the target of half of
/// them. No rows without such recordings.
Table study_contest(const std::vector<StudyRow>& rows);

/// The page: summary, table, reasons of what could not be fitted, how to do it again.
std::string study_page_html(const std::vector<StudyRow>& rows, const std::string& command);

}  // namespace clothfit
