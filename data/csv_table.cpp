#include "data/csv_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>

#include "data/input_error.h"
#include "data/nearest_name.h"
#include "data/number_text.h"
#include "data/shown_text.h"
#include "data/text_file.h"

namespace clothfit {
namespace {

std::string_view trimmed(std::string_view text) {
  const size_t first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

/// Appends the fields of a line and returns their number.
size_t split(std::string_view line, std::vector<std::string_view>& fields) {
  size_t count = 0;
  for (size_t begin = 0;; ++count) {
    const size_t comma = line.find(',', begin);
    fields.push_back(trimmed(line.substr(begin, comma - begin)));
    if (comma == std::string_view::npos) return count + 1;
    begin = comma + 1;
  }
}

std::string shown(std::string_view field) {
  return fmt::format("`{}`", shown_text(field));
}

std::string column_list(const std::vector<CsvColumn>& columns) {
  std::string list;
  for (const CsvColumn& column : columns) {
    if (!list.empty()) list += ",";
    list += column.required ? column.name : "[" + column.name + "]";
  }
  return list;
}

}  // namespace

CsvTable::CsvTable(const std::filesystem::path& file, std::vector<CsvColumn> columns)
    : file_(file.string()), content_(read_text(file)), columns_(std::move(columns)) {
  const auto expected_header = [this] { return "the columns " + column_list(columns_); };
  std::vector<std::string_view> header;
  std::string_view rest = content_;
  for (int line = 1; !rest.empty(); ++line) {
    const size_t end = rest.find('\n');
    const std::string_view text = trimmed(rest.substr(0, end));
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
    if (text.empty() || text.front() == '#') continue;

    if (header.empty()) {
      width_ = split(text, header);
      place_.assign(columns_.size(), -1);
      for (size_t field = 0; field < width_; ++field) {
        const auto column = std::find_if(columns_.begin(), columns_.end(), [&](const CsvColumn& c) {
          return c.name == header[field];
        });
        if (column == columns_.end()) {
          std::vector<std::string> names;
          for (const CsvColumn& c : columns_) names.push_back(c.name);
          throw InputError(file_, line, "unknown column " + shown(header[field]),
                           known_names(std::string(header[field]), names));
        }
        int& place = place_[static_cast<size_t>(column - columns_.begin())];
        if (place >= 0)
          throw InputError(file_, line, "column " + shown(header[field]) + " appears twice",
                           "every column once", "remove one of them");
        place = static_cast<int>(field);
      }
      for (size_t column = 0; column < columns_.size(); ++column) {
        if (place_[column] < 0 && columns_[column].required)
          throw InputError(file_, line, "column " + shown(columns_[column].name) + " is missing",
                           expected_header(), "name the columns in the first line");
      }
      continue;
    }

    const size_t count = split(text, fields_);
    if (count != width_) {
      throw InputError(file_, line, std::to_string(count) + (count == 1 ? " field" : " fields"),
                       std::to_string(width_) + " fields, as the first line has columns",
                       "give every column a field; numbers have a decimal point and no comma");
    }
    line_.push_back(line);
  }
  if (header.empty())
    throw InputError(file_, 1, "the table is empty", expected_header(),
                     "name the columns in the first line");
}

std::string_view CsvTable::text(int row, int column) const {
  assert(row >= 0 && row < rows());
  const int place = place_[static_cast<size_t>(column)];
  if (place < 0) return {};
  return fields_[static_cast<size_t>(row) * width_ + static_cast<size_t>(place)];
}

double CsvTable::number(int row, int column) const {
  const std::string_view field = text(row, column);
  const std::optional<double> value = parse_number(field);
  if (!value)
    refuse(row, columns_[static_cast<size_t>(column)].name + " = " + shown(field),
           "a finite number", "leave out the row of what was not observed");
  return *value;
}

double CsvTable::rising_number(int row, int column) const {
  const double value = number(row, column);
  if (row > 0 && value <= number(row - 1, column))
    refuse(row,
           columns_[static_cast<size_t>(column)].name + " = " + shown(text(row, column)) +
               " after " + shown(text(row - 1, column)),
           "numbers that rise from row to row", "sort the rows and remove repeated ones");
  return value;
}

int CsvTable::whole_number(int row, int column, int least) const {
  const std::string_view field = text(row, column);
  const std::optional<int> value = parse_whole_number(field);
  if (!value || *value < least)
    refuse(row, columns_[static_cast<size_t>(column)].name + " = " + shown(field),
           "a whole number, " + std::to_string(least) + " or more");
  return *value;
}

std::string CsvTable::name(int row, int column) const {
  const std::string_view field = text(row, column);
  const bool printable = std::none_of(field.begin(), field.end(), [](char c) {
    return static_cast<unsigned char>(c) < ' ' || c == 127;
  });
  if (field.empty() || field.front() == '#' || !printable) {
    refuse(row, columns_[static_cast<size_t>(column)].name + " = " + shown(field),
           "a name of printable characters without a comma, the first of them no `#`");
  }
  return std::string(field);
}

void CsvTable::refuse(int row, const std::string& problem, const std::string& expected,
                      const std::string& remedy) const {
  throw InputError(file_, line(row), problem, expected, remedy);
}

void CsvTable::require_rows(const std::string& what) const {
  if (rows() == 0) throw InputError(file_, "the table holds no " + what, "one row or more");
}

}  // namespace clothfit
