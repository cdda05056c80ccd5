#pragma once

#include <cstddef>
#include <vector>

namespace clothfit {

/// Numbers, zero at first, that begin where a cache line does: a vector of lanes then never lies
/// across two, which would cost as much as two (a quarter of a time step).
template <class Number>
class AlignedNumbers {
 public:
  AlignedNumbers() = default;
  explicit AlignedNumbers(std::size_t count) : lines_((count + kPerLine - 1) / kPerLine, Line{}) {}

  Number* data() { return reinterpret_cast<Number*>(lines_.data()); }
  const Number* data() const { return reinterpret_cast<const Number*>(lines_.data()); }

 private:
  static constexpr std::size_t kLineBytes = 64;
  static constexpr std::size_t kPerLine = kLineBytes / sizeof(Number);
  struct alignas(kLineBytes) Line {
    Number numbers[kPerLine];
  };
  std::vector<Line> lines_;
};

}  // namespace clothfit
