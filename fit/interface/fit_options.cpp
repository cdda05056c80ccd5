#include "fit/interface/fit_options.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <utility>

#include "data/input_error.h"
#include "data/recording.h"
#include "fit/interface/option_limits.h"

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
  // A mesh side that is left open gets the recording's, which is at least 2.
  require(mesh_columns == 0 || is_possible_mesh(mesh_columns, mesh_rows == 0 ? 2 : mesh_rows),
          "mesh_columns",
          fmt::format("at least 2 columns, {} vertices at most", kMostMeshVertices));
  require(mesh_rows == 0 || is_possible_mesh(mesh_columns == 0 ? 2 : mesh_columns, mesh_rows),
          "mesh_rows", fmt::format("at least 2 rows, {} vertices at most", kMostMeshVertices));
  const auto to = [](const std::string& least, auto most) {
    return fmt::format("{} to {}", least, most);
  };
  require(population >= 4 && population <= kMostPopulation, "population",
          to("4", kMostPopulation) + " individuals");
  require(generations >= 1 && generations <= kMostGenerations, "generations",
          to("1", kMostGenerations));
  require(search_share > 0 && search_share <= 1, "search_share", "more than 0, at most 1");
  require(refine_best >= 1 && refine_best <= kMostRefined, "refine_best", to("1", kMostRefined));
  require(!stop_cost || !std::isnan(*stop_cost), "stop_cost", "a mean error in sigmas");
  require(!resume || !checkpoint.empty(), "resume", "a FitOptions::checkpoint to go on from");
  require(checkpoint.empty() || (!start && !forecast), "checkpoint",
          "a fit that searches: without FitOptions::start and FitOptions::forecast");
  require(cost == LeadingCost::trajectory || checkpoint.empty(), "checkpoint",
          "a fit that searches: with FitOptions::cost = trajectory");
  require(cost == LeadingCost::trajectory || !forecast, "cost",
          "a fit: without FitOptions::forecast");
  require(substep_scale >= 1 && substep_scale <= kMostSubstepScale, "substep_scale",
          to("1", kMostSubstepScale));
  require(start_nodes == 0 || (start_nodes >= 2 && start_nodes <= 30), "start_nodes",
          "2 to 30 nodes a side, or 0 (as the first shape asks for)");
  require(marker_offset_sigma_m >= 0 && std::isfinite(marker_offset_sigma_m),
          "marker_offset_sigma_m", "a length in metres, 0 (none) or more");
  require(marker_offset_sigma_m == 0 || !forecast, "marker_offset_sigma_m",
          "a fit: a forecast takes those of the earlier one");
  require(drive_knots == 0 || (drive_knots >= 4 && drive_knots <= 1000), "drive_knots",
          "4 to 1000 knots, or 0 (none)");
  require(work > 0 && work <= kMostWork, "work", fmt::format("more than 0, at most {}", kMostWork));
  require(coarse_beyond > 0, "coarse_beyond", "more than 0");
  require(bootstrap == 0 || (bootstrap >= 19 && bootstrap <= kMostReplicates), "bootstrap",
          to("19", kMostReplicates) + " replicates");
  const auto need_a_fit = [&](bool asked, const std::string& name) {
    require(!asked || !forecast, name, "a fit: without FitOptions::forecast");
  };
  need_a_fit(drive_knots > 0, "drive_knots");
  need_a_fit(profile, "profile");
  need_a_fit(bootstrap > 0, "bootstrap");
  need_a_fit(two_meshes, "two_meshes");
  require(!two_meshes || spring_set == SpringSet::fabric, "two_meshes",
          "FitOptions::spring_set = fabric: natural lengths are those of one mesh");
  require(threads >= 0 && threads <= kMostThreads, "threads", to("0 (all)", kMostThreads));
  for (const ParameterPrior& prior : priors)
    require(std::isfinite(prior.mean) && std::isfinite(prior.sigma) && prior.sigma > 0,
            "priors = " + prior.name, "a mean and, more than 0, a standard deviation");
  require(priors.empty() || !forecast, "priors", "a fit: without FitOptions::forecast");
}

}  // namespace clothfit
