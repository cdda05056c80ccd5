#include "vision/ingest/picture_names.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <numeric>
#include <optional>

#include "data/input_error.h"
#include "vision/ingest/frame_list.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

/// A run of digits, or a run of anything else.
struct NamePart {
  bool digits = false;
  std::string text;
};

bool is_digit(char c) {
  return std::isdigit(static_cast<unsigned char>(c)) != 0;
}

std::vector<NamePart> parts_of(const std::string& name) {
  std::vector<NamePart> parts;
  for (const char c : name) {
    if (parts.empty() || parts.back().digits != is_digit(c)) parts.push_back({is_digit(c), ""});
    parts.back().text += c;
  }
  return parts;
}

/// Returns digits without leading zeros. Numbers of any length then compare by length, then text.
std::string without_zeros(const std::string& digits) {
  const size_t first = digits.find_first_not_of('0');
  return first == std::string::npos ? "" : digits.substr(first);
}

/// Returns the number before the extension that differs from name to name, for each name. Nothing
/// where none or several do, or where the rest of the names differs.
std::optional<std::vector<std::int64_t>> changing_numbers(const std::vector<fs::path>& files) {
  std::vector<std::vector<NamePart>> names;
  for (const fs::path& file : files) names.push_back(parts_of(file.stem().string()));
  std::optional<size_t> changing;
  for (const std::vector<NamePart>& name : names) {
    if (name.size() != names.front().size()) return std::nullopt;
    for (size_t p = 0; p < name.size(); ++p) {
      const NamePart& first = names.front()[p];
      if (name[p].text == first.text) continue;
      if (!name[p].digits || !first.digits || (changing && *changing != p)) return std::nullopt;
      changing = p;
    }
  }
  if (!changing) return std::nullopt;
  constexpr size_t kMostDigits = 18;  // fit into 64 bits
  std::vector<std::int64_t> numbers;
  for (const std::vector<NamePart>& name : names) {
    const std::string digits = without_zeros(name[*changing].text);
    if (digits.size() > kMostDigits) return std::nullopt;
    numbers.push_back(digits.empty() ? 0 : std::stoll(digits));
  }
  return numbers;
}

/// Counts on where a camera's counter of so many digits began again: IMG_9999, then IMG_0001.
/// Brings files and numbers, which rise, into that order.
void count_on_after_the_last(std::vector<fs::path>& files, std::vector<std::int64_t>& numbers) {
  const std::int64_t first = numbers.front(), last = numbers.back();
  std::int64_t most = 999;  // shorter counters are none of cameras
  while (most < last) most = 10 * most + 9;
  if (last != most || first > 1) return;
  // Nearly all of the range must lie between what was written after and before.
  constexpr double kMissing = 0.5;
  for (size_t i = 1; i < numbers.size(); ++i) {
    if (static_cast<double>(numbers[i] - numbers[i - 1]) < kMissing * static_cast<double>(most))
      continue;
    for (size_t j = 0; j < i; ++j) numbers[j] += first == 0 ? most + 1 : most;
    const auto begin = static_cast<std::ptrdiff_t>(i);
    std::rotate(numbers.begin(), numbers.begin() + begin, numbers.end());
    std::rotate(files.begin(), files.begin() + begin, files.end());
    return;
  }
}

Finding uncounted(const std::string& folder, const std::string& found) {
  return {.check = "pictures",
          .state = FindingState::warning,
          .found = found + "; pictures are counted in the order of their names",
          .where = folder,
          .expected = "one number in each name that counts the frames",
          .remedy = "number the pictures, or give times.csv, lest a missing one goes unseen"};
}

}  // namespace

bool natural_order(const std::string& a, const std::string& b) {
  const std::vector<NamePart> left = parts_of(a), right = parts_of(b);
  for (size_t p = 0; p < std::min(left.size(), right.size()); ++p) {
    if (left[p].digits && right[p].digits) {
      const std::string l = without_zeros(left[p].text), r = without_zeros(right[p].text);
      if (l.size() != r.size()) return l.size() < r.size();
      if (l != r) return l < r;
    } else if (left[p].text != right[p].text) {
      return left[p].text < right[p].text;
    }
  }
  return left.size() != right.size() ? left.size() < right.size() : a < b;
}

NumberedPictures number_pictures(std::vector<fs::path> files) {
  std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    return natural_order(a.filename().string(), b.filename().string());
  });
  NumberedPictures result{.files = std::move(files), .frames = {}, .findings = {}};
  const size_t count = result.files.size();
  result.frames.resize(count);
  std::iota(result.frames.begin(), result.frames.end(), 0);
  if (count < 2) return result;
  const std::string folder = result.files.front().parent_path().string();
  for (size_t i = 1; i < count; ++i)
    if (result.files[i].stem() == result.files[i - 1].stem())
      throw InputError(result.files[i].string(),
                       fmt::format("has the name of {}", result.files[i - 1].filename().string()),
                       "one picture for each name", "remove the one that is not a frame");
  auto numbers = changing_numbers(result.files);
  if (!numbers) {
    result.findings.push_back(uncounted(folder, "no single number counts the pictures"));
    return result;
  }

  count_on_after_the_last(result.files, *numbers);
  std::int64_t step = 0;
  for (size_t i = 1; i < count; ++i) {
    if ((*numbers)[i] == (*numbers)[i - 1])
      throw InputError(result.files[i].string(),
                       fmt::format("has the number {} of {}", (*numbers)[i],
                                   result.files[i - 1].filename().string()),
                       "one picture for each number", "remove the one that is not a frame");
    step = std::gcd(step, (*numbers)[i] - (*numbers)[i - 1]);
  }
  // More missing than there are is no gap any more: names of that kind are times of day.
  constexpr std::int64_t kMostMissing = 10;  // times the pictures there are
  const std::int64_t last = (numbers->back() - numbers->front()) / step;
  if (last > kMostMissing * static_cast<std::int64_t>(count)) {
    result.findings.push_back(
        uncounted(folder, fmt::format("the names count from {} to {} over {} pictures",
                                      numbers->front(), numbers->back(), count)));
    return result;
  }
  std::vector<int> missing;
  for (size_t i = 0; i < count; ++i) {
    result.frames[i] = static_cast<int>(((*numbers)[i] - numbers->front()) / step);
    for (int f = i > 0 ? result.frames[i - 1] + 1 : 0; f < result.frames[i]; ++f)
      missing.push_back(f);
  }
  for (const std::int64_t number : *numbers) result.numbers.push_back(number / step);
  if (!missing.empty()) result.findings.push_back(missing_frames(missing, last + 1, folder));
  return result;
}

}  // namespace clothfit
