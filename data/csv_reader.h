#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "data/text_file.h"

namespace clothfit {

struct CsvColumn {
  std::string name;
  bool required = true;
};

/// Reads a comma-separated table row by row; the file may be larger than the memory. Columns are
/// found by the names of the first line and come in any order. `#` comment lines and empty lines
/// are skipped, blanks around a field are dropped. There is no quoting (names hold no comma). Every
/// refusal is an InputError that names the file and the line:
///
///   CsvReader table(file, {{"time"}, {"x"}});
///   while (table.next()) add(table.number(0), table.number(1));
class CsvReader {
 public:
  /// Reads the first line. Refuses unknown, missing and doubled columns.
  CsvReader(const std::filesystem::path& file, std::vector<CsvColumn> columns);
  CsvReader(const CsvReader&) = delete;
  CsvReader& operator=(const CsvReader&) = delete;

  /// Goes to the next row; false at the end. Refuses another number of fields than columns, and
  /// more than kMostTableRows.
  bool next();
  /// Returns how many rows were read, the present one among them.
  int rows() const { return rows_; }
  /// Returns the line of the present row.
  int line() const { return lines_.line(); }

  /// Returns a field of the present row; `column` counts in the constructor's list. Empty where the
  /// file lacks an optional column.
  std::string_view text(int column) const;
  bool empty(int column) const { return text(column).empty(); }
  /// Returns a finite number.
  double number(int column) const;
  /// Returns a number from `-most` to `most`; `unit` names what it is. The bound catches slips in
  /// an exponent.
  double number_within(int column, double most, const std::string& unit) const;
  /// Returns N such numbers, of `first` and the columns after it.
  template <int N>
  Eigen::Matrix<double, N, 1> vector_within(int first, double most, const std::string& unit) const {
    Eigen::Matrix<double, N, 1> vector;
    for (int k = 0; k < N; ++k) vector[k] = number_within(first + k, most, unit);
    return vector;
  }
  /// Returns a time in seconds after that of the row before, which was asked for as well.
  double rising_time(int column);
  /// Returns a whole number, `least` or more.
  int whole_number(int column, int least) const;
  /// Returns a name: printable, not empty, no `#` in front, which would read as a comment. The
  /// apostrophe that `csv_name` puts in front of a formula is taken off.
  std::string name(int column) const;

  /// Refuses the present row, or another line.
  [[noreturn]] void refuse(const std::string& problem, const std::string& expected,
                           const std::string& remedy = "") const;
  [[noreturn]] void refuse_line(int line, const std::string& problem, const std::string& expected,
                                const std::string& remedy = "") const;
  /// Refuses a table that ended without a row; `what` in the plural.
  void require_rows(const std::string& what) const;

 private:
  void read_header(std::string_view text);
  /// Goes to the next line that is no comment and not empty; false at the end.
  bool next_line(std::string_view& text);
  const std::string& column_name(int column) const {
    return columns_[static_cast<size_t>(column)].name;
  }

  std::string file_;
  TextLines lines_;
  std::vector<CsvColumn> columns_;
  std::vector<int> place_;                ///< column -> field of a line; -1 when the file lacks it
  std::vector<std::string_view> fields_;  ///< of the present row
  std::vector<double> before_;            ///< of each rising column, in the row before
  size_t width_ = 0;                      ///< fields per line
  int rows_ = 0;
};

/// Returns a name as a field of a table. One that a spreadsheet would take for a formula, since it
/// begins with `=`, `+`, `-` or `@` and is no number, gets an apostrophe in front.
std::string csv_name(std::string_view name);

}  // namespace clothfit
