#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace clothfit {

/// Reads a JSON file. Throws InputError with its line, also for a key that comes twice in one
/// object; `expected` and `remedy` complete the message.
nlohmann::json read_json(const std::filesystem::path& file, const std::string& expected,
                         const std::string& remedy);

}  // namespace clothfit
