#pragma once

#include <cstddef>
#include <new>
#include <vector>

namespace clothfit {

/// Gives memory that begins at a cache line. A vector of lanes then never lies across two, which
/// would cost as much as two (a quarter of a time step).
template <class Number>
struct CacheLineAllocator {
  using value_type = Number;
  static constexpr std::align_val_t kLine{64};

  CacheLineAllocator() = default;
  template <class Other>
  CacheLineAllocator(const CacheLineAllocator<Other>&) {}
  Number* allocate(size_t count) {
    return static_cast<Number*>(::operator new(count * sizeof(Number), kLine));
  }
  void deallocate(Number* numbers, size_t) { ::operator delete(numbers, kLine); }
  bool operator==(const CacheLineAllocator&) const { return true; }
};

template <class Number>
using AlignedNumbers = std::vector<Number, CacheLineAllocator<Number>>;

}  // namespace clothfit
