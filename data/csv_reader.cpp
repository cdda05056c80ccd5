#include "data/csv_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "data/input_error.h"
#include "data/nearest_name.h"
#include "data/number_limits.h"
#include "data/number_text.h"
#include "data/shown_text.h"

namespace clothfit {
namespace {

std::string_view trimmed(std::string_view text) {
  const size_t first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

void split(std::string_view line, std::vector<std::string_view>& fields) {
  fields.clear();
  for (size_t begin = 0;;) {
    const size_t comma = line.find(',', begin);
    fields.push_back(trimmed(line.substr(begin, comma - begin)));
    if (comma == std::string_view::npos) return;
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

/// Says whether a spreadsheet would compute a cell instead of showing it.
/// One that is shown, behind an apostrophe, counts as well.
bool is_formula(std::string_view field) {
  field.remove_prefix(std::min(field.find_first_not_of('\''), field.size()));
  return !field.empty() && std::string_view("=+-@").find(field.front()) != std::string_view::npos &&
         !parse_number(field);
}

}  // namespace

CsvReader::CsvReader(const std::filesystem::path& file, std::vector<CsvColumn> columns)
    : file_(file.string()), lines_(file), columns_(std::move(columns)) {
  std::string_view header;
  if (!next_line(header))
    throw InputError(file_, 1, "the table is empty", "the columns " + column_list(columns_),
                     "name the columns in the first line");
  read_header(header);
  before_.assign(columns_.size(), -std::numeric_limits<double>::infinity());
}

bool CsvReader::next_line(std::string_view& text) {
  while (lines_.next()) {
    text = trimmed(lines_.text());
    if (!text.empty() && text.front() != '#') return true;
  }
  return false;
}

void CsvReader::read_header(std::string_view text) {
  split(text, fields_);
  width_ = fields_.size();
  place_.assign(columns_.size(), -1);
  for (size_t field = 0; field < width_; ++field) {
    const auto column = std::ranges::find(columns_, fields_[field], &CsvColumn::name);
    if (column == columns_.end()) {
      std::vector<std::string> names;
      for (const CsvColumn& c : columns_) names.push_back(c.name);
      refuse("unknown column " + shown(fields_[field]),
             known_names(std::string(fields_[field]), names));
    }
    int& place = place_[static_cast<size_t>(column - columns_.begin())];
    if (place >= 0)
      refuse("column " + shown(fields_[field]) + " appears twice", "every column once",
             "remove one of them");
    place = static_cast<int>(field);
  }
  for (size_t column = 0; column < columns_.size(); ++column)
    if (place_[column] < 0 && columns_[column].required)
      refuse("column " + shown(columns_[column].name) + " is missing",
             "the columns " + column_list(columns_), "name the columns in the first line");
}

bool CsvReader::next() {
  std::string_view line;
  if (!next_line(line)) return false;
  split(line, fields_);
  if (fields_.size() != width_)
    refuse(fmt::format("{} field{}", fields_.size(), fields_.size() == 1 ? "" : "s"),
           fmt::format("{} fields, as the first line has columns", width_),
           "give every column a field; numbers have a decimal point and no comma");
  if (rows_ == kMostTableRows)
    refuse(fmt::format("more than {} rows", kMostTableRows), "a shorter table",
           "cut the recording into several");
  ++rows_;
  return true;
}

std::string_view CsvReader::text(int column) const {
  const int place = place_[static_cast<size_t>(column)];
  return place < 0 ? std::string_view() : fields_[static_cast<size_t>(place)];
}

double CsvReader::number(int column) const {
  const std::optional<double> value = parse_number(text(column));
  if (!value)
    refuse(column_name(column) + " = " + shown(text(column)), "a finite number",
           "leave out the row of what was not observed");
  return *value;
}

double CsvReader::number_within(int column, double most, const std::string& unit) const {
  const double value = number(column);
  if (std::abs(value) > most)
    refuse(column_name(column) + " = " + shown(text(column)),
           fmt::format("{}, {:g} to {:g}", unit, -most, most), "correct the number or its unit");
  return value;
}

double CsvReader::rising_time(int column) {
  const double value = number_within(column, kLatest_s, "seconds");
  double& before = before_[static_cast<size_t>(column)];
  if (value <= before)
    refuse(fmt::format("{} = {} after `{}`", column_name(column), shown(text(column)),
                       number_text(before)),
           "times that rise from row to row", "sort the rows and remove repeated ones");
  before = value;
  return value;
}

int CsvReader::whole_number(int column, int least) const {
  const std::optional<int> value = parse_whole_number(text(column));
  if (!value || *value < least)
    refuse(column_name(column) + " = " + shown(text(column)),
           fmt::format("a whole number, {} or more", least));
  return *value;
}

std::string CsvReader::name(int column) const {
  std::string_view field = text(column);
  if (field.empty() || field.front() == '#' || !is_printable(field))
    refuse(column_name(column) + " = " + shown(field),
           "a name of printable characters without a comma, the first of them no `#`");
  if (field.starts_with('\'') && is_formula(field.substr(1))) field.remove_prefix(1);
  return std::string(field);
}

void CsvReader::refuse(const std::string& problem, const std::string& expected,
                       const std::string& remedy) const {
  refuse_line(line(), problem, expected, remedy);
}

void CsvReader::refuse_line(int line, const std::string& problem, const std::string& expected,
                            const std::string& remedy) const {
  throw InputError(file_, line, problem, expected, remedy);
}

void CsvReader::require_rows(const std::string& what) const {
  if (rows_ == 0) throw InputError(file_, "the table holds no " + what, "one row or more");
}

std::string csv_name(std::string_view name) {
  return (is_formula(name) ? "'" : "") + std::string(name);
}

}  // namespace clothfit
