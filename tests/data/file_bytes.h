#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace clothfit {

inline std::string file_bytes(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

inline void write_bytes(const std::string& bytes, const std::filesystem::path& file) {
  std::ofstream(file, std::ios::binary) << bytes;
}

}  // namespace clothfit
