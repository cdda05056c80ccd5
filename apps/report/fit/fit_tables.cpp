#include "apps/report/fit/fit_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "apps/terminal/number_text.h"

namespace clothfit {
namespace {

/// Calls visit(group, parameter) for the base model, each effect and the nuisance parameters.
template <class Visit>
void for_each_parameter(const FitResult& result, const Visit& visit) {
  for (const ParameterEstimate& parameter : result.parameters) visit("base", parameter);
  for (const EffectEstimate& effect : result.effects)
    for (const ParameterEstimate& parameter : effect.parameters) visit(effect.name, parameter);
  for (const ParameterEstimate& parameter : result.nuisance) visit("measurement", parameter);
}

Table without_empty_columns(const Table& table) {
  Table kept;
  kept.rows.resize(table.rows.size());
  for (size_t c = 0; c < table.header.size(); ++c) {
    if (std::ranges::all_of(table.rows, [&](const auto& row) { return row[c].empty(); })) continue;
    kept.header.push_back(table.header[c]);
    for (size_t r = 0; r < table.rows.size(); ++r) kept.rows[r].push_back(table.rows[r][c]);
  }
  return kept;
}

std::string relative_text(const ParameterEstimate& parameter) {
  const bool meaningful = parameter.state != ParameterState::fixed && parameter.sigma > 0 &&
                          parameter.state != ParameterState::misfit && parameter.value != 0;
  if (!meaningful) return "";
  return significant(100 * parameter.sigma / std::abs(parameter.value), 2) + "%";
}

/// Writes the interval with as many digits as sigma asks for.
std::string interval_text(const std::optional<Interval>& interval, double sigma) {
  if (!interval) return "";
  return value_text(interval->lower, sigma) + " to " + value_text(interval->upper, sigma);
}

}  // namespace

std::string to_string(FitStop stop) {
  switch (stop) {
    case FitStop::not_run:
      return "not run";
    case FitStop::converged:
      return "converged";
    case FitStop::reached_limit:
      return "reached a limit of the search";
    case FitStop::cancelled:
      return "cancelled";
    case FitStop::diverged:
      return "diverged";
  }
  return "";
}

ShownUnit shown_unit(const std::string& unit) {
  if (unit == "m") return {1000, "mm"};
  return {1, unit};
}

std::string kind_title(const std::string& kind, const std::string& unit) {
  return fmt::format("{}, {}", kind, shown_unit(unit).name);
}

Table parameter_table(const FitResult& result) {
  Table table{{"group", "name", "unit", "value", "sigma", "state", "reason", "lower_90", "upper_90",
               "bootstrap_lower_90", "bootstrap_upper_90", "mesh_shift"},
              {}};
  for_each_parameter(result, [&](const std::string& group, const ParameterEstimate& parameter) {
    const auto& interval = parameter.interval_90;
    const auto& bootstrap = parameter.bootstrap_90;
    table.rows.push_back({group, parameter.name, parameter.unit, exact_text(parameter.value),
                          exact_text(parameter.sigma), to_string(parameter.state), parameter.reason,
                          interval ? exact_text(interval->lower) : "",
                          interval ? exact_text(interval->upper) : "",
                          bootstrap ? exact_text(bootstrap->lower) : "",
                          bootstrap ? exact_text(bootstrap->upper) : "",
                          parameter.mesh_shift ? exact_text(*parameter.mesh_shift) : ""});
  });
  return table;
}

Table short_parameter_table(const FitResult& result) {
  Table table{{"parameter", "value", "sigma", "relative", "90 %", "unit", "state"}, {}};
  bool bootstrapped = false, on_two_meshes = false;
  for_each_parameter(result, [&](const std::string&, const ParameterEstimate& parameter) {
    bootstrapped = bootstrapped || parameter.bootstrap_90;
    on_two_meshes = on_two_meshes || parameter.mesh_shift;
  });
  if (bootstrapped) table.header.insert(table.header.end() - 2, "90 % by bootstrap");
  if (on_two_meshes) table.header.insert(table.header.end() - 2, "other mesh");
  for_each_parameter(result, [&](const std::string& group, const ParameterEstimate& parameter) {
    const std::string name = group == "base" ? parameter.name : group + ": " + parameter.name;
    const bool no_sigma = parameter.state == ParameterState::fixed ||
                          parameter.state == ParameterState::misfit || parameter.sigma == 0;
    std::string state = to_string(parameter.state);
    if (!parameter.reason.empty()) state += ": " + parameter.reason;
    std::vector<std::string> row = {name, value_text(parameter.value, parameter.sigma),
                                    no_sigma ? "" : significant(parameter.sigma, 2),
                                    relative_text(parameter),
                                    interval_text(parameter.interval_90, parameter.sigma) +
                                        (parameter.interval_by_profile ? " (profile)" : "")};
    if (bootstrapped) row.push_back(interval_text(parameter.bootstrap_90, parameter.sigma));
    if (on_two_meshes)
      row.push_back(parameter.mesh_shift ? fmt::format("{}{}", *parameter.mesh_shift < 0 ? "" : "+",
                                                       significant(*parameter.mesh_shift, 2))
                                         : "");
    row.insert(row.end(), {parameter.unit, state});
    table.rows.push_back(std::move(row));
  });
  return without_empty_columns(table);
}

Table estimated_parameter_table(const FitResult& result, Table& rest) {
  const Table all = short_parameter_table(result);
  Table estimated{all.header, {}};
  rest = estimated;
  size_t row = 0;
  for_each_parameter(result, [&](const std::string& group, const ParameterEstimate& parameter) {
    const bool of_effect = group != "base" && group != "measurement";
    const bool is_given = of_effect && parameter.state == ParameterState::fixed;
    (group == "measurement" || is_given ? rest : estimated).rows.push_back(all.rows[row++]);
  });
  return estimated;
}

Table brief_parameter_table(const FitResult& result) {
  Table table{{"parameter", "value"}, {}};
  for (const ParameterEstimate& parameter : result.parameters) {
    const bool has_sigma =
        parameter.state == ParameterState::fitted || parameter.state == ParameterState::ratio;
    table.rows.push_back(
        {parameter.name,
         has_sigma ? fmt::format("{} ± {} {}", value_text(parameter.value, parameter.sigma),
                                 significant(parameter.sigma, 2), parameter.unit)
         : parameter.state == ParameterState::fixed
             ? fmt::format("{} {}", significant(parameter.value, 3), parameter.unit)
             : to_string(parameter.state)});
  }
  return table;
}

Table basin_table(const FitResult& result) {
  Table table;
  if (result.basins.empty()) return table;
  table.header.push_back("");
  std::vector<std::string> cost = {"cost (sigmas)"}, ended = {"ended there"}, how = {"refined"};
  for (const Basin& basin : result.basins) {
    table.header.push_back(std::to_string(table.header.size()));
    cost.push_back(significant(basin.cost, 3));
    ended.push_back(std::to_string(basin.ended));
    how.push_back(basin.refined ? "yes" : "no");
  }
  table.rows = {cost, ended, how};
  const std::vector<Basin::Number>& names = result.basins.front().parameters;
  for (size_t p = 0; p < names.size(); ++p) {
    std::vector<std::string> row = {names[p].name};
    for (const Basin& basin : result.basins)
      row.push_back(p < basin.parameters.size() ? significant(basin.parameters[p].value, 3) : "");
    table.rows.push_back(std::move(row));
  }
  return table;
}

Table error_table(const FitResult& result) {
  Table table{
      {"kind", "unit", "fitted_rms", "fitted_rms_distance", "fitted_count", "held_out_rms",
       "held_out_rms_distance", "held_out_count", "noise", "first_frame", "last_velocity", "rigid"},
      {}};
  for (const ObservationErrors& errors : result.errors) {
    const bool judged = errors.held_out.count > 0;
    const auto held = [&](double value) { return judged ? exact_text(value) : ""; };
    table.rows.push_back({errors.kind, errors.unit, exact_text(errors.fitted.rms),
                          exact_text(errors.fitted.rms_distance),
                          std::to_string(errors.fitted.count), held(errors.held_out.rms),
                          held(errors.held_out.rms_distance), std::to_string(errors.held_out.count),
                          exact_text(errors.noise), held(errors.trivial.first_frame),
                          held(errors.trivial.last_velocity), held(errors.trivial.rigid)});
  }
  return table;
}

Table short_error_table(const FitResult& result) {
  Table table{{"observations", "fitted frames", "held-out frames", "noise", "stays as in frame 0",
               "moves on", "moves rigidly"},
              {}};
  for (const ObservationErrors& errors : result.errors) {
    const double factor = shown_unit(errors.unit).factor;
    const bool judged = errors.held_out.count > 0;
    const auto shown = [&](double value) { return significant(value * factor, 3); };
    const auto held = [&](double value) { return judged ? shown(value) : std::string("-"); };
    table.rows.push_back({kind_title(errors.kind, errors.unit), shown(errors.fitted.rms),
                          held(errors.held_out.rms), shown(errors.noise),
                          held(errors.trivial.first_frame), held(errors.trivial.last_velocity),
                          held(errors.trivial.rigid)});
  }
  return table;
}

Table cloud_table(const FitResult& result) {
  Table table{{"measured clouds", "fitted frames", "held-out frames", "all frames"}, {}};
  if (!result.clouds) return table;
  const auto shown = [](const CloudErrors::Summary& of) {
    return of.frames > 0 ? significant(of.chamfer_m2 * 1e4, 3) : std::string("-");
  };
  table.rows.push_back({"Chamfer distance (1e-4 m²)", shown(result.clouds->fitted),
                        shown(result.clouds->held_out), shown(result.clouds->all)});
  return table;
}

Table residual_table(const FitReport& report, const Recording& recording) {
  Table table{{"kind", "frame", "marker", "held_out", "observed_1", "observed_2", "observed_3",
               "predicted_1", "predicted_2", "predicted_3", "sigma"},
              {}};
  for (const FitReport::Residuals& residuals : report.residuals) {
    for (const FitReport::Residuals::Row& row : residuals.rows) {
      std::array<std::string, 3> observed;
      std::array<std::string, 3> predicted;
      for (Eigen::Index c = 0; c < std::min<Eigen::Index>(3, row.observed.size()); ++c) {
        observed[static_cast<size_t>(c)] = exact_text(row.observed[c]);
        predicted[static_cast<size_t>(c)] = exact_text(row.predicted[c]);
      }
      const Marker& marker = recording.markers.markers[static_cast<size_t>(row.marker)];
      table.rows.push_back({residuals.kind, std::to_string(row.frame), marker.name,
                            row.held_out ? "1" : "0", observed[0], observed[1], observed[2],
                            predicted[0], predicted[1], predicted[2], exact_text(row.sigma)});
    }
  }
  return table;
}

Table rejection_table(const FitResult& result) {
  Table table{{"reason", "observations"}, {}};
  for (const auto& [reason, count] : result.observations_rejected)
    table.rows.push_back({reason, std::to_string(count)});
  return table;
}

}  // namespace clothfit
