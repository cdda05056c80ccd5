#include "apps/terminal/json_file.h"

#include <nlohmann/json.hpp>

#include "data/text_file.h"

namespace clothfit {

void write_json(const nlohmann::ordered_json& json, const std::filesystem::path& file) {
  write_text(json.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n",
             file);
}

}  // namespace clothfit
