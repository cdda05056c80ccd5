#pragma once

#include <string>
#include <vector>

#include "apps/terminal/table.h"
#include "data/recording.h"
#include "fit/interface/fit_report.h"

namespace clothfit {

std::string to_string(FitStop stop);

/// Every parameter with all its digits, effects' and nuisance parameters included (CSV).
Table parameter_table(const FitResult& result);
/// The same rounded by sigma, for people.
Table short_parameter_table(const FitResult& result);

/// The places that searches and refinements ended in, one a column, best first; no rows where there
/// was no search.
Table basin_table(const FitResult& result);

/// One row per kind of observation with all digits (CSV).
Table error_table(const FitResult& result);
/// The same for people: 3D errors in mm.
Table short_error_table(const FitResult& result);
/// Chamfer distances from measured clouds; no rows where there are none.
Table cloud_table(const FitResult& result);

/// One row per observation: observed, predicted, sigma (CSV).
Table residual_table(const FitReport& report, const Recording& recording);

/// Rejected observations by reason.
Table rejection_table(const FitResult& result);

/// Factor and unit in which errors of a kind are shown: metres as millimetres.
struct ShownUnit {
  double factor = 1;
  std::string name;
};
ShownUnit shown_unit(const std::string& unit);

/// "front, px" or "tracks3d, mm"
std::string kind_title(const std::string& kind, const std::string& unit);

}  // namespace clothfit
