#pragma once

#include <bit>
#include <cstdint>
#include <string>

namespace clothfit {

/// Appends a number to a binary file's bytes, lowest byte first on every machine.
inline void append_uint32(std::uint32_t value, std::string& bytes) {
  for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>((value >> shift) & 0xffu);
}
inline void append_int32(int value, std::string& bytes) {
  append_uint32(static_cast<std::uint32_t>(value), bytes);
}
inline void append_float64(double value, std::string& bytes) {
  const auto word = std::bit_cast<std::uint64_t>(value);
  append_uint32(static_cast<std::uint32_t>(word), bytes);
  append_uint32(static_cast<std::uint32_t>(word >> 32), bytes);
}
inline void append_float32(double value, std::string& bytes) {
  append_uint32(std::bit_cast<std::uint32_t>(static_cast<float>(value)), bytes);
}

}  // namespace clothfit
