// Checks damaged files. Whatever one or several changed bytes make of a small file, the readers
// read it or throw InputError, and never anything else. Under the sanitizer presets this also
// watches memory. Not checked: that a damaged file which still reads means the same.

#include <fstream>
#include <iterator>
#include <random>

#include "data/camera_parameters.h"
#include "data/fit_result.h"
#include "data/model_description.h"
#include "data/obj_mesh.h"
#include "data/recording.h"
#include "data/tracks.h"
#include "tests/data/expect_refused.h"
#include "tests/data/full_recording.h"

namespace clothfit {
namespace {

/// Calls `read` with `text` damaged in `rounds` ways and counts the refusals.
template <class Read>
int refusals(const std::string& text, int rounds, const Read& read) {
  int refused = 0;
  for (int round = 0; round < rounds; ++round) {
    SCOPED_TRACE(round);
    std::mt19937_64 rng(static_cast<unsigned>(round));
    std::string damaged = text;
    const int changes = round % 4 == 3 ? 5 : 1;
    for (int change = 0; change < changes; ++change) {
      const size_t at = rng() % damaged.size();
      switch (rng() % 4) {
        case 0:  // any byte
          damaged[at] = static_cast<char>(rng() % 256);
          break;
        case 1:  // a byte that means something to the grammars
          damaged[at] = ",:#-{}[]\"'&*!|>%@`\n\t 0.e\\~?"[rng() % 28];
          break;
        case 2:
          damaged.erase(at, 1);
          break;
        default:
          damaged.insert(at, 1, damaged[rng() % damaged.size()]);
      }
    }
    try {
      read(damaged);
    } catch (const InputError& error) {
      ++refused;
      EXPECT_NE(std::string(error.what()), "");
    } catch (const std::exception& error) {
      ADD_FAILURE() << "not an InputError: " << error.what() << "\n" << damaged;
    }
  }
  return refused;
}

TEST(DamagedTracks, AreReadOrRefused) {
  const TemporaryFolder folder;
  MarkerSet markers;
  markers.markers = {{.name = "a"}, {.name = "b"}};
  markers.index = {{"a", 0}, {"b", 1}};
  const std::string text =
      "# pixels\nframe,marker,u,v,sigma,status\n0,a,1.5,2.5,0.3,ok\n"
      "0,b,3.5,-4e-3,0.3,rejected:blurred\n1,a,1.75,2,,ok\n";

  const int refused = refusals(text, 4000, [&](const std::string& damaged) {
    read_tracks2d(folder.write("t.csv", damaged), markers);
  });

  EXPECT_GT(refused, 250);
  EXPECT_LT(refused, 4000);
}

TEST(DamagedCompressedTracks, AreReadOrRefused) {
  const TemporaryFolder folder;
  MarkerSet markers;
  markers.markers = {{.name = "a"}};
  markers.index = {{"a", 0}};
  const auto file = folder.write("whole.csv.gz", "frame,marker,u,v\n0,a,1.5,2.5\n1,a,2,3\n");
  std::filesystem::rename(file, folder / "whole.bin");
  std::ifstream in(folder / "whole.bin", std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());

  const int refused = refusals(bytes, 2000, [&](const std::string& damaged) {
    std::filesystem::remove(folder / "t.csv.gz");
    std::ofstream(folder / "t.csv.gz", std::ios::binary) << damaged;
    read_tracks2d(folder / "t.csv.gz", markers);
  });

  EXPECT_GT(refused, 250);
}

TEST(DamagedRecording, IsReadOrRefused) {
  const TemporaryFolder folder;
  write_full_recording(folder);

  const int refused = refusals(kFullRecording, 4000, [&](const std::string& damaged) {
    read_recording(folder.write("recording.yaml", damaged).parent_path());
  });

  EXPECT_GT(refused, 250);
  EXPECT_LT(refused, 4000);
}

TEST(DamagedCamera, IsReadOrRefused) {
  const TemporaryFolder folder;
  CameraParameters camera;
  camera.name = "front";
  camera.model = CameraModel::brown_conrady;
  camera.image_width = 960;
  camera.image_height = 720;
  camera.focal_px = {1000.5, 1001};
  camera.distortion = {-0.1, 0.02, 0, 0};
  camera.camera_from_world = CameraPose{
      .rotation = Eigen::Quaterniond::Identity(),
      .translation_m = {1, 2, 3},
      .covariance = Eigen::Matrix<double, 6, 6>(Eigen::Matrix<double, 6, 6>::Identity() * 1e-6)};
  write_camera(camera, folder / "camera.yaml");

  const int refused = refusals(
      read_text(folder / "camera.yaml"), 4000,
      [&](const std::string& damaged) { read_camera(folder.write("camera.yaml", damaged)); });

  EXPECT_GT(refused, 250);
  EXPECT_LT(refused, 4000);
}

TEST(DamagedFitJson, IsReadOrRefused) {
  const TemporaryFolder folder;
  FitResult result;
  result.mesh_columns = result.mesh_rows = 5;
  result.parameters = {{"tension_warp", "N/m", 41.2, 0.6, ParameterState::fitted, ""}};
  result.errors = {{"front", "px", {0.3, 0.42, 1000}, {0.5, 0.7, 400}, 0.29, {21, 30, 25}}};
  result.observations_rejected = {{"blurred", 3}};
  write_fit_result(result, folder / "fit.json");

  const int refused = refusals(
      read_text(folder / "fit.json"), 4000,
      [&](const std::string& damaged) { read_fit_result(folder.write("fit.json", damaged)); });

  EXPECT_GT(refused, 250);
  EXPECT_LT(refused, 4000);
}

TEST(HostileYaml, IsRefusedWithoutExhaustingTheStack) {
  const TemporaryFolder folder;
  const size_t depth = 50000;
  const std::vector<std::string> texts = {std::string(depth, '['), std::string(depth, '{'),
                                          "a: " + std::string(depth, '['), "&a [*a]",
                                          "a: &a {b: *a}"};
  for (const std::string& text : texts) {
    SCOPED_TRACE(text.substr(0, 20));
    EXPECT_THROW(read_camera(folder.write("camera.yaml", text)), InputError);
  }
}

TEST(DamagedModel, IsReadOrRefused) {
  const TemporaryFolder folder;
  folder.write("right.csv", "time,x,y,z\n0,0,0,1\n1,0.1,0,1\n");
  const std::string text =
      "format: clothfit-model/1\nname: a\ncloth: {size: [1, 1], mass: 0.1}\n"
      "fabric: {tension_warp: 1, tension_weft: 1, shear: 0, flexion_warp: 0, flexion_weft: 0, "
      "damping_warp: 0, damping_weft: 0}\n"
      "held: [{at: [0, 0], motion: path, file: right.csv}, {edge: top, motion: fixed}]\n"
      "effects: [{effect: wind, parameters: {q: [0, 1, 0]}}]\n"
      "start: {kind: released_flat, orientation: [1, 0, 0, 0]}\n"
      "time: {frame_rate: 10, duration: 1}\ntime_step: 1e-3\n";

  const int refused = refusals(text, 2000, [&](const std::string& damaged) {
    read_model(folder.write("model.yaml", damaged));
  });

  EXPECT_GT(refused, 500);
  EXPECT_LT(refused, 2000);
}

TEST(DamagedSurface, IsReadOrRefused) {
  const TemporaryFolder folder;
  const std::string text =
      "o table\nv 0 0 0.7\nv 1.5e0 0 0.7\nv 1.5 1 0.7\nv 0 1 0.7\nvn 0 0 1\n"
      "f 1//1 2//1 3//1 4//1\nf -1 -2 -4\n";

  const int refused = refusals(text, 4000, [&](const std::string& damaged) {
    const SurfaceMesh mesh = read_obj(folder.write("table.obj", damaged));
    EXPECT_GE(mesh.triangle.minCoeff(), 0);
    EXPECT_LT(mesh.triangle.maxCoeff(), mesh.vertex_m.cols());
  });

  EXPECT_GT(refused, 250);
  EXPECT_LT(refused, 4000);
}

}  // namespace
}  // namespace clothfit
