#pragma once

#include <string>
#include <vector>

#include "apps/report/fit/fit_tables.h"
#include "apps/study/recordings/recordings_study.h"

namespace clothfit {

/// Lists all digits, in the rows' units (CSV).
Table study_table(const std::vector<StudyRow>& rows);

/// Lists the same for people, metres as millimetres. Columns without any number are left out.
Table short_study_table(const std::vector<StudyRow>& rows);

/// Lists per model and unit: recordings fitted, medians over them, and how many beat the rigid
/// guess.
Table study_summary(const std::vector<StudyRow>& rows);

/// Counts, per model, recordings whose weighted error is below others. These are the error of a
/// rigid motion, the published one, and the lower of both. The target of half of the recordings
/// with a weighted error stands beside. There are no rows without such recordings.
Table study_contest(const std::vector<StudyRow>& rows);

/// Writes the page: summary, table, reasons of failed fits, the command to do it again.
std::string study_page_html(const std::vector<StudyRow>& rows, const std::string& command);

}  // namespace clothfit
