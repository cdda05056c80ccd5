#pragma once

#include <string>

#include "apps/study/trials/recover.h"

namespace clothfit {

/// Writes the study as one HTML page: the recovered values, their errors, and whether the fits
/// knew. Rendered studies show one of their pictures, a PNG file's bytes; it is empty for others.
std::string recover_page_html(const RecoverOptions& options, const RecoverResult& result,
                              const std::string& command, const std::string& picture_png = {});

}  // namespace clothfit
