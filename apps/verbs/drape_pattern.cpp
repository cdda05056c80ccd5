#include "apps/verbs/drape_pattern.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "apps/terminal/csv_table.h"
#include "apps/terminal/exit_code.h"
#include "apps/terminal/interrupt.h"
#include "apps/terminal/json_file.h"
#include "apps/terminal/number_text.h"
#include "apps/terminal/progress_line.h"
#include "apps/terminal/result_folder.h"
#include "apps/terminal/say.h"
#include "apps/terminal/text_table.h"
#include "apps/verbs/garment_files.h"
#include "apps/verbs/measured_sheet.h"
#include "data/fabric_sheet.h"
#include "data/input_error.h"
#include "data/pattern_file.h"
#include "data/ply_mesh.h"
#include "data/program_version.h"
#include "data/text_file.h"
#include "model/garment/mannequin.h"
#include "model/rest/equilibrium.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

std::vector<FabricSheet> sheets_of(const Pattern& pattern, const fs::path& fabric) {
  std::vector<FabricSheet> sheets;
  for (size_t n = 0; n < pattern.fabrics.size(); ++n) {
    const fs::path& file = fabric.empty() ? pattern.fabric_files[n] : fabric;
    if (file.empty())
      throw InputError(pattern.file,
                       fmt::format("it names no data sheet of {}", pattern.fabrics[n]),
                       "a data sheet of each fabric",
                       "name one for all with --fabric, such as data/fabrics/shirting.yaml");
    if (fabric.empty() && !fs::exists(file))
      throw InputError(pattern.file,
                       fmt::format("its fabric {} names {}, which is not there", pattern.fabrics[n],
                                   shown_path(file)),
                       "a data sheet, named relative to the pattern's folder",
                       "put it there, or name one for all with --fabric");
    sheets.push_back(read_fabric_sheet(file));
  }
  return sheets;
}

TriangleMesh read_body(const fs::path& file) {
  if (file.empty()) return make_mannequin();
  SurfaceMesh mesh = read_surface(file);
  const double span_m =
      (mesh.vertex_m.rowwise().maxCoeff() - mesh.vertex_m.rowwise().minCoeff()).maxCoeff();
  if (constexpr double kLargestBody_m = 10; span_m > kLargestBody_m)
    throw InputError(file.string(), fmt::format("it spans {:.4g} m", span_m),
                     fmt::format("a body in metres, {:g} at most", kLargestBody_m),
                     "scale it, by 0.01 from centimetres, 0.001 from millimetres");
  return {.vertex_m = std::move(mesh.vertex_m), .triangle = std::move(mesh.triangle)};
}

std::string seam_text(const Pattern& pattern, int seam) {
  const auto& [one, other] = pattern.seams[static_cast<size_t>(seam)].sides;
  return fmt::format("the seam of {} and {}", pattern.panels[static_cast<size_t>(one.panel)].name,
                     pattern.panels[static_cast<size_t>(other.panel)].name);
}

GarmentDrape drape_with_progress(const Pattern& pattern, const std::vector<FabricSheet>& sheets,
                                 const Obstacle& body, const fs::path& body_file,
                                 GarmentOptions options) {
  std::vector<MeasuredFabric> fabrics;
  for (const FabricSheet& sheet : sheets) fabrics.push_back(measured(sheet));
  ProgressLine line;
  const ProgressCallback progress = watch(line);
  options.coarsest_m = std::max(options.coarsest_m, options.spacing_m);
  options.go_on = [&](const GarmentProgress& now) {
    return progress(
        {.stage =
             fmt::format("{} at {:g} mm", now.sewing ? "sewing" : "draping", 1e3 * now.spacing_m),
         .done = static_cast<double>(now.iteration),
         .total = 0,
         .unit = "steps",
         .note = now.sewing ? fmt::format("widest gap {:.1f} mm", 1e3 * now.widest_gap_m)
                            : fmt::format("imbalance {:.2g} of the weight", now.imbalance)});
  };
  try {
    return drape_garment(pattern, fabrics, &body, options);
  } catch (const InputError& error) {
    if (error.where() == "body")
      throw InputError(body_file.string(), error.problem(), error.expected(), error.remedy());
    for (const Panel& panel : pattern.panels)
      if (error.where() == "panels." + panel.name)
        throw InputError(pattern.file, std::max(panel.line, 1),
                         fmt::format("panel {}: {}", panel.name, error.problem()), error.expected(),
                         error.remedy());
    throw;
  }
}

/// Throws unless the garment came to rest.
void require_rest(const Pattern& pattern, const GarmentDrape& drape,
                  const GarmentOptions& options) {
  switch (drape.state) {
    case GarmentState::at_rest:
      return;
    case GarmentState::cancelled:
      throw Cancelled();
    case GarmentState::not_sewn:
      throw NoResult(fmt::format(
          "{} stays open by {:.1f} mm, however hard its thread pulls: a panel caught on the wrong "
          "side of the body, or a garment too tight for it; place the panels so that nothing lies "
          "between the sides of a seam",
          seam_text(pattern, drape.widest_seam), 1e3 * drape.widest_gap_m));
    case GarmentState::too_tight:
      throw NoResult(fmt::format(
          "{:.0f} % of the cloth would be stretched by more than half to close the seams: the "
          "garment is too tight for the body; give it more width, and check the units of pattern "
          "and body",
          100 * drape.stretched_share));
    case GarmentState::inside_body:
      throw NoResult(fmt::format(
          "{} places of the cloth end inside the body, the deepest by {:.1f} mm: the garment is "
          "too "
          "tight for it, or parts of the body thinner than a centimetre came through; give "
          "the garment more width, or place its panels so that they close around the body",
          drape.inside, 1e3 * drape.deepest_m));
    case GarmentState::not_at_rest:
      throw NoResult(fmt::format(
          "the garment found no rest within {} steps on a mesh of {:g} mm: {}, residual force "
          "{:.2g} "
          "of the weight; it may be sliding off the body (there is no friction), or try a larger "
          "--tolerance or --spacing",
          options.most_iterations, 1e3 * drape.mesh.cloth.spacing_m,
          describe(drape.levels.back().work.reason), drape.imbalance));
  }
}

/// Returns what the simulation leaves out.
std::vector<std::string> not_counted(const std::vector<FabricSheet>& sheets,
                                     const GarmentOptions& options) {
  std::vector<std::string> notes{"friction, of the body and of the cloth with itself"};
  if (options.self_distance_m == 0) notes.emplace_back("contact of the cloth with itself");
  if (std::ranges::any_of(sheets, [](const FabricSheet& sheet) {
        return sheet.bending_hysteresis_n || sheet.shear_hysteresis_n_per_m;
      }))
    notes.emplace_back("the sheets' hysteresis, which is read");
  return notes;
}

Json garment_json(const Pattern& pattern, const std::vector<FabricSheet>& sheets,
                  const GarmentDrape& drape) {
  Json json{{"format", "clothfit-garment/1"},
            {"command", nullptr},
            {"pattern", pattern.name},
            {"panels", pattern.panels.size()},
            {"seams", pattern.seams.size()},
            {"fabrics", Json::array()},
            {"weight_n", drape.weight_n},
            {"imbalance", drape.imbalance},
            {"places_inside_body", drape.inside},
            {"widest_gap_when_sewn_m", drape.widest_gap_m},
            {"levels", Json::array()}};
  for (const FabricSheet& sheet : sheets) json["fabrics"].push_back(sheet.name);
  for (const GarmentLevel& level : drape.levels)
    json["levels"].push_back({{"spacing_m", level.spacing_m},
                              {"particles", level.particles},
                              {"triangles", level.triangles},
                              {"steps", level.work.iterations},
                              {"energy_j", level.work.energy_j},
                              {"residual_force_n", level.work.gradient_n},
                              {"state", describe(level.work.reason)}});
  return json;
}

}  // namespace

int drape_pattern(const PatternRequest& request, const std::string& command) {
  const Pattern pattern = read_pattern(request.pattern);
  const std::vector<FabricSheet> sheets = sheets_of(pattern, request.fabric);
  const TriangleMesh body_mesh = read_body(request.body);
  std::vector<fs::path> inputs{request.pattern};
  for (const fs::path& file : {request.body, request.fabric})
    if (!file.empty()) inputs.push_back(file);
  if (request.fabric.empty())
    inputs.insert(inputs.end(), pattern.fabric_files.begin(), pattern.fabric_files.end());
  inputs.insert(inputs.end(), pattern.drawing_files.begin(), pattern.drawing_files.end());
  ResultFolder out(out_folder(request.out, request.pattern.stem().string() + ".drape"), inputs);
  const Obstacle body(body_mesh);
  GarmentOptions options = request.options;
  options.keep_shapes = want_shapes(request.formats);
  const GarmentDrape drape = drape_with_progress(pattern, sheets, body, request.body, options);
  require_rest(pattern, drape, request.options);

  const Table table = garment_levels(drape);
  const std::vector<std::string> notes = not_counted(sheets, request.options);
  Json json = garment_json(pattern, sheets, drape);
  json["command"] = command;
  json["crossings"] = nullptr;
  if (request.options.self_distance_m > 0) json["crossings"] = drape.crossings;
  json["not_counted"] = notes;
  write_json(json, out.path() / "garment.json");
  write_csv_table(table, out.path() / "garment.csv");
  const std::string summary = fmt::format(
      "{} panels, {} seams, {:.0f} g; at rest to {:.2g} of its weight, {} of its edges through "
      "itself, {} places inside the body.",
      pattern.panels.size(), pattern.seams.size(), 1e3 * drape.weight_n / kGravity_m_per_s2,
      drape.imbalance,
      request.options.self_distance_m > 0 ? fmt::format("{}", drape.crossings) : "unknown how many",
      drape.inside);
  const std::vector<GarmentPicture> pictures = write_garment_files(
      drape, {body_mesh.vertex_m, body_mesh.triangle}, request.formats, out.path());
  write_text(garment_page_html(drape, {.title = pattern.name,
                                       .summary = summary,
                                       .pictures = pictures,
                                       .notes = notes,
                                       .command = command,
                                       .version = program_version()}),
             out.path() / "report.html");
  out.publish();

  say("\n{}: {}\n\n{}", pattern.name, summary, text_table(table));
  for (const std::string& note : notes) say("\nNot counted: {}.\n", note);
  say("\nReport: {}\n", shown_path(out.final_path() / "report.html"));
  return kExitGood;
}

}  // namespace clothfit
