#include "apps/report/fit/fit_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/report/fit/fit_figures.h"
#include "apps/report/fit/fit_tables.h"
#include "apps/report/fit/notices.h"
#include "apps/report/fit/summary.h"
#include "apps/report/page/colour_map.h"
#include "apps/report/page/html.h"
#include "apps/terminal/number_text.h"

namespace clothfit {
namespace {

Notice notice_of(FitVerdict verdict) {
  switch (verdict) {
    case FitVerdict::good:
      return Notice::good;
    case FitVerdict::usable_with_care:
      return Notice::care;
    case FitVerdict::model_lacks:
      return Notice::lacks;
    case FitVerdict::do_not_use:
      return Notice::bad;
  }
  return Notice::care;
}

std::string heading(const FitReport& report) {
  const FitResult& result = report.result;
  const FitSummary summary = summarise(report);
  std::string below = paragraph(summary.paragraph);
  if (!summary.contradicting.empty()) below += paragraph(summary.contradicting);
  if (!result.next_command.empty())
    below += "<p>To ask what is missing:</p>\n<pre>" + escape_xml(result.next_command) + "</pre>\n";
  return fmt::format(
             "<h1>Fit of “{}”</h1>\n<p class=\"meta\">clothfit {} · {} · seed {} · {} s</p>\n",
             escape_xml(result.recording), escape_xml(result.version),
             escape_xml(to_string(report.stop)), result.seed, significant(result.seconds, 3)) +
         notice_box(notice_of(result.verdict), summary.verdict + ".", below) +
         warnings_box(result.warnings);
}

std::string errors_section(const FitReport& report) {
  std::string section =
      html_table(short_error_table(report.result),
                 "Root mean square of one coordinate's residual. The last three columns are "
                 "guesses that need no model, judged on the held-out frames like the model.");
  const Table clouds = cloud_table(report.result);
  if (!clouds.rows.empty())
    section += html_table(clouds,
                          "Mean squared distance from each measured point to the nearest of the "
                          "model's surface, there and back. Clouds took no part in the fit.");
  return section;
}

std::string figures_of(const FitReport& report, const Recording& recording,
                       const std::vector<BackgroundPicture>& pictures) {
  std::string content;
  for (const FitReport::Residuals& residuals : report.residuals) {
    const auto errors =
        std::find_if(report.result.errors.begin(), report.result.errors.end(),
                     [&](const ObservationErrors& one) { return one.kind == residuals.kind; });
    if (errors == report.result.errors.end()) continue;
    content += figure(residual_over_time_svg(residuals, *errors, recording),
                      fmt::format("Residual in each frame, {}. A model that only remembered would "
                                  "rise steeply in the shaded frames.",
                                  kind_title(residuals.kind, residuals.unit)));
    content += figure(residual_map_svg(residuals, recording),
                      "Residual of each marker over the flat cloth, seen from its printed side; "
                      "one colour scale for both. A pattern here is motion the model lacks.");
    const int frame = overlay_frame(residuals);
    const bool held_out = std::any_of(
        residuals.rows.begin(), residuals.rows.end(),
        [&](const FitReport::Residuals::Row& row) { return row.frame == frame && row.held_out; });
    content += figure(
        observed_and_predicted_svg(residuals, recording, pictures),
        fmt::format(
            "Observed and predicted markers in frame {}, the last that shows them well{}.{}", frame,
            held_out ? "; the fit did not see it" : "",
            residuals.unit == "m" ? " Seen level, from the side the cloth spreads most." : ""));
  }
  return content;
}

std::string correlation_section(const FitReport& report) {
  const auto count = static_cast<Eigen::Index>(report.correlation_names.size());
  if (count < 2 || report.correlation.rows() != count || report.correlation.cols() != count)
    return "";
  std::string html = paragraph(
      "Correlation of the estimates: near 1 or −1, the data fix a combination of two parameters "
      "better than either.");
  html += "<div class=\"wide\"><table class=\"matrix\"><thead><tr><td></td>";
  for (const std::string& name : report.correlation_names)
    html += fmt::format("<th scope=\"col\">{}</th>", escape_xml(name));
  html += "</tr></thead>\n<tbody>\n";
  for (Eigen::Index row = 0; row < count; ++row) {
    html += fmt::format("<tr><th scope=\"row\">{}</th>",
                        escape_xml(report.correlation_names[static_cast<size_t>(row)]));
    for (Eigen::Index column = 0; column < count; ++column) {
      const double value = report.correlation(row, column);
      const bool known = std::isfinite(value);
      html += fmt::format("<td class=\"number\" style=\"background:{}\">{}</td>",
                          diverging(known && row != column ? value : 0),
                          known ? typeset_number(fmt::format("{:.2f}", value)) : "–");
    }
    html += "</tr>\n";
  }
  return html + "</tbody></table></div>\n";
}

std::string search_section(const FitReport& report) {
  std::string content =
      figure(search_cost_svg(report.search_cost), "Cost of the best individual of the search.");
  const Table basins = basin_table(report.result);
  if (!basins.rows.empty())
    content += "<div class=\"wide\">" +
               html_table(basins,
                          "Basins: the places in which runs of the search, or refinements of its "
                          "best individuals, ended. The cost is the mean error over the search's "
                          "window, on its mesh. A second one as low as the first says that the "
                          "recording can be explained in two ways.") +
               "</div>\n";
  if (!report.stages.empty()) {
    content += "<ol class=\"stages\">\n";
    for (const std::string& stage : report.stages)
      content += fmt::format("<li>{}</li>\n", escape_xml(stage));
    content += "</ol>\n";
  }
  return content;
}

std::string observations_section(const FitReport& report) {
  const Table table = rejection_table(report.result);
  std::string content =
      paragraph(fmt::format("{} observations were used.", report.result.observations_used));
  if (table.rows.empty()) return content + paragraph("None was rejected.");
  return content + html_table(table, "Rejected, and never fitted:");
}

std::string model_section(const FitReport& report, const Recording& recording) {
  const FitResult& result = report.result;
  Table table{{"setting", "used"}, {}};
  const auto add = [&](const std::string& name, const std::string& value) {
    table.rows.push_back({name, value});
  };
  add("cloth", fmt::format("{} x {} m, {}", recording.cloth.width_m, recording.cloth.height_m,
                           recording.cloth.mass_kg ? fmt::format("{} kg", *recording.cloth.mass_kg)
                                                   : std::string("not weighed")));
  add("mesh", fmt::format("{} columns, {} rows", result.mesh_columns, result.mesh_rows));
  add("parameters", result.parameter_set);
  add("integrator", fmt::format("{}, {} steps per frame of {} ms", result.integrator,
                                result.substeps, significant(1000 * result.time_step_s, 3)));
  add("start", result.start);
  std::string effects;
  for (const EffectEstimate& effect : result.effects)
    effects += (effects.empty() ? "" : ", ") + effect.name;
  add("effects beyond springs and weight", effects.empty() ? "none" : effects);
  add("origin of the recording", recording.origin.empty() ? "not stated" : recording.origin);
  return html_table(table, "");
}

std::string words_section() {
  return "<dl>\n"
         "<dt>rms per coordinate</dt><dd>Root of the mean squared difference between predicted and "
         "observed place, taken over single coordinates. Over whole points it is √2 (pixels) or "
         "√3 (space) times that.</dd>\n"
         "<dt>held out</dt><dd>Frames that neither the fit nor any choice in it has seen. The "
         "simulation runs on into them from its start; they are compared once.</dd>\n"
         "<dt>noise</dt><dd>Standard deviation of the measurement itself. No model can do better "
         "on average.</dd>\n"
         "<dt>sigma</dt><dd>One standard deviation of a parameter, given this model and the "
         "measured noise. What the model lacks counts as far as it differs over the cloth.</dd>\n"
         "<dt>90 %</dt><dd>The interval that would hold the value in 90 of 100 such recordings, as "
         "far as sigma is right.</dd>\n"
         "<dt>fitted</dt><dd>Estimated from these data.</dd>\n"
         "<dt>fixed</dt><dd>Given, not estimated.</dd>\n"
         "<dt>ratio</dt><dd>Estimated as a ratio to the mass per area, for the cloth was not "
         "weighed.</dd>\n"
         "<dt>model does not fit</dt><dd>The model leaves so much of the data that no interval of "
         "this number would be true.</dd>\n"
         "<dt>floor</dt><dd>What no model on this mesh can do better than: the noise, and what "
         "mesh "
         "and time step make, added in square.</dd>\n"
         "<dt>undetermined</dt><dd>These data allow any value in a wide range; the reason stands "
         "beside it, and the value is not a measurement.</dd>\n"
         "<dt>tension, shear, flexion</dt><dd>Stiffness of the springs between neighbours, across "
         "the diagonal, and between second neighbours, in N/m for the mesh used here.</dd>\n"
         "<dt>warp, weft</dt><dd>Along t (down the cloth) and along s (across it).</dd>\n"
         "</dl>\n";
}

}  // namespace

std::string fit_page_html(const FitReport& report, const Recording& recording,
                          const std::vector<BackgroundPicture>& pictures) {
  std::string body = heading(report);
  if (!report.message.empty())
    body += fmt::format("<p class=\"meta\">{}</p>\n", escape_xml(report.message));
  Table rest;
  const Table estimated = estimated_parameter_table(report.result, rest);
  body +=
      section("Parameters",
              html_table(estimated, "Value with one standard deviation, given the model below.") +
                  (rest.rows.empty() ? ""
                                     : folded("How it was placed and measured, and what was given",
                                              html_table(rest, ""))));
  body += section("Errors", errors_section(report));
  body += section("Where and when it is off", figures_of(report, recording, pictures));
  if (const std::string correlations = correlation_section(report); !correlations.empty())
    body +=
        section("Which parameters trade against each other", folded("Correlations", correlations));
  body += section("Observations", observations_section(report));
  body += section("Model", model_section(report, recording));
  body += section("Search", folded("Runs, basins and stages", search_section(report)));
  body += section("What the words mean", words_section());
  body += section("Do it again",
                  fmt::format("<pre>{}</pre>\n<p>The same input, seed and version give the same "
                              "numbers; they stand in fit.json, parameters.csv, errors.csv and "
                              "residuals.csv beside this page.</p>\n",
                              escape_xml(report.result.command)));
  return html_page("clothfit: fit of " + report.result.recording, body);
}

std::string overlay_svg(const FitReport& report, const Recording& recording,
                        const std::vector<BackgroundPicture>& pictures) {
  if (report.residuals.empty()) return "";
  return observed_and_predicted_svg(report.residuals.front(), recording, pictures);
}

}  // namespace clothfit
