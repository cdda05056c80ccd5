#pragma once

#include <string>
#include <vector>

namespace clothfit {

/// Texts in rows under a header: the content of CSV files, pages and the terminal.
struct Table {
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;
};

}  // namespace clothfit
