#include "apps/verbs/simulation_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <utility>

#include "apps/terminal/exit_code.h"
#include "data/input_error.h"
#include "data/mesh_sequence.h"
#include "data/number_text.h"
#include "data/tracks.h"
#include "model/topology/mesh.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

/// Returns a marker at every vertex.
MarkerSet vertex_markers(const ModelDescription& model) {
  const Mesh mesh{model.mesh_columns, model.mesh_rows, model.cloth.width_m, model.cloth.height_m};
  const Eigen::Matrix3Xd flat = flat_positions(mesh);
  MarkerSet set;
  for (int i = 0; i < mesh.rows; ++i) {
    for (int j = 0; j < mesh.columns; ++j) {
      const Eigen::Vector3d place = flat.col(mesh.vertex(i, j));
      set.markers.push_back(
          {.name = fmt::format("{}_{}", i, j), .s_m = place.x(), .t_m = place.y()});
    }
  }
  return set;
}

/// Told how many frames are written; throws Cancelled.
using FrameReport = std::function<void(int frames)>;

/// Writes the table of 3D tracks frame by frame, with a place of every vertex. Its text is that of
/// write_tracks3d (data/tracks.h), which would need all rows at once.
void write_tracks(const std::vector<Eigen::Matrix3Xd>& position_m, const MarkerSet& markers,
                  const fs::path& file, const FrameReport& report) {
  std::ofstream out(file, std::ios::binary);
  std::string text = "frame,marker,x,y,z\n";
  for (size_t f = 0; f < position_m.size(); ++f) {
    for (Eigen::Index v = 0; v < position_m[f].cols(); ++v) {
      const auto at_m = position_m[f].col(v);
      text += fmt::format("{},{},{},{},{}\n", f, markers.markers[static_cast<size_t>(v)].name,
                          number_text(at_m.x()), number_text(at_m.y()), number_text(at_m.z()));
    }
    out << text;
    text.clear();
    report(static_cast<int>(f) + 1);
  }
  out.close();
  if (!out)
    throw InputError(file.string(), "cannot be written", "a folder with room on its disk",
                     "name another folder with --out");
}

/// Writes the simulation as a recording, in which the place of every vertex was measured. `written`
/// is the model as it stands in the folder, with the files of its held points and its obstacle.
void write_as_recording(const ModelDescription& written,
                        const std::vector<Eigen::Matrix3Xd>& position_m, const fs::path& folder,
                        const FrameReport& report) {
  Recording recording;
  recording.folder = folder;
  recording.name = written.name;
  recording.origin = "simulated by clothfit; model.yaml holds the model";
  recording.cloth = written.cloth;
  if (written.cloth.masses == MassDistribution::by_area) {  // the others refer to their own mesh
    recording.cloth.mesh_columns = written.mesh_columns;
    recording.cloth.mesh_rows = written.mesh_rows;
  }
  recording.markers = vertex_markers(written);
  recording.markers_file = folder / "markers.csv";
  recording.frame_rate_hz = written.frame_rate_hz;
  if (!written.frame_rate_hz) recording.times_file = folder / "times.csv";
  recording.times_s = written.frame_time_s;
  recording.gravity_m_per_s2 = written.gravity_m_per_s2;
  recording.tracks3d = folder / "tracks3d.csv";
  if (written.obstacle) recording.obstacle_file = folder / "obstacle.obj";
  for (const ModelHeldPoint& held : written.held) recording.held.push_back(held.point);
  recording.start = written.start;
  recording.declared = written.effects;

  write_markers(recording.markers.markers, recording.markers_file);
  write_tracks(position_m, recording.markers, *recording.tracks3d, report);
  write_recording(recording, folder);
}

MeshSequence sequence_of(const ModelDescription& model, std::vector<Eigen::Matrix3Xd> position_m) {
  MeshSequence mesh = grid_sequence(model.mesh_columns, model.mesh_rows);
  mesh.time_s = model.frame_time_s;
  mesh.position_m = std::move(position_m);
  if (model.gravity_m_per_s2.norm() > 0) mesh.up = -model.gravity_m_per_s2.normalized();
  return mesh;
}

}  // namespace

std::vector<std::string> write_simulation_files(const ModelDescription& model,
                                                std::vector<Eigen::Matrix3Xd> position_m,
                                                const std::vector<SimulationFormat>& formats,
                                                const fs::path& folder,
                                                const ProgressCallback& progress) {
  const MeshSequence mesh = sequence_of(model, std::move(position_m));
  const auto wants = [&](SimulationFormat format) {
    return std::ranges::find(formats, format) != formats.end();
  };
  const auto frames = static_cast<int>(mesh.position_m.size());
  const auto report = [&](int done) {
    if (!progress({.stage = "write",
                   .done = static_cast<double>(done),
                   .total = static_cast<double>(frames),
                   .unit = "frames",
                   .note = ""}))
      throw Cancelled();
  };
  std::vector<std::string> files;
  report(0);
  if (wants(SimulationFormat::csv)) {
    write_as_recording(model, mesh.position_m, folder, report);
    files.insert(files.end(), {"recording.yaml", "markers.csv", "tracks3d.csv"});
  }
  if (wants(SimulationFormat::obj)) {
    fs::create_directories(folder / "obj");
    for (int frame = 0; frame < frames; ++frame) {
      write_obj(mesh, frame, folder / "obj" / fmt::format("{:06}.obj", frame));
      report(frame + 1);
    }
    files.emplace_back("obj/");
  }
  if (wants(SimulationFormat::pc2)) {
    write_obj(mesh, 0, folder / "cloth.obj");
    write_pc2(mesh, folder / "cloth.pc2");
    files.insert(files.end(), {"cloth.obj", "cloth.pc2"});
  }
  if (wants(SimulationFormat::gltf)) {
    write_glb(mesh, folder / "cloth.glb");
    files.emplace_back("cloth.glb");
  }
  report(frames);
  return files;
}

}  // namespace clothfit
