#include "fit/interface/fit_options.h"

#include <array>
#include <cmath>
#include <utility>

#include "data/input_error.h"

namespace clothfit {
namespace {

constexpr std::array<std::pair<LeadingCost, const char*>, 4> kNames{
    {{LeadingCost::trajectory, "trajectory"},
     {LeadingCost::shooting, "shooting"},
     {LeadingCost::full, "full"},
     {LeadingCost::small, "small"}}};

}  // namespace

std::string to_string(LeadingCost cost) {
  for (const auto& [value, name] : kNames)
    if (value == cost) return name;
  return "";
}

std::optional<LeadingCost> leading_cost_named(const std::string& name) {
  for (const auto& [value, known] : kNames)
    if (name == known) return value;
  return std::nullopt;
}

void FitOptions::validate() const {
  const auto require = [](bool good, const std::string& name, const std::string& expected) {
    if (!good) throw InputError("FitOptions::" + name, "is out of range", expected);
  };
  require(mesh_columns == 0 || mesh_columns >= 2, "mesh_columns", "at least 2 columns");
  require(mesh_rows == 0 || mesh_rows >= 2, "mesh_rows", "at least 2 rows");
  require(population >= 4 && population <= 100000, "population", "4 to 100000 individuals");
  require(generations >= 1, "generations", "at least 1");
  require(search_share > 0 && search_share <= 1, "search_share", "more than 0, at most 1");
  require(refine_best >= 1, "refine_best", "at least 1");
  require(!stop_cost || !std::isnan(*stop_cost), "stop_cost", "a mean error in sigmas");
  require(!resume || !checkpoint.empty(), "resume", "a FitOptions::checkpoint to go on from");
  require(checkpoint.empty() || (!start && !forecast), "checkpoint",
          "a fit that searches: without FitOptions::start and FitOptions::forecast");
  require(cost == LeadingCost::trajectory || checkpoint.empty(), "checkpoint",
          "a fit that searches: with FitOptions::cost = trajectory");
  require(cost == LeadingCost::trajectory || !forecast, "cost",
          "a fit: without FitOptions::forecast");
  require(substep_scale >= 1 && std::isfinite(substep_scale), "substep_scale", "1 or more");
  require(start_nodes == 0 || (start_nodes >= 2 && start_nodes <= 30), "start_nodes",
          "2 to 30 nodes a side, or 0 (as the first shape asks for)");
  require(marker_offset_sigma_m >= 0 && std::isfinite(marker_offset_sigma_m),
          "marker_offset_sigma_m", "a length in metres, 0 (none) or more");
  require(marker_offset_sigma_m == 0 || !forecast, "marker_offset_sigma_m",
          "a fit: a forecast takes those of the earlier one");
  require(drive_knots == 0 || (drive_knots >= 4 && drive_knots <= 1000), "drive_knots",
          "4 to 1000 knots, or 0 (none)");
  require(work > 0 && std::isfinite(work), "work", "more than 0");
  require(coarse_beyond > 0, "coarse_beyond", "more than 0");
  require(bootstrap == 0 || (bootstrap >= 19 && bootstrap <= 100000), "bootstrap",
          "19 to 100000 replicates");
  const auto need_a_fit = [&](bool asked, const std::string& name) {
    require(!asked || !forecast, name, "a fit: without FitOptions::forecast");
  };
  need_a_fit(drive_knots > 0, "drive_knots");
  need_a_fit(profile, "profile");
  need_a_fit(bootstrap > 0, "bootstrap");
  need_a_fit(two_meshes, "two_meshes");
  require(!two_meshes || spring_set == SpringSet::fabric, "two_meshes",
          "FitOptions::spring_set = fabric: natural lengths are those of one mesh");
  require(threads >= 0, "threads", "0 (all) or more");
  for (const ParameterPrior& prior : priors)
    require(std::isfinite(prior.mean) && std::isfinite(prior.sigma) && prior.sigma > 0,
            "priors = " + prior.name, "a mean and, more than 0, a standard deviation");
  require(priors.empty() || !forecast, "priors", "a fit: without FitOptions::forecast");
}

}  // namespace clothfit
