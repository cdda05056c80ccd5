#pragma once

#include <string>

#include "apps/study/recover.h"

namespace clothfit {

/// The study as one HTML page: what was recovered, how well, and whether the fits knew.
std::string recover_page_html(const RecoverOptions& options, const RecoverResult& result,
                              const std::string& command);

}  // namespace clothfit
