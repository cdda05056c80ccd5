#pragma once

#include <string>

#include "apps/study/lethanh2007/study.h"
#include "apps/terminal/table.h"

namespace clothfit {

/// Returns the runs of the study, a row each.
Table lethanh2007_runs(const Lethanh2007Study& study);
/// Returns the times of correspondences against their number.
Table lethanh2007_correspondences(const Lethanh2007Study& study);
/// Returns the paper's claims with what was measured.
Table lethanh2007_claims(const Lethanh2007Study& study);

/// Writes report.html of the founding paper's experiment: one self-contained page.
std::string lethanh2007_page_html(const Lethanh2007Study& study, const Lethanh2007Options& options,
                                  const std::string& command, const std::string& version);

}  // namespace clothfit
