#include <fmt/format.h>

#include <array>

#include "data/model_description.h"
#include "data/model_words.h"
#include "data/number_text.h"
#include "data/recording_parts.h"
#include "data/text_file.h"
#include "data/yaml_writer.h"

namespace clothfit {
namespace {

void write_fabric(YamlWriter& out, const ModelDescription& model) {
  out.key("fabric").begin_map();
  for (const FabricParameterName& parameter : kFabricParameters)
    out.key(parameter.name).value(model.fabric.at(parameter.name));
  out.end_map();
}

void write_springs(YamlWriter& out, const ModelSprings& springs) {
  out.key("springs").begin_map();
  out.key("natural_length").value(springs.natural_length_m);
  out.key("stiffness").value(springs.stiffness_n_per_m);
  out.key("damping").value(springs.damping_ns_per_m);
  if (springs.critical_elongation)
    out.key("critical_elongation").value(*springs.critical_elongation);
  out.end_map();
}

void write_start_state(const ModelDescription& model, const std::filesystem::path& file) {
  const ModelStartState& state = model.start_state.value();
  std::string text = "row,column,x,y,z,vx,vy,vz\n";
  for (int row = 0; row < model.mesh_rows; ++row) {
    for (int column = 0; column < model.mesh_columns; ++column) {
      const int vertex = row * model.mesh_columns + column;
      text += fmt::format("{},{}", row, column);
      for (const double number : state.position_m.col(vertex)) text += "," + number_text(number);
      for (const double number : state.velocity_m_per_s.col(vertex))
        text += "," + number_text(number);
      text += "\n";
    }
  }
  write_text(text, file);
}

void write_start(YamlWriter& out, const ModelDescription& model,
                 const std::filesystem::path& folder) {
  if (model.start == StartKind::unknown) {
    write_start_state(model, folder / "start.csv");
    out.key("start").begin_flow_map();
    out.key("kind").value(word_of(model_start_words(), model.start));
    out.key("file").value("start.csv").end_map();
    return;
  }
  const Eigen::Quaterniond& q = model.sheet.orientation;
  out.key("start").begin_map();
  out.key("kind").value(word_of(model_start_words(), model.start));
  out.key("position").value(numbers(model.sheet.position_m));
  out.key("orientation").value(std::array{q.w(), q.x(), q.y(), q.z()});
  out.end_map();
}

/// Says whether a rate and a duration give the same frames, bit for bit.
bool are_even(const ModelDescription& model) {
  return model.frame_rate_hz &&
         frame_times(*model.frame_rate_hz, model.frame_time_s.back()) == model.frame_time_s;
}

}  // namespace

std::string to_string(StrainLimitKind kind) {
  return word_of(strain_limit_words(), kind);
}

void write_model(const ModelDescription& model, const std::filesystem::path& folder) {
  YamlWriter out;
  out.begin_map();
  out.key("format").value(kModelFormat);
  out.key("name").value(model.name);
  write_cloth(out, model.cloth);
  write_mesh(out, model.mesh_columns, model.mesh_rows);
  if (model.springs)
    write_springs(out, *model.springs);
  else
    write_fabric(out, model);
  if (model.strain_limit != StrainLimitKind::off) {
    out.key("strain_limit").begin_flow_map();
    out.key("mode").value(to_string(model.strain_limit));
    if (!model.springs) out.key("elongation").value(model.critical_elongation);
    out.end_map();
  }
  out.key("gravity").value(numbers(model.gravity_m_per_s2));
  if (model.obstacle) {
    write_obj(*model.obstacle, folder / "obstacle.obj");
    out.key("obstacle").value("obstacle.obj");
  }

  const RelativePaths relative(folder);
  int paths = 0;
  write_list(out, "held", model.held, [&](const ModelHeldPoint& held) {
    HeldPoint point = held.point;
    if (point.motion == HeldMotion::path) {
      std::filesystem::create_directories(folder / "held");
      point.file = folder / "held" / fmt::format("{}.csv", ++paths);
      write_held_path(held.path, *point.file);
    }
    write_held_point(out, point, relative);
  });
  write_list(out, "effects", model.effects,
             [&](const DeclaredEffect& effect) { write_declared_effect(out, effect); });
  write_start(out, model, folder);

  out.key("time").begin_flow_map();
  if (are_even(model)) {
    out.key("frame_rate").value(*model.frame_rate_hz);
    out.key("duration").value(model.frame_time_s.back());
  } else {
    write_times(model.frame_time_s, folder / "times.csv");
    out.key("file").value("times.csv");
  }
  out.end_map();
  if (model.time_step_s) out.key("time_step").value(*model.time_step_s);
  out.end_map();
  write_text(out.text(), folder / "model.yaml");
}

}  // namespace clothfit
