#pragma once

#include <string>
#include <vector>

namespace clothfit {

/// Writes a table for the terminal: columns two blanks apart, the header underlined, no trailing
/// blanks. Columns whose cells are all numbers (or empty, or "-") stand right, the others left.
std::string text_table(const std::vector<std::string>& header,
                       const std::vector<std::vector<std::string>>& rows);

}  // namespace clothfit
