#pragma once

#include <string>
#include <vector>

namespace clothfit {

/// Texts in rows under a header; what CSV files, pages and the terminal show.
struct Table {
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;
};

}  // namespace clothfit
