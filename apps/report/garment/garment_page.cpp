#include "apps/report/garment/garment_page.h"

#include <fmt/format.h>

#include "apps/report/page/html.h"
#include "apps/report/page/svg.h"
#include "apps/terminal/number_text.h"
#include "model/rest/equilibrium.h"

namespace clothfit {
namespace {

/// Draws a quantity of every mesh's steps against the time since the draping began.
template <class Value>
std::string curves(const GarmentDrape& drape, LinePlot plot, const Value& value) {
  const char* const colours[] = {"#1b6ca8", "#d1495b", "#2a9d57", "#8a5fb0", "#c98a1b"};
  const char* const dashes[] = {"", "6 3", "2 3", "8 3 2 3", "4 2"};
  size_t number = 0;
  for (const GarmentLevel& level : drape.levels) {
    Series series{.label = fmt::format("{:g} mm", 1e3 * level.spacing_m),
                  .x = {},
                  .y = {},
                  .style = {.colour = colours[number % 5], .dashes = dashes[number % 5]}};
    ++number;
    for (const GarmentStep& step : level.steps) {
      series.x.push_back(step.seconds);
      series.y.push_back(value(step, level));
    }
    plot.series.push_back(std::move(series));
  }
  plot.x_label = "seconds since the draping began";
  return line_plot(plot);
}

std::string curves_html(const GarmentDrape& drape) {
  const std::string errors = curves(
      drape,
      {.title = "Average spring error",
       .description = "Mean change of the edges' lengths against time, for each mesh.",
       .x_label = "",
       .y_label = "average spring error (cm)",
       .series = {},
       .band = std::nullopt,
       .level = std::nullopt},
      [](const GarmentStep& step, const GarmentLevel&) { return 100 * step.spring_error_m; });
  const std::string energies =
      curves(drape,
             {.title = "Energy",
              .description = "Energy above that at rest against time, for each mesh.",
              .x_label = "",
              .y_label = "energy above that at rest (J)",
              .log_y = true,
              .series = {},
              .band = std::nullopt,
              .level = std::nullopt},
             [](const GarmentStep& step, const GarmentLevel& level) {
               return step.energy_j - level.work.energy_j;
             });
  const std::string forces =
      curves(drape,
             {.title = "Residual force",
              .description = "Residual force over weight against time, for each mesh.",
              .x_label = "",
              .y_label = "residual force / weight",
              .log_y = true,
              .series = {},
              .band = std::nullopt,
              .level = std::nullopt},
             [](const GarmentStep& step, const GarmentLevel&) { return step.imbalance; });
  return figure(errors,
                "Average spring error: the mean difference between the length of an edge of the "
                "mesh and that in the flat cloth. Each mesh begins from the one before; sewing, "
                "before them, is not shown.") +
         figure(energies,
                "Energy of fabric, weight and contact, above what each mesh comes to rest with.") +
         figure(forces, "Residual force on all particles, as a share of the garment's weight.");
}

}  // namespace

Table garment_levels(const GarmentDrape& drape) {
  Table table;
  table.header = {"spacing, mm",
                  "particles",
                  "triangles",
                  "steps",
                  "energy, J",
                  "residual force, N",
                  "average spring error, cm",
                  "state"};
  for (const GarmentLevel& level : drape.levels)
    table.rows.push_back(
        {fmt::format("{:g}", 1e3 * level.spacing_m), fmt::format("{}", level.particles),
         fmt::format("{}", level.triangles), fmt::format("{}", level.work.iterations),
         significant(level.work.energy_j, 5), significant(level.work.gradient_n, 2),
         level.steps.empty() ? "" : significant(100 * level.steps.back().spring_error_m, 3),
         describe(level.work.reason)});
  return table;
}

std::string garment_page_html(const GarmentDrape& drape, const GarmentPage& page) {
  std::string looks = "<div style=\"display: flex; flex-wrap: wrap; gap: 1rem\">\n";
  for (const GarmentPicture& picture : page.pictures)
    looks += fmt::format(
        "<figure style=\"flex: 1 1 12rem\">\n<img src=\"{}\" alt=\"{}\" "
        "style=\"width: 100%\">\n<figcaption>{}</figcaption>\n</figure>\n",
        data_uri("image/png", picture.png), escape_xml(page.title + " from the " + picture.name),
        escape_xml(picture.name));
  looks += "</div>\n";
  std::string notes;
  for (const std::string& note : page.notes) notes += paragraph("Not counted: " + note + ".");
  return html_page(
      page.title,
      fmt::format("<h1>{}</h1>\n<p class=\"meta\">clothfit {} · <code>{}</code></p>\n",
                  escape_xml(page.title), escape_xml(page.version), escape_xml(page.command)) +
          paragraph(page.summary) + section("Pictures", page.pictures.empty() ? "" : looks) +
          section("Meshes", html_table(garment_levels(drape),
                                       "Each mesh begins from the shape "
                                       "of the one before.")) +
          section("Curves", curves_html(drape)) + section("Limits", notes));
}

}  // namespace clothfit
