#include "apps/terminal/csv_table.h"

#include "data/text_file.h"

namespace clothfit {
namespace {

std::string csv_cell(const std::string& cell) {
  if (cell.find_first_of(",\"\r\n") == std::string::npos) return cell;
  std::string quoted = "\"";
  for (const char c : cell) {
    if (c == '"') quoted += '"';
    quoted += c;
  }
  return quoted + '"';
}

void add_line(const std::vector<std::string>& cells, std::string& text) {
  for (size_t i = 0; i < cells.size(); ++i) {
    if (i > 0) text += ',';
    text += csv_cell(cells[i]);
  }
  text += '\n';
}

}  // namespace

void write_csv_table(const Table& table, const std::filesystem::path& file) {
  std::string text;
  add_line(table.header, text);
  for (const std::vector<std::string>& row : table.rows) add_line(row, text);
  write_text(text, file);
}

}  // namespace clothfit
