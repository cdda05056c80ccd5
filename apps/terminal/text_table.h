#pragma once

#include <string>

#include "apps/terminal/table.h"

namespace clothfit {

/// Writes a table for the terminal: columns two blanks apart, the header underlined, no trailing
/// blanks. Columns whose cells are all numbers (or empty, or "-") stand right, the others left.
std::string text_table(const Table& table);

}  // namespace clothfit
