#pragma once

#include <string>

#include "apps/study/trials/undeclared.h"

namespace clothfit {

/// The study as one HTML page: how often the diagnosis named what was hidden, what it took it for,
/// and what errors were left.
std::string undeclared_page_html(const UndeclaredOptions& options, const UndeclaredResult& result,
                                 const std::string& command);

}  // namespace clothfit
