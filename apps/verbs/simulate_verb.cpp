#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "apps/terminal/exit_code.h"
#include "apps/terminal/interrupt.h"
#include "apps/terminal/json_file.h"
#include "apps/terminal/number_text.h"
#include "apps/terminal/progress_line.h"
#include "apps/terminal/result_folder.h"
#include "apps/terminal/say.h"
#include "apps/terminal/text_table.h"
#include "apps/verbs/requested_model.h"
#include "apps/verbs/simulation_files.h"
#include "apps/verbs/verb.h"
#include "data/input_error.h"
#include "data/number_text.h"
#include "data/program_version.h"
#include "fit/preflight/obstacle_checks.h"
#include "fit/preflight/preflight.h"
#include "fit/problem/memory_limits.h"
#include "fit/problem/simulation.h"
#include "fit/problem/time_steps.h"
#include "fit/problem/work_limits.h"
#include "model/cloth/stability.h"
#include "model/fabric/fabric_conversion.h"
#include "model/integrate/divergence.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// More files make a folder that few programs open.
constexpr size_t kMostObjFiles = 100'000;

struct SimulateVerbOptions {
  ModelRequest request;
  std::optional<double> time_step_s;
  bool allow_unstable = false;
  std::vector<SimulationFormat> formats;
  fs::path out;
};

/// The time step of a run, and the reason for it.
struct StepChoice {
  double time_step_s = 0;  ///< at most this
  double stable_s = 0;     ///< largest stable one
  std::string source;      ///< "stability", "model" or "--time-step"
  int substeps = 0;        ///< in the longest frame interval
  double steps = 0;        ///< in all, the relaxation of a start at rest left out
  double longest_s = 0;    ///< of the steps taken: frame intervals are cut evenly
  bool stable() const { return longest_s < stable_s; }
};

StepChoice choose_step(const Simulation& simulation, const ModelDescription& model,
                       const std::optional<double>& asked_s) {
  StepChoice choice;
  choice.stable_s = stable_time_step_s(simulation.cloth, simulation.parameters);
  choice.source = asked_s ? "--time-step" : model.time_step_s ? "model" : "stability";
  choice.time_step_s = asked_s             ? *asked_s
                       : model.time_step_s ? *model.time_step_s
                                           : default_time_step_s(simulation);
  const Schedule schedule{.frame_time_s = simulation.frame_time_s,
                          .time_step_s = choice.time_step_s};
  choice.steps = schedule.all_steps();
  for (size_t f = 1; f < schedule.frame_time_s.size(); ++f) {
    const int substeps = schedule.substeps(static_cast<int>(f));
    const double interval_s = schedule.frame_time_s[f] - schedule.frame_time_s[f - 1];
    choice.substeps = std::max(choice.substeps, substeps);
    choice.longest_s = std::max(choice.longest_s, interval_s / substeps);
  }
  return choice;
}

/// Writes three digits, never above the value: a step that is read off the message is a stable one.
std::string rounded_down(double value) {
  const double digit = std::pow(10, std::floor(std::log10(value)) - 2);
  return significant(std::floor(value / digit * (1 + 1e-12)) * digit, 3);
}

void require_possible(const StepChoice& choice, const Simulation& simulation,
                      const ModelDescription& model, bool allow_unstable) {
  const std::string where = choice.source == "model"         ? model.where(model.time_step_line)
                            : choice.source == "--time-step" ? choice.source
                                                             : model.where(model.fabric_line);
  if (choice.time_step_s < choice.stable_s / (kFinestStep * kStabilityMargin))
    throw InputError(
        where,
        fmt::format("steps of {} s are {:.2g} times as fine as stability asks for",
                    significant(choice.time_step_s, 3), choice.stable_s / choice.time_step_s),
        fmt::format("at most {:.0f} times", kFinestStep * kStabilityMargin),
        fmt::format("a step near {} s, or leave it out",
                    rounded_down(choice.stable_s / kStabilityMargin)));
  const TimeSteps steps =
      time_steps_of_run(simulation.cloth, simulation.parameters, choice.time_step_s);
  require_affordable_run(
      work_of_run(simulation.cloth, simulation.frame_time_s, steps,
                  simulation.start == StartKind::at_rest, model.gravity_m_per_s2.norm()),
      where, "a shorter duration, a coarser mesh, or softer springs");
  if (!choice.stable() && !allow_unstable) {
    throw InputError(
        where, fmt::format("steps of {} s would be unstable", significant(choice.longest_s, 3)),
        fmt::format("at most {} s for this cloth and these springs", rounded_down(choice.stable_s)),
        fmt::format("--time-step {}, or leave it out; --allow-unstable runs it all the same",
                    rounded_down(choice.stable_s)));
  }
}

/// Throws InputError for frames that fit into no memory, or no folder.
void require_room(const Simulation& simulation, const ModelDescription& model,
                  const std::vector<SimulationFormat>& formats) {
  const auto wants = [&](SimulationFormat format) {
    return std::ranges::find(formats, format) != formats.end();
  };
  const size_t frames = simulation.frame_time_s.size();
  const int vertices = simulation.cloth.mesh.vertex_count();
  // A frame's positions, and its part of a file that is made whole before it is written.
  const double own = 3 * sizeof(double);
  const double of_file = wants(SimulationFormat::pc2) || wants(SimulationFormat::gltf) ? own : 0;
  require_memory((own + of_file) * static_cast<double>(frames) * vertices, model.where(0),
                 fmt::format("{} frames of {} vertices", frames, vertices),
                 "a lower frame rate, a shorter duration, or a coarser mesh");
  if (wants(SimulationFormat::obj) && frames > kMostObjFiles)
    throw InputError("--format", fmt::format("obj would write {} files", frames),
                     fmt::format("at most {}", kMostObjFiles),
                     "another format, such as csv or pc2, or a lower frame rate");
}

std::string node_text(const Mesh& mesh, int vertex) {
  return fmt::format("[{}, {}]", vertex / mesh.columns, vertex % mesh.columns);
}

/// Says for a person why there is no simulation.
std::string divergence_text(const Divergence& divergence, const StepChoice& choice,
                            const Mesh& mesh) {
  std::string text = fmt::format("in step {} (frame {}, t = {} s) ", divergence.step,
                                 divergence.frame, significant(divergence.time_s, 6));
  if (divergence.spring) {
    const Divergence::StretchedSpring& s = *divergence.spring;
    text += fmt::format(
        "the {} spring (type {}) between nodes {} and {} is {} m long, {} times its natural {} m",
        spring_family(s.type), s.type, node_text(mesh, s.spring.a), node_text(mesh, s.spring.b),
        significant(s.length_m, 3), significant(s.length_m / s.natural_length_m, 3),
        significant(s.natural_length_m, 3));
  } else if (divergence.vertex >= 0) {
    text += fmt::format("the cloth left the scene, node {} first, with its springs whole",
                        node_text(mesh, divergence.vertex));
  } else {
    text += "the start is not finite";
  }
  if (divergence.vertex >= 0)
    return text + "; look at the effects' parameters and the paths of held points";
  // Half of a step that should have been stable is suggested: crumpled cloth may need it.
  const double suggested_s = choice.stable() ? choice.longest_s / 2 : choice.stable_s;
  text += fmt::format("; try --time-step {}", rounded_down(suggested_s));
  if (choice.stable()) text += ", or look at the effects' parameters and the paths of held points";
  return text;
}

SimulateResult run_or_explain(const Simulation& simulation, const StepChoice& choice,
                              const ProgressCallback& progress) {
  SimulateResult result = run(simulation, choice.time_step_s, progress, interrupted);
  if (result.reason == StopReason::cancelled || interrupted()) throw Cancelled();
  if (result.usable()) return result;
  // A start that does not come to rest is examined as the sheet is let go.
  const bool never_rested = result.diverged_frame == 0;
  result.position_m.clear();  // they are had again
  result.position_m.shrink_to_fit();
  const ParameterSet parameters =
      never_rested ? simulation.parameters : started(simulation, choice.time_step_s, interrupted);
  const std::optional<Divergence> divergence = find_divergence(
      simulation.cloth, parameters,
      {.frame_time_s = simulation.frame_time_s, .time_step_s = choice.time_step_s}, interrupted);
  if (interrupted()) throw Cancelled();
  std::string text = never_rested ? "no simulation: the cloth did not come to rest"
                                  : "no simulation: the run diverged";
  if (never_rested && divergence) text += "; let go instead, it diverges too: ";
  if (!never_rested && divergence) text += ": ";
  if (divergence) text += divergence_text(*divergence, choice, simulation.cloth.mesh);
  throw NoResult(text);
}

/// Returns the largest length of any spring in any frame, as a multiple of its natural one.
double largest_stretch(const Simulation& simulation, const SimulateResult& result) {
  double largest = 0;
  for (const Eigen::Matrix3Xd& position_m : result.position_m) {
    for (size_t type = 0; type < kSpringTypes; ++type) {
      const double natural_m = simulation.parameters.springs.natural_length_m[type];
      for (const Spring& spring : simulation.cloth.springs[type]) {
        const double length_m = (position_m.col(spring.b) - position_m.col(spring.a)).norm();
        largest = std::max(largest, length_m / natural_m);
      }
    }
  }
  return largest;
}

bool has_effect(const ModelDescription& model, const std::string& name) {
  return std::ranges::find(model.effects, name, &DeclaredEffect::name) != model.effects.end();
}

Json named_value(const std::string& name, const std::string& unit, double value) {
  return {{"name", name}, {"unit", unit}, {"value", value}};
}

/// Adds the springs' own numbers, named by type.
void add_springs(const ModelSprings& springs, Json& parameters) {
  const auto add = [&](const char* name, const char* unit, const ModelSprings::ByType& numbers) {
    for (size_t type = 0; type < numbers.size(); ++type)
      parameters.push_back(named_value(fmt::format("{}_{}", name, type), unit, numbers[type]));
  };
  add("natural_length", "m", springs.natural_length_m);
  add("stiffness", "N/m", springs.stiffness_n_per_m);
  add("damping", "N s/m", springs.damping_ns_per_m);
  if (springs.critical_elongation) add("critical_elongation", "", *springs.critical_elongation);
}

/// Describes the strain limit and how it was kept; null without one.
Json describe_strain_limit(const ModelDescription& model, const SimulateResult& result) {
  if (model.strain_limit == StrainLimitKind::off) return nullptr;
  return {{"mode", to_string(model.strain_limit)},
          {"elongation", model.springs ? Json(model.springs->critical_elongation.value())
                                       : Json(model.critical_elongation)},
          {"largest_excess", result.largest_excess},
          {"unmet_steps", result.unmet_steps}};
}

/// Warns where springs went far beyond the limit that the model sets them.
void warn_of_strain(const ModelDescription& model, const SimulateResult& result,
                    const StepChoice& choice) {
  if (model.strain_limit == StrainLimitKind::off) return;
  const double elongation = model.springs
                                ? std::ranges::max(model.springs->critical_elongation.value())
                                : model.critical_elongation;
  if (result.largest_excess > std::max(elongation, 0.01)) {
    spdlog::warn("a spring stretched by {} % where the strain limit allows {} %{}",
                 significant(100 * (elongation + result.largest_excess), 3),
                 significant(100 * elongation, 3),
                 model.strain_limit == StrainLimitKind::consistent
                     ? ""
                     : ": one sweep a step does not hold this cloth; mode: consistent does, or "
                       "shorter steps");
  }
  if (result.unmet_steps > 0)
    spdlog::warn(
        "the strain limit was not met in {} of {} steps: held points too far apart, or "
        "more sweeps needed than a step is given",
        result.unmet_steps, choice.steps);
}

std::string obstacle_file(const ModelDescription& model) {
  return model.obstacle_file.empty() ? model.where(0) : model.obstacle_file.string();
}

/// Says what the model does not give, and what is wrong with its obstacle. Throws InputError for
/// one that is inside out, or in which the cloth starts.
void check_before(const ModelDescription& model, const Simulation& simulation) {
  for (const std::string& assumed : simulation.assumed) spdlog::warn("{}", assumed);
  if (!model.obstacle) return;
  if (!has_effect(model, "contact_mesh"))
    return spdlog::warn(
        "the cloth passes through the obstacle: the effect contact_mesh is not declared");
  const Findings findings =
      check_obstacle(*model.obstacle, obstacle_file(model), simulation.cloth.mesh,
                     simulation.parameters.start_position_m);
  refuse_wrong(findings);
  for (const Finding& finding : findings) spdlog::warn("{}", sentence(finding));
}

/// Warns where the cloth went through its obstacle.
void warn_of_holes(const ModelDescription& model, const Simulation& simulation,
                   const SimulateResult& result) {
  if (!model.obstacle || !has_effect(model, "contact_mesh")) return;
  if (const auto pierced = check_pierced(*model.obstacle, obstacle_file(model),
                                         simulation.cloth.mesh, result.position_m))
    spdlog::warn("{}", sentence(*pierced));
}

Json describe_run(const ModelDescription& model, const Simulation& simulation,
                  const StepChoice& choice, const SimulateResult& result, double stretch,
                  const std::vector<std::string>& files) {
  const Mesh& mesh = simulation.cloth.mesh;
  Json parameters = Json::array();
  parameters.push_back(
      named_value("areal_density", "kg/m2", *model.cloth.mass_kg / (mesh.width_m * mesh.height_m)));
  Json constants = nullptr;
  if (model.springs) {
    add_springs(*model.springs, parameters);
  } else {
    for (const FabricParameterName& parameter : kFabricParameters)
      parameters.push_back(
          named_value(parameter.name, parameter.unit, model.fabric.at(parameter.name)));
    const Continuum c = continuum(simulation.fabric.value());
    constants = {named_value("c11", "N/m", c.c11_n_per_m), named_value("c22", "N/m", c.c22_n_per_m),
                 named_value("c12", "N/m", c.c12_n_per_m),
                 named_value("c33", "N/m", c.c33_n_per_m)};
  }
  Json effects = Json::array();
  for (size_t e = 0; e < simulation.cloth.effect_descriptions.size(); ++e) {
    const EffectDescription& description = simulation.cloth.effect_descriptions[e];
    Json list = Json::array();
    for (size_t p = 0; p < description.parameters.size(); ++p)
      list.push_back(named_value(description.parameters[p].name, description.parameters[p].unit,
                                 simulation.parameters.effects[e][p]));
    effects.push_back({{"name", description.name}, {"parameters", list}});
  }
  return {
      {"format", "clothfit-simulation/1"},
      {"model", model.name},
      {"version", program_version()},
      {"mesh", {{"columns", mesh.columns}, {"rows", mesh.rows}}},
      {"parameter_set", model.springs ? "springs" : "fabric"},
      {"parameters", parameters},
      {"continuum", constants},
      {"effects", effects},
      {"integrator", "euler"},
      {"start", simulation.start == StartKind::unknown ? "in_motion" : to_string(simulation.start)},
      {"frames", simulation.frame_time_s.size()},
      {"duration_s", simulation.frame_time_s.back() - simulation.frame_time_s.front()},
      {"time_step",
       {{"used_s", choice.longest_s},
        {"stable_s", std::isfinite(choice.stable_s) ? Json(choice.stable_s) : Json(nullptr)},
        {"chosen_by", choice.source},
        {"substeps", choice.substeps},
        {"steps", choice.steps}}},
      {"largest_stretch", stretch},
      {"strain_limit", describe_strain_limit(model, result)},
      {"stop", "reached_end"},
      {"files", files}};
}

std::string step_text(const StepChoice& choice) {
  const std::string why = choice.source == "stability" ? "two thirds of the largest stable one"
                          : choice.source == "model"   ? "as the model says"
                                                       : "as asked for";
  return fmt::format("Time step: {} s, {} a frame, {} (stable below {} s)\n",
                     significant(choice.longest_s, 3), choice.substeps, why,
                     rounded_down(choice.stable_s));
}

int run_simulate(const SimulateVerbOptions& options) {
  ModelDescription model;
  std::optional<ResultFolder> out;
  std::vector<std::string> files;
  std::string said;
  {
    ProgressLine line;
    const ProgressCallback progress = watch(line);
    // The result folder's default name is known once the model is read. The steps of a recording
    // are kept in that folder.
    const fs::path name = options.out.empty()
                              ? fs::path(requested_name(options.request) + ".simulation")
                              : options.out;
    out.emplace(name, std::vector<fs::path>{options.request.input, options.request.fit});
    model = requested_model(options.request, out->path() / "steps", progress);
    const Simulation simulation = make_simulation(model);
    check_before(model, simulation);
    const StepChoice choice = choose_step(simulation, model, options.time_step_s);
    require_possible(choice, simulation, model, options.allow_unstable);
    require_room(simulation, model, options.formats);
    said = fmt::format(
               "\nSimulated {}: {} frames, {} s, {} x {} nodes, {} springs\n", model.name,
               simulation.frame_time_s.size(),
               significant(simulation.frame_time_s.back() - simulation.frame_time_s.front(), 4),
               simulation.cloth.mesh.columns, simulation.cloth.mesh.rows,
               simulation.cloth.spring_count()) +
           step_text(choice);
    SimulateResult result = run_or_explain(simulation, choice, progress);
    if (interrupted()) throw Cancelled();
    const double stretch = largest_stretch(simulation, result);
    if (stretch > kLengthBeyondReason)
      spdlog::warn("a spring stretched to {} times its natural length: no fabric does",
                   significant(stretch, 3));
    warn_of_strain(model, result, choice);
    warn_of_holes(model, simulation, result);

    model.time_step_s = choice.time_step_s;
    write_model(model, out->path());
    // The model is read as it stands there, with the files of its held points.
    const ModelDescription written = read_model(out->path() / "model.yaml");
    files = write_simulation_files(written, std::move(result.position_m), options.formats,
                                   out->path(), progress);
    files.insert(files.begin(), "model.yaml");
    write_json(describe_run(model, simulation, choice, result, stretch, files),
               out->path() / "simulation.json");
  }
  if (interrupted()) throw Cancelled();
  out->publish();
  say("{}Results: {}\n", said, shown_path(out->final_path()));
  return kExitGood;
}

/// Reads "csv,obj"; nothing where the text is no list of formats.
std::optional<std::vector<SimulationFormat>> parse_formats(const std::string& text) {
  std::vector<SimulationFormat> formats;
  std::string rest = text + ",";
  while (!rest.empty()) {
    const std::string word = rest.substr(0, rest.find(','));
    rest.erase(0, word.size() + 1);
    if (word == "csv")
      formats.push_back(SimulationFormat::csv);
    else if (word == "obj")
      formats.push_back(SimulationFormat::obj);
    else if (word == "pc2")
      formats.push_back(SimulationFormat::pc2);
    else if (word == "gltf")
      formats.push_back(SimulationFormat::gltf);
    else
      return std::nullopt;
  }
  return formats;
}

std::string check_formats(const std::string& text) {
  return parse_formats(text) ? "" : "'" + text + "' is not a list of csv, obj, pc2 and gltf";
}

std::string check_positive(const std::string& text) {
  const std::optional<double> number = parse_number(text);
  return number && *number > 0 ? "" : "'" + text + "' is not a number above 0";
}

std::string check_assignment(const std::string& text) {
  return parse_assignment(text) ? "" : "'" + text + "' is not NAME=NUMBER";
}

}  // namespace

void add_simulate_verb(Verb program) {
  struct Flags {
    std::string mesh;
    std::string formats = "csv,obj";
  };
  const auto options = std::make_shared<SimulateVerbOptions>();
  const auto flags = std::make_shared<Flags>();
  Verb verb = program.add_verb(
      "simulate", "Simulate a fitted or described cloth: positions as CSV, OBJ, PC2 or glTF");
  ModelRequest& request = options->request;
  verb.add_option("model", &request.input,
                  "Model file, a folder that holds model.yaml, or a recording")
      .type_name("MODEL.yaml|RECORDING");
  verb.add_option("--fit", &request.fit,
                  "Result folder of a fit, or its fit.json: the model that it found; beside a "
                  "recording, its parameters only")
      .type_name("FIT");
  verb.add_option("--model", &request.model, "Model file whose fabric and effects are taken")
      .type_name("MODEL.yaml");
  verb.add_option("--set", &request.set,
                  "A parameter's value, such as shear=20 or wind.q_y=0.25; may be repeated")
      .type_name("NAME=NUMBER")
      .one_at_a_time()
      .check(check_assignment);
  verb.add_option("--mesh", &flags->mesh, "Columns and rows of the mesh (default: the model's)")
      .type_name("CxR")
      .check(check_mesh);
  verb.add_option("--duration", &request.duration_s, "Seconds (default: the model's)")
      .check(check_positive);
  verb.add_option("--frame-rate", &request.frame_rate_hz, "Frames per second that are written")
      .check(check_positive);
  verb.add_option("--time-step", &options->time_step_s,
                  "Largest time step in seconds (default: the model's, or two thirds of the "
                  "largest stable one)")
      .check(check_positive);
  verb.add_flag("--allow-unstable", options->allow_unstable,
                "Run a time step that is not stable all the same");
  verb.add_option("--format", &flags->formats, "What to write: csv, obj, pc2, gltf")
      .type_name("LIST")
      .check(check_formats)
      .shows_default();
  add_out_option(verb, options->out, "NAME.simulation");
  add_outside_option(verb, options->request.allow_outside);
  verb.footer(
      "Examples:\n"
      "  clothfit simulate --fit swing_plain.fit\n"
      "  clothfit simulate --fit swing_plain.fit --set shear=40 --duration 3 --format gltf\n"
      "  clothfit simulate curtain.yaml --format csv,pc2\n"
      "  clothfit simulate OTHER_RECORDING --fit swing_plain.fit");
  verb.runs([options, flags] {
    if (!flags->mesh.empty()) options->request.mesh = parse_grid_size(flags->mesh);
    options->formats = *parse_formats(flags->formats);
    return run_simulate(*options);
  });
}

}  // namespace clothfit
