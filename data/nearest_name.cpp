#include "data/nearest_name.h"

#include <algorithm>
#include <numeric>

namespace clothfit {
namespace {

/// Counts the insertions, deletions, replacements and swaps of neighbours that turn `a` into `b`.
size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<size_t> before_last(b.size() + 1);
  std::vector<size_t> last(b.size() + 1);
  std::vector<size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), size_t{0});
  for (size_t i = 1; i <= a.size(); ++i) {
    before_last.swap(last);
    last.swap(row);
    row[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      const size_t replaced = last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      row[j] = std::min({replaced, last[j] + 1, row[j - 1] + 1});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) row[j] = std::min(row[j], before_last[j - 2] + 1);
    }
  }
  return row[b.size()];
}

}  // namespace

std::string known_names(const std::string& mistyped, const std::vector<std::string>& known) {
  // Texts far longer than any name are not slips of a finger.
  constexpr size_t kLongestName = 64;
  std::string text;
  size_t least = kLongestName;
  const std::string* nearest = nullptr;
  for (const std::string& name : known) {
    if (mistyped.size() > kLongestName) break;
    const size_t distance = edit_distance(mistyped, name);
    const size_t allowed = std::max<size_t>(1, std::max(mistyped.size(), name.size()) / 3);
    if (distance <= allowed && distance < least) {
      least = distance;
      nearest = &name;
    }
  }
  if (nearest != nullptr) text += "did you mean `" + *nearest + "`? ";
  text += "known are ";
  for (size_t i = 0; i < known.size(); ++i) {
    if (i > 0) text += ", ";
    text += "`" + known[i] + "`";
  }
  return text;
}

}  // namespace clothfit
