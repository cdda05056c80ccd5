#pragma once

#include <string>

#include "apps/study/louchet1995/study.h"

namespace clothfit {

/// Writes report.html of the study of the founding paper: one self-contained page. Numbers that a
/// clock measured stand in elements of class "measured"; all else is the same for the same options.
std::string louchet1995_page_html(const Louchet1995Study& study, const Louchet1995Options& options,
                                  const std::string& command, const std::string& version);

}  // namespace clothfit
