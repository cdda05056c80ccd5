#pragma once

#include <string>
#include <vector>

#include "apps/study/foreign/foreign_row.h"
#include "apps/terminal/table.h"

namespace clothfit {

/// Lists every recording with all digits, in the rows' units (CSV).
Table foreign_table(const std::vector<ForeignRow>& rows);

/// Lists the same for people. The last column says what is wrong, or why there is no diagnosis.
Table short_foreign_table(const std::vector<ForeignRow>& rows);

/// Counts right diagnoses by the kind of truth, and lists what they missed and named for nothing. A
/// recording without a diagnosis is not right.
Table foreign_summary(const std::vector<ForeignRow>& rows);

/// Writes "Longest: swing_ball, 94.1 s".
std::string longest_text(const std::vector<ForeignRow>& rows);

/// Writes the page: summary, table, the command to do it again.
std::string foreign_page_html(const std::vector<ForeignRow>& rows, const std::string& command);

}  // namespace clothfit
