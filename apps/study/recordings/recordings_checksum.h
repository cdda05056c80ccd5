#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace clothfit {

/// Every recording's folder has a file of this name.
inline constexpr const char* kRecordingFile = "recording.yaml";

/// Returns the checksum of a text and of its end, after those that gave `before`.
std::uint64_t checksum_of_text(const std::string& text, std::uint64_t before);

/// Returns a checksum of recordings, so that a journal of others is refused. It is of the folders'
/// names, the recordings' descriptions, and the names and sizes of the files beside them.
std::uint64_t recordings_checksum(const std::vector<std::filesystem::path>& recordings);

}  // namespace clothfit
