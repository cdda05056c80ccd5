// How libFuzzer changes text. Most files whose bytes are changed at random are refused at once;
// these changes leave the grammar whole, so that absurd numbers reach what computes with them.

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <random>
#include <string>
#include <string_view>
#include <utility>

extern "C" size_t LLVMFuzzerMutate(std::uint8_t* data, size_t size, size_t most);

namespace {

constexpr auto kNumbers = std::to_array<std::string_view>({"0",           "-0",
                                                           "1",           "-1",
                                                           "2",           "3",
                                                           "0.5",         "1e-3",
                                                           "1e-320",      "-1e-320",
                                                           "1e-160",      "1e-12",
                                                           "1e-9",        "1e-6",
                                                           "1e3",         "1e6",
                                                           "1e9",         "1e12",
                                                           "1e15",        "1e160",
                                                           "-1e160",      "1e308",
                                                           "-1e308",      "1e309",
                                                           "2147483647",  "-2147483648",
                                                           "4294967296",  "9223372036854775807",
                                                           "65536",       "1000000",
                                                           "nan",         "inf",
                                                           "-inf",        "",
                                                           "null",        "~",
                                                           "0x10",        "1.",
                                                           "99",          "1000",
                                                           "0.999999999", "-0.5"});

bool is_of_a_number(char c) {
  return (c >= '0' && c <= '9') || c == '.' || c == '-' || c == '+' || c == 'e' || c == 'E';
}
bool is_of_a_word(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
}

struct Stretch {
  size_t begin = 0, end = 0;
};

/// Returns a stretch of characters of a kind, at a place or the next one behind it.
template <class IsOfKind>
Stretch stretch_at(std::string_view text, size_t at, const IsOfKind& is_of_kind) {
  while (at < text.size() && !is_of_kind(text[at])) ++at;
  Stretch found{at, at};
  while (found.begin > 0 && is_of_kind(text[found.begin - 1])) --found.begin;
  while (found.end < text.size() && is_of_kind(text[found.end])) ++found.end;
  return found;
}

class TextChange {
 public:
  TextChange(std::string text, unsigned seed) : text_(std::move(text)), random_(seed) {}

  std::string changed() {
    const size_t changes = 1 + below(3);
    for (size_t change = 0; change < changes; ++change) {
      const size_t kind = below(10);
      if (kind < 5)
        replace_number();
      else if (kind < 7)
        replace_word();
      else
        move_line();
    }
    return text_;
  }

 private:
  size_t below(size_t count) { return count == 0 ? 0 : random_() % count; }

  void replace(Stretch stretch, std::string_view by) {
    text_.replace(stretch.begin, stretch.end - stretch.begin, by);
  }
  void replace_number() {
    const Stretch number = stretch_at(text_, below(text_.size()), is_of_a_number);
    if (below(4) > 0) {
      replace(number, kNumbers[below(kNumbers.size())]);
    } else {
      const Stretch other = stretch_at(text_, below(text_.size()), is_of_a_number);
      replace(number, text_.substr(other.begin, other.end - other.begin));
    }
  }
  void replace_word() {
    const Stretch word = stretch_at(text_, below(text_.size()), is_of_a_word);
    const Stretch other = stretch_at(text_, below(text_.size()), is_of_a_word);
    replace(word, text_.substr(other.begin, other.end - other.begin));
  }
  /// Takes a line out, or puts a copy of it elsewhere.
  void move_line() {
    const auto line_at = [&](size_t at) {
      Stretch line = stretch_at(text_, at, [](char c) { return c != '\n'; });
      line.end = std::min(line.end + 1, text_.size());
      return line;
    };
    const Stretch line = line_at(below(text_.size()));
    if (below(2) == 0)
      replace(line, "");
    else
      text_.insert(line_at(below(text_.size())).begin,
                   text_.substr(line.begin, line.end - line.begin));
  }

  std::string text_;
  std::minstd_rand random_;
};

}  // namespace

extern "C" size_t LLVMFuzzerCustomMutator(std::uint8_t* data, size_t size, size_t most,
                                          unsigned seed) {
  if (seed % 3 == 0 || size == 0) return LLVMFuzzerMutate(data, size, most);
  const std::string text =
      TextChange(std::string(reinterpret_cast<const char*>(data), size), seed / 3).changed();
  const size_t count = std::min(text.size(), most);
  std::memcpy(data, text.data(), count);
  return count;
}
