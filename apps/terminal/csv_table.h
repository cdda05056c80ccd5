#pragma once

#include <filesystem>

#include "apps/terminal/table.h"

namespace clothfit {

/// Writes a result table: a header line, then the rows. Cells with a comma, quote or line break are
/// quoted as in RFC 4180. Throws InputError where the file cannot be written.
void write_csv_table(const Table& table, const std::filesystem::path& file);

}  // namespace clothfit
