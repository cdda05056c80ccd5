#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

namespace clothfit {

/// Writes a JSON file. Bytes that are no UTF-8, which names of pictures may hold, are replaced.
void write_json(const nlohmann::ordered_json& json, const std::filesystem::path& file);

}  // namespace clothfit
