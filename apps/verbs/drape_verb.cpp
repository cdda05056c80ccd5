#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/terminal/csv_table.h"
#include "apps/terminal/exit_code.h"
#include "apps/terminal/interrupt.h"
#include "apps/terminal/json_file.h"
#include "apps/terminal/number_text.h"
#include "apps/terminal/progress_line.h"
#include "apps/terminal/result_folder.h"
#include "apps/terminal/say.h"
#include "apps/terminal/text_table.h"
#include "apps/verbs/drape_pattern.h"
#include "apps/verbs/measured_sheet.h"
#include "apps/verbs/verb.h"
#include "data/fabric_sheet.h"
#include "data/input_error.h"
#include "data/obj_mesh.h"
#include "data/shared_progress.h"
#include "fit/jobs/thread_limit.h"
#include "model/laboratory/cantilever.h"
#include "model/laboratory/cusick.h"
#include "model/laboratory/in_plane.h"
#include "model/rest/equilibrium.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct DrapeVerbOptions {
  std::string test;
  PatternRequest garment;
  fs::path fabric;
  CusickOptions cusick;
  std::optional<double> spacing_m;  ///< each has a default of its own
  unsigned long long seed = 1;
  int threads = 0;
  std::string formats = "obj";
  fs::path out;
};

/// What a test has found, for the terminal and for files.
struct Findings {
  std::string sentence;
  Table table;
  std::vector<std::string> notes;
  Json json;
  std::optional<SurfaceMesh> shape;
};

/// Throws unless a search for balance ended as it should.
void require(MinimiseReason reason, const std::string& what) {
  if (reason == MinimiseReason::cancelled) throw Cancelled();
  if (reason != MinimiseReason::converged)
    throw NoResult(fmt::format("{} found no balance: {}", what, describe(reason)));
}

std::function<bool()> until_interrupted() {
  return [] { return !interrupted(); };
}

std::string percent(double share) {
  return fmt::format("{:.1f} %", 100 * share);
}

/// Says how a measured drape coefficient compares, where the sheet has one.
void compare_with_measured(const FabricSheet& sheet, double predicted, Findings& findings) {
  if (!sheet.drape_coefficient) return;
  const double measured = sheet.drape_coefficient->value;
  findings.json["measured_coefficient"] = measured;
  findings.json["predicted_less_measured"] = predicted - measured;
  findings.sentence += fmt::format("\nMeasured: {}; predicted {:+.1f} points off, without any fit.",
                                   percent(measured), 100 * (predicted - measured));
}

Findings run_cusick(const FabricSheet& sheet, const DrapeVerbOptions& options) {
  CusickOptions cusick = options.cusick;
  cusick.seed = static_cast<unsigned>(options.seed);
  CusickResult result;
  {
    ProgressLine line;
    const ProgressCallback progress = for_threads(watch(line));
    cusick.go_on = [&](double share) {
      return progress({.stage = "draping", .done = 100 * share, .total = 100, .unit = "%"});
    };
    result = drape_cusick(measured(sheet), cusick);
  }
  if (interrupted()) throw Cancelled();
  if (result.usable == 0) require(result.drapes.front().reason, "no start");

  Findings findings;
  findings.table.header = {"start", "drape coefficient, %", "nodes", "energy, mJ", "state"};
  const Drape* lowest = nullptr;
  findings.json["drapes"] = Json::array();
  for (size_t n = 0; n < result.drapes.size(); ++n) {
    const Drape& drape = result.drapes[n];
    const bool usable = drape.usable();
    findings.table.rows.push_back(
        {fmt::format("{}", n + 1), usable ? fmt::format("{:.1f}", 100 * drape.coefficient) : "-",
         usable ? fmt::format("{}", drape.nodes) : "-",
         usable ? significant(1e3 * drape.energy_j, 4) : "-", describe(drape.reason)});
    findings.json["drapes"].push_back({{"usable", usable}, {"state", describe(drape.reason)}});
    if (!usable) continue;
    findings.json["drapes"].back().update(Json{{"coefficient", drape.coefficient},
                                               {"nodes", drape.nodes},
                                               {"energy_j", drape.energy_j},
                                               {"iterations", drape.iterations}});
    if (!lowest || drape.energy_j < lowest->energy_j) lowest = &drape;
  }
  const bool has_spread = result.usable > 1;
  findings.json["coefficient"] = result.mean_coefficient;
  if (has_spread) findings.json["spread_over_starts"] = result.spread_coefficient;
  findings.json["nodes"] = result.mean_nodes;
  findings.sentence = fmt::format(
      "{}: drape coefficient {}{}, {:.1f} nodes", sheet.name, percent(result.mean_coefficient),
      has_spread
          ? fmt::format(" ± {:.1f} over {} starts", 100 * result.spread_coefficient, result.usable)
          : "",
      result.mean_nodes);
  compare_with_measured(sheet, result.mean_coefficient, findings);
  if (result.usable < cusick.starts)
    findings.notes.push_back(fmt::format("{} of {} starts found no balance and do not count",
                                         cusick.starts - result.usable, cusick.starts));
  findings.notes.emplace_back("contact of the cloth with itself is not looked for");
  findings.shape = {.vertex_m = lowest->position_m, .triangle = result.mesh.triangles()};
  return findings;
}

Findings run_cantilever(const FabricSheet& sheet) {
  CantileverOptions options;
  options.go_on = until_interrupted();
  Findings findings;
  findings.table.header = {"along",     "overhang, mm",   "bending length, mm",
                           "sigma, mm", "rigidity, uN m", "from the sheet, uN m"};
  for (const auto& [name, direction, bending] :
       {std::tuple{"warp", ThreadDirection::warp, sheet.bending_n_m.warp},
        {"weft", ThreadDirection::weft, sheet.bending_n_m.weft}}) {
    const CantileverResult result = bend_cantilever(measured(sheet), direction, options);
    require(result.reason, fmt::format("the strip along the {}", name));
    // The overhang grows with the cube root of the rigidity over the weight.
    std::optional<double> sigma_m;
    const SheetNumber& density = sheet.areal_density_kg_per_m2;
    if (bending.sigma || density.sigma)
      sigma_m = result.bending_length_m / 3 *
                std::hypot(bending.sigma.value_or(0) / bending.value,
                           density.sigma.value_or(0) / density.value);
    findings.table.rows.push_back({name, significant(1e3 * result.overhang_m, 4),
                                   significant(1e3 * result.bending_length_m, 4),
                                   sigma_m ? significant(1e3 * *sigma_m, 2) : "-",
                                   significant(1e6 * result.bending_n_m, 4),
                                   significant(1e6 * bending.value, 4)});
    findings.json[name] = {{"overhang_m", result.overhang_m},
                           {"bending_length_m", result.bending_length_m},
                           {"bending_n_m", result.bending_n_m}};
    if (sigma_m) findings.json[name]["bending_length_sigma_m"] = *sigma_m;
  }
  findings.sentence = fmt::format("{}: overhang of a strip at 41.5 degrees", sheet.name);
  return findings;
}

/// Adds the points of a curve, and its first stiffness, as a row of its own kind.
void add_curve(const std::string& name, const LoadCurve& curve, double scale,
               const std::string& unit, double from_sheet, Findings& findings) {
  findings.json[name] = {{"deformation", curve.deformation},
                         {"force_n_per_m", curve.force_n_per_m},
                         {"stiffness_n_per_m", curve.stiffness_n_per_m}};
  findings.table.rows.push_back(
      {name, significant(curve.stiffness_n_per_m, 4), significant(from_sheet, 4),
       fmt::format("{} N/m at {} {}", significant(curve.force_n_per_m.back(), 3),
                   significant(scale * curve.deformation.back(), 2), unit)});
}

Findings run_tensile(const FabricSheet& sheet) {
  StripTensionOptions options;
  options.go_on = until_interrupted();
  Findings findings;
  findings.table.header = {"along", "stiffness, N/m", "from the sheet, N/m", "largest load"};
  for (const auto& [name, direction, tension] :
       {std::tuple{"warp", ThreadDirection::warp, sheet.tension_n_per_m.warp},
        {"weft", ThreadDirection::weft, sheet.tension_n_per_m.weft}}) {
    const LoadCurve curve = stretch_strip(measured(sheet), direction, options);
    require(curve.reason, fmt::format("the strip along the {}", name));
    add_curve(name, curve, 100, "%", tension.value, findings);
    findings.json[name]["lateral_contraction"] = curve.lateral_contraction;
  }
  findings.sentence = fmt::format("{}: strip of {:g} x {:g} mm between clamps", sheet.name,
                                  1e3 * options.width_m, 1e3 * options.length_m);
  findings.notes.emplace_back(
      "the sheet's tension counts as that of cloth whose width is kept; a free strip is softer");
  return findings;
}

Findings run_shear(const FabricSheet& sheet) {
  PictureFrameOptions options;
  options.go_on = until_interrupted();
  const LoadCurve curve = shear_frame(measured(sheet), options);
  require(curve.reason, "the picture frame");
  Findings findings;
  findings.table.header = {"test", "stiffness, N/m per radian", "from the sheet", "largest load"};
  add_curve("shear", curve, 180 / 3.14159265358979323846, "degrees", sheet.shear_n_per_m.value,
            findings);
  findings.sentence = fmt::format("{}: picture frame of {:g} mm", sheet.name, 1e3 * options.side_m);
  return findings;
}

Json fabric_json(const FabricSheet& sheet) {
  const MeasuredFabric fabric = measured(sheet);
  const SpringConversion conversion = measured_springs(fabric);
  Json json{{"name", sheet.name},
            {"units_of_file", to_string(sheet.units)},
            {"areal_density_kg_per_m2", fabric.areal_density_kg_per_m2},
            {"tension_warp_n_per_m", fabric.tension_warp_n_per_m},
            {"tension_weft_n_per_m", fabric.tension_weft_n_per_m},
            {"shear_n_per_m", fabric.shear_n_per_m},
            {"bending_warp_n_m", fabric.bending_warp_n_m},
            {"bending_weft_n_m", fabric.bending_weft_n_m}};
  json["as_springs"] = {{"tension_warp_n_per_m", conversion.fabric.tension_warp_n_per_m},
                        {"tension_weft_n_per_m", conversion.fabric.tension_weft_n_per_m},
                        {"shear_n_per_m", conversion.fabric.shear_n_per_m},
                        {"bending_energy_n_m", conversion.bending_n_m},
                        {"bending_warp_off", conversion.bending_warp_off},
                        {"bending_weft_off", conversion.bending_weft_off},
                        {"free_strip_softer_warp", conversion.fibres.free_strip_softer_warp},
                        {"free_strip_softer_weft", conversion.fibres.free_strip_softer_weft}};
  return json;
}

int run_test(const DrapeVerbOptions& options, const std::string& command) {
  require_threads(options.threads);
  const ThreadLimit limit(options.threads);
  const FabricSheet sheet = read_fabric_sheet(options.fabric);
  ResultFolder out(out_folder(options.out, options.fabric.stem().string() + "." + options.test),
                   {options.fabric});
  Findings findings = options.test == "cusick"       ? run_cusick(sheet, options)
                      : options.test == "cantilever" ? run_cantilever(sheet)
                      : options.test == "tensile"    ? run_tensile(sheet)
                                                     : run_shear(sheet);
  if (sheet.bending_hysteresis_n || sheet.shear_hysteresis_n_per_m)
    findings.notes.emplace_back("the sheet's hysteresis is read, but not simulated yet");
  Json json{{"format", "clothfit-drape/1"}, {"command", command}, {"test", options.test}};
  json["fabric"] = fabric_json(sheet);
  json.update(findings.json);
  json["notes"] = findings.notes;
  write_json(json, out.path() / "drape.json");
  write_csv_table(findings.table, out.path() / "drape.csv");
  if (findings.shape) write_obj(*findings.shape, out.path() / "drape.obj");
  out.publish();

  say("\n{}\n\n{}", findings.sentence, text_table(findings.table));
  for (const std::string& note : findings.notes) say("\nNote: {}.\n", note);
  say("\nResult: {}\n", shown_path(out.final_path() / "drape.json"));
  return kExitGood;
}

/// Refuses options that the request has no use for.
void refuse_given(const Verb& verb, const std::vector<std::string>& names,
                  const std::string& what) {
  for (const std::string& name : names)
    if (verb.is_given(name)) throw InputError(name, "is given with " + what, "none of it there");
}

int run_drape(DrapeVerbOptions options, const Verb& verb) {
  const std::string command = verb.command_text();
  if (options.test.empty() == options.garment.pattern.empty())
    throw InputError("drape",
                     options.test.empty() ? "no pattern and no --test" : "a pattern and a --test",
                     "a pattern to sew or a test of a fabric",
                     "clothfit drape data/patterns/skirt.yaml, or clothfit drape --test cusick "
                     "--fabric data/fabrics/shirting.yaml");
  if (options.test.empty()) {
    refuse_given(verb, {"--specimen", "--disc", "--starts", "--seed"}, "a pattern");
    require_threads(options.threads);
    const ThreadLimit limit(options.threads);
    options.garment.formats = *parse_garment_formats(options.formats);
    options.garment.fabric = options.fabric;
    options.garment.out = options.out;
    options.garment.options.spacing_m =
        options.spacing_m.value_or(options.garment.options.spacing_m);
    return drape_pattern(options.garment, command);
  }
  refuse_given(verb, {"--body", "--hold-off", "--self-distance", "--format", "--tolerance"},
               "--test");
  if (options.fabric.empty())
    throw InputError("--fabric", "is missing", "the data sheet of the fabric to test");
  options.cusick.spacing_m = options.spacing_m.value_or(options.cusick.spacing_m);
  return run_test(options, command);
}

}  // namespace

void add_drape_verb(Verb program) {
  const auto options = std::make_shared<DrapeVerbOptions>();
  Verb verb = program.add_verb(
      "drape", "Sew and drape a pattern, or simulate a laboratory's test of a fabric");
  verb.add_option("PATTERN", &options->garment.pattern,
                  "Sewing pattern: ours (YAML) or a specification of GarmentCode (JSON)");
  verb.add_option(
          "--body", &options->garment.body,
          "Closed surface (OBJ, PLY) to sew it around; the bundled mannequin where left out")
      .type_name("BODY");
  verb.add_option("--fabric", &options->fabric,
                  "Data sheet of the fabric; of all panels, in place of those a pattern names")
      .type_name("FABRIC.yaml");
  verb.add_option("--hold-off", &options->garment.options.hold_off_m,
                  "Distance at which cloth begins to feel the body (m)")
      .is_length()
      .shows_default();
  verb.add_option("--self-distance", &options->garment.options.self_distance_m,
                  "Distance at which cloth begins to feel itself (m); 0: not looked for")
      .is_length()
      .shows_default();
  verb.add_option("--format", &options->formats,
                  "What to write of a garment: obj, which always is, ply, pc2, gltf")
      .type_name("LIST")
      .shows_default()
      .check([](const std::string& text) {
        return parse_garment_formats(text)
                   ? std::string()
                   : "'" + text + "' is not a list of obj, ply, pc2 and gltf";
      });
  verb.add_option("--tolerance", &options->garment.options.tolerance,
                  "Residual force of a garment that counts as rest, as a share of its weight")
      .shows_default();
  verb.add_option("--test", &options->test,
                  "Instead of a pattern. cusick: drape of a disc; cantilever: bending; tensile: a "
                  "strip; shear: a picture frame")
      .one_of({"cusick", "cantilever", "tensile", "shear"});
  verb.add_option("--specimen", &options->cusick.specimen_diameter_m,
                  "Diameter of the specimen of cusick: 24cm, 30cm or 36cm in the standards (m)")
      .is_length()
      .shows_default();
  verb.add_option("--disc", &options->cusick.disc_diameter_m, "Diameter of its disc (m)")
      .is_length()
      .shows_default();
  verb.add_option("--spacing", &options->spacing_m,
                  "Spacing of the mesh (m): 20mm of a garment, 5mm of cusick")
      .is_length();
  verb.add_option("--starts", &options->cusick.starts, "Drapes from different unevenness")
      .shows_default();
  verb.add_option("--seed", &options->seed, "Seed of the unevenness")
      .check(check_seed)
      .shows_default();
  verb.add_option("--threads", &options->threads, "Threads; 0 for as many as the machine has")
      .shows_default()
      .shapes_no_result();
  add_out_option(verb, options->out, "PATTERN.drape or FABRIC.TEST");
  verb.footer(
      "Examples:\n  clothfit drape data/patterns/skirt.yaml\n"
      "  clothfit drape --test cusick --fabric data/fabrics/shirting.yaml");
  verb.runs([options, verb] { return run_drape(*options, verb); });
}

}  // namespace clothfit
