#include "vision/ingest/frame_list.h"

#include <fmt/ranges.h>

namespace clothfit {

std::string list_numbers(const std::vector<int>& numbers) {
  constexpr size_t kMostRanges = 8;
  std::vector<std::string> ranges;
  size_t named = 0;
  for (size_t i = 0; i < numbers.size() && ranges.size() < kMostRanges;) {
    size_t last = i;
    while (last + 1 < numbers.size() && numbers[last + 1] == numbers[last] + 1) ++last;
    ranges.push_back(last == i ? fmt::format("{}", numbers[i])
                               : fmt::format("{} to {}", numbers[i], numbers[last]));
    i = named = last + 1;
  }
  const std::string text = fmt::format("{}", fmt::join(ranges, ", "));
  return named == numbers.size() ? text
                                 : fmt::format("{} and {} more", text, numbers.size() - named);
}

Finding missing_frames(const std::vector<int>& frames, std::int64_t of, const std::string& where) {
  return {.check = "pictures",
          .state = FindingState::warning,
          .found = fmt::format("{} of {} frames have no picture: {}", frames.size(), of,
                               list_numbers(frames)),
          .where = where,
          .expected = "a picture for each frame",
          .remedy = "their times stay empty; record again if the cloth moves quickly there"};
}

}  // namespace clothfit
