#include "apps/terminal/text_table.h"

#include <algorithm>
#include <cassert>

#include "apps/terminal/number_text.h"

namespace clothfit {
namespace {

/// Counts characters, not bytes: continuation bytes of UTF-8 take no room.
size_t width_of(const std::string& cell) {
  return static_cast<size_t>(std::count_if(cell.begin(), cell.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U;
  }));
}

}  // namespace

std::string text_table(const Table& table) {
  const size_t columns = table.header.size();
  std::vector<size_t> width(columns);
  std::vector<bool> right(columns, true);
  for (size_t c = 0; c < columns; ++c) width[c] = width_of(table.header[c]);
  for (const std::vector<std::string>& row : table.rows) {
    assert(row.size() == columns);
    for (size_t c = 0; c < columns; ++c) {
      width[c] = std::max(width[c], width_of(row[c]));
      right[c] = right[c] && shows_number(row[c]);
    }
  }

  std::string text;
  const auto add_row = [&](const std::vector<std::string>& row) {
    std::string line;
    for (size_t c = 0; c < columns; ++c) {
      const std::string blanks(width[c] - width_of(row[c]), ' ');
      line += c == 0 ? "" : "  ";
      line += right[c] ? blanks + row[c] : row[c] + blanks;
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  };
  add_row(table.header);
  std::vector<std::string> rule;
  for (size_t c = 0; c < columns; ++c) rule.emplace_back(width[c], '-');
  add_row(rule);
  for (const std::vector<std::string>& row : table.rows) add_row(row);
  return text;
}

}  // namespace clothfit
