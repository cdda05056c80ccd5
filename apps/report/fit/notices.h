#pragma once

#include <string>

#include "data/finding.h"

namespace clothfit {

/// The colour and the sign that a page's first box has.
enum class Notice { good, care, lacks, bad };

/// Returns the box that a page begins with: its sign, one sentence, and HTML below that.
std::string notice_box(Notice notice, const std::string& sentence, const std::string& html_below);

/// Returns a box with what was found likely to be wrong before the fit; empty where nothing was.
std::string warnings_box(const Findings& warnings);

}  // namespace clothfit
