#pragma once

#include <cstdint>
#include <string_view>

namespace clothfit {

constexpr std::uint64_t kEmptyChecksum = 0xcbf29ce484222325u;

/// Returns FNV-1a over 64 bits, of `bytes` after those that gave `before`. It tells damage, not
/// forgery. Every step is a bijection of the sum so far, so that one changed byte always changes
/// the result. Wider damage passes with a probability of 2^-64.
constexpr std::uint64_t checksum(std::string_view bytes, std::uint64_t before = kEmptyChecksum) {
  for (const char byte : bytes)
    before = (before ^ static_cast<unsigned char>(byte)) * 0x100000001b3u;
  return before;
}

}  // namespace clothfit
