#pragma once

#include <string>

#include "apps/study/trials/undeclared.h"

namespace clothfit {

/// Writes the study as one HTML page: how often the diagnosis named the hidden effect, for what it
/// took it, and which errors remained.
std::string undeclared_page_html(const UndeclaredOptions& options, const UndeclaredResult& result,
                                 const std::string& command);

}  // namespace clothfit
