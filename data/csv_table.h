#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace clothfit {

struct CsvColumn {
  std::string name;
  bool required = true;
};

/// A comma-separated table whose columns are found by the names of its first line. Columns come in
/// any order, `#` comment lines and empty lines are skipped, blanks around a field are dropped.
/// There is no quoting (names hold no comma). Every refusal is an InputError that names the file
/// and the line.
class CsvTable {
 public:
  /// Reads and splits. Refuses unknown, missing and doubled columns and lines with another number
  /// of fields than the first.
  CsvTable(const std::filesystem::path& file, std::vector<CsvColumn> columns);
  CsvTable(const CsvTable&) = delete;
  CsvTable& operator=(const CsvTable&) = delete;

  int rows() const { return static_cast<int>(line_.size()); }
  int line(int row) const { return line_[static_cast<size_t>(row)]; }

  /// Returns a field; `column` counts in the constructor's list. Empty where the file lacks an
  /// optional column.
  std::string_view text(int row, int column) const;
  bool empty(int row, int column) const { return text(row, column).empty(); }
  /// Returns a finite number.
  double number(int row, int column) const;
  /// Returns a finite number above that of the row before.
  double rising_number(int row, int column) const;
  /// Returns a whole number, `least` or more.
  int whole_number(int row, int column, int least) const;
  /// Returns a name: printable, not empty, no `#` in front, which would read as a comment.
  std::string name(int row, int column) const;

  /// Refuses a row.
  [[noreturn]] void refuse(int row, const std::string& problem, const std::string& expected,
                           const std::string& remedy = "") const;
  /// Refuses a table without rows; `what` in the plural.
  void require_rows(const std::string& what) const;

 private:
  std::string file_;
  std::string content_;
  std::vector<CsvColumn> columns_;
  std::vector<int> place_;                ///< column -> field of a line; -1 when the file lacks it
  size_t width_ = 0;                      ///< fields per line
  std::vector<std::string_view> fields_;  ///< rows x width, into content_
  std::vector<int> line_;                 ///< of each row, from 1
};

}  // namespace clothfit
