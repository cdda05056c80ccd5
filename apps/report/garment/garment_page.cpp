#include "apps/report/garment/garment_page.h"

#include <fmt/format.h>

#include "apps/report/garment/step_curves.h"
#include "apps/report/page/html.h"
#include "apps/terminal/number_text.h"
#include "model/rest/equilibrium.h"

namespace clothfit {
namespace {

std::string curves_html(const GarmentDrape& drape) {
  std::vector<StepCurve> curves;
  for (const GarmentLevel& level : drape.levels)
    curves.push_back({fmt::format("{:g} mm", 1e3 * level.spacing_m), &level.steps});
  const auto draw = [&](StepQuantity quantity) {
    return step_curves(curves, quantity, "the draping began");
  };
  return figure(draw(StepQuantity::spring_error),
                "Average spring error: the mean difference between the length of an edge of the "
                "mesh and that in the flat cloth. Each mesh begins from the one before; sewing, "
                "before them, is not shown.") +
         figure(draw(StepQuantity::energy),
                "Energy of fabric, weight and contact, above what each mesh comes to rest with.") +
         figure(draw(StepQuantity::force),
                "Residual force on all particles, as a share of the garment's weight.");
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
