#pragma once

#include <string>
#include <vector>

#include "apps/terminal/table.h"
#include "data/recording.h"
#include "fit/interface/fit_report.h"

namespace clothfit {

std::string to_string(FitStop stop);

/// Lists every parameter with all its digits, effects' and nuisance parameters included (CSV).
Table parameter_table(const FitResult& result);
/// Lists the same rounded by sigma, for people.
Table short_parameter_table(const FitResult& result);
/// Keeps the rows of what was estimated of the cloth and of effects; the others go to `rest`.
Table estimated_parameter_table(const FitResult& result, Table& rest);
/// Lists what is the cloth's in two columns: name, and value with sigma and unit or its state.
Table brief_parameter_table(const FitResult& result);

/// Lists the places in which searches and refinements ended, one a column, best first. There are no
/// rows without a search.
Table basin_table(const FitResult& result);

/// Has one row per kind of observation with all digits (CSV).
Table error_table(const FitResult& result);
/// Has the same for people: 3D errors in mm.
Table short_error_table(const FitResult& result);
/// Lists Chamfer distances from measured clouds; no rows where there are none.
Table cloud_table(const FitResult& result);

/// Has one row per observation: observed, predicted, sigma (CSV).
Table residual_table(const FitReport& report, const Recording& recording);

/// Lists rejected observations by reason.
Table rejection_table(const FitResult& result);

/// Factor and unit in which errors of a kind are shown: metres as millimetres.
struct ShownUnit {
  double factor = 1;
  std::string name;
};
ShownUnit shown_unit(const std::string& unit);

/// Returns "front, px" or "tracks3d, mm".
std::string kind_title(const std::string& kind, const std::string& unit);

}  // namespace clothfit
