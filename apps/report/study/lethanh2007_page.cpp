#include "apps/report/study/lethanh2007_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "apps/report/garment/step_curves.h"
#include "apps/report/page/html.h"
#include "apps/terminal/number_text.h"

namespace clothfit {
namespace {

std::string way_of(const GarmentRun& run) {
  return std::string(describe(run.method)) + (run.single ? ", at once" : ", over meshes");
}

/// Shows how a garment came to rest at each spacing.
std::string garment_html(const Lethanh2007Study& study, const Lethanh2007Options& options,
                         const std::string& garment) {
  std::string body;
  for (const double spacing_m : options.spacings_m) {
    std::vector<StepCurve> curves;
    for (const GarmentRun& run : study.runs)
      if (run.garment == garment && run.spacing_m == spacing_m)
        curves.push_back({way_of(run), &run.steps});
    if (curves.empty()) continue;
    const auto draw = [&](StepQuantity quantity) {
      return step_curves(curves, quantity, "the garment was sewn");
    };
    body += folded(
        fmt::format("{:g} mm", 1e3 * spacing_m),
        figure(draw(StepQuantity::spring_error), "Average spring error, edges of the mesh.") +
            figure(draw(StepQuantity::force), "Residual force on all particles over the weight."));
  }
  return section(garment, body);
}

std::string missing_html() {
  return section(
      "What cannot be compared",
      paragraph(
          "The paper's text as it is available has lost section 5's end, sections 6 and 7 and "
          "figure 5, which held its times and errors for each resolution. It gives no "
          "stiffness, no mass and no size of its shirt and skirt. So its claims are tested on "
          "the bundled garments, with stiffness chosen here, and its seconds are not set "
          "beside ours. Of figure 2 the caption is left: at a spacing of 10 mm, its single "
          "mesh took 80,000 seconds."));
}

}  // namespace

Table lethanh2007_runs(const Lethanh2007Study& study) {
  Table table;
  table.header = {"garment",      "spacing, mm", "particles", "method",
                  "seconds",      "iterations",  "energy, J", "average spring error, cm",
                  "force/weight", "crossings",   "inside",    "state"};
  for (const GarmentRun& run : study.runs)
    table.rows.push_back({run.garment, fmt::format("{:g}", 1e3 * run.spacing_m),
                          fmt::format("{}", run.particles), way_of(run),
                          fmt::format("{:.1f}", run.seconds), fmt::format("{}", run.iterations),
                          significant(run.energy_j, 5), significant(100 * run.spring_error_m, 3),
                          significant(run.imbalance, 2), fmt::format("{}", run.crossings),
                          fmt::format("{}", run.inside), run.at_rest ? "at rest" : "not at rest"});
  return table;
}

Table lethanh2007_correspondences(const Lethanh2007Study& study) {
  Table table;
  table.header = {"particles K", "triangles", "by boxes, s", "by all triangles, s"};
  for (const CorrespondenceTime& time : study.correspondences)
    table.rows.push_back({fmt::format("{}", time.particles), fmt::format("{}", time.triangles),
                          significant(time.by_boxes_s, 2),
                          time.by_all_s < 0 ? "not measured" : significant(time.by_all_s, 2)});
  return table;
}

Table lethanh2007_claims(const Lethanh2007Study& study) {
  Table table;
  table.header = {"the paper says", "measured", "so"};
  for (const PaperClaim& claim : paper_claims(study))
    table.rows.push_back({claim.claim, claim.measured, claim.verdict});
  return table;
}

std::string lethanh2007_page_html(const Lethanh2007Study& study, const Lethanh2007Options& options,
                                  const std::string& command, const std::string& version) {
  std::vector<std::string> garments;
  for (const GarmentRun& run : study.runs)
    if (std::ranges::find(garments, run.garment) == garments.end()) garments.push_back(run.garment);
  std::string curves;
  for (const std::string& garment : garments) curves += garment_html(study, options, garment);
  return html_page(
      "Le Thanh and Gagalowicz 2007",
      fmt::format("<h1>Le Thanh and Gagalowicz 2007</h1>\n<p class=\"meta\">clothfit {} · "
                  "<code>{}</code></p>\n",
                  escape_xml(version), escape_xml(command)) +
          paragraph(fmt::format(
              "Garments of springs (tension {:g}, shear {:g}, bending {:g} N/m, {:g} kg/m2) come "
              "to "
              "rest on the mannequin, to {:g} of their weight: by conjugate gradients as in the "
              "paper, by Newton steps, and by time steps of a sixtieth of a second; over meshes "
              "each half as wide, or on the finest at once.",
              options.springs.tension_n_per_m, options.springs.shear_n_per_m,
              options.springs.bending_n_per_m, options.springs.areal_density_kg_per_m2,
              options.tolerance)) +
          section("Claims", html_table(lethanh2007_claims(study), "")) +
          section("Runs", html_table(lethanh2007_runs(study),
                                     "Seconds from the sewn garment on. Iterations and energy are "
                                     "those of the finest mesh.")) +
          curves +
          section("Correspondences",
                  html_table(lethanh2007_correspondences(study),
                             "Each particle's triangle in a mesh twice as coarse.")) +
          missing_html());
}

}  // namespace clothfit
