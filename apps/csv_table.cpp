#include "apps/csv_table.h"

#include <fstream>

#include "data/input_error.h"

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
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (i > 0) text += ',';
    text += csv_cell(cells[i]);
  }
  text += '\n';
}

}  // namespace

void write_csv_table(const std::vector<std::string>& header,
                     const std::vector<std::vector<std::string>>& rows,
                     const std::filesystem::path& file) {
  std::string text;
  add_line(header, text);
  for (const std::vector<std::string>& row : rows) add_line(row, text);
  write_text_file(text, file);
}

void write_text_file(const std::string& text, const std::filesystem::path& file) {
  std::ofstream out(file, std::ios::binary);
  out << text;
  out.close();
  if (!out) {
    throw InputError(file.string(), "cannot be written", "a place with room to write results",
                     "choose another folder with --out");
  }
}

}  // namespace clothfit
