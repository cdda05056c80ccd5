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

/// A comma-separated table, split into fields and found by the names of its first line: columns in
/// any order, `#` comment lines and empty lines skipped, blanks around a field dropped, no quoting
/// (names hold no comma). Every refusal is an InputError that names the file and the line.
class CsvTable {
 public:
  /// Reads and splits. Refuses unknown, missing and doubled columns and lines with another number
  /// of fields than the first.
  CsvTable(const std::filesystem::path& file, std::vector<CsvColumn> columns);
  CsvTable(const CsvTable&) = delete;
  CsvTable& operator=(const CsvTable&) = delete;

  int rows() const { return static_cast<int>(line_.size()); }
  int line(int row) const { return line_[static_cast<std::size_t>(row)]; }

  /// `column` counts in the constructor's list. Empty where the file lacks an optional column.
  std::string_view text(int row, int column) const;
  bool empty(int row, int column) const { return text(row, column).empty(); }
  /// A finite number.
  double number(int row, int column) const;
  /// A finite number above that of the row before.
  double rising_number(int row, int column) const;
  /// A whole number, `least` or more.
  int whole_number(int row, int column, int least) const;
  /// A name: not empty, nothing that cannot be printed, no `#` in front (a comment would read so).
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
  std::size_t width_ = 0;                 ///< fields per line
  std::vector<std::string_view> fields_;  ///< rows x width, into content_
  std::vector<int> line_;                 ///< of each row, from 1
};

}  // namespace clothfit
