// Lets every allocation of every reader fail once: the reader then throws an InputError that names
// a file, or does without. Calls of operator new are counted, which this program replaces. Not
// checked: what Eigen and zlib allocate by malloc; allocations outside the readers, which end a run
// of the program with exit code 3 and no file's name.

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <new>
#include <nlohmann/json.hpp>
#include <optional>

#include "data/body_path.h"
#include "data/camera_parameters.h"
#include "data/clouds.h"
#include "data/file_bytes.h"
#include "data/fit_result.h"
#include "data/folder_entries.h"
#include "data/input_error.h"
#include "data/model_description.h"
#include "data/obj_mesh.h"
#include "data/read_json.h"
#include "data/recording.h"
#include "data/recording_parts.h"
#include "data/tracks.h"
#include "data/yaml_value.h"
#include "fit/jobs/journal.h"
#include "fit/search/search_checkpoint.h"
#include "tests/data/full_recording.h"
#include "tests/data/replaced_new.h"

namespace {

/// How many more allocations of this thread succeed before one fails; negative: all of them.
thread_local long allocations_left = -1;

void before_allocation() {
  if (allocations_left >= 0 && allocations_left-- == 0) throw std::bad_alloc();
}

}  // namespace

namespace clothfit {
namespace {

namespace fs = std::filesystem;

/// Returns how many allocations a call makes.
int allocations_of(const std::function<void()>& call) {
  constexpr long kMany = 1L << 40;
  allocations_left = kMany;
  call();
  const long left = allocations_left;
  allocations_left = -1;
  return static_cast<int>(kMany - left);
}

/// Calls `read` and lets allocation number `n` fail. Says whether an InputError named the file, or
/// none was thrown.
::testing::AssertionResult names_file(const std::string& file, int n,
                                      const std::function<void()>& read) {
  std::string thrown;
  try {
    allocations_left = n;
    read();
    allocations_left = -1;
    return ::testing::AssertionSuccess();
  } catch (const InputError& error) {
    allocations_left = -1;
    thrown = error.what();
    if (thrown.find(file) != std::string::npos) return ::testing::AssertionSuccess();
  } catch (const std::exception& error) {
    allocations_left = -1;
    thrown = std::string("not an InputError: ") + error.what();
  }
  return ::testing::AssertionFailure() << "allocation " << n << ": " << thrown;
}

/// Lets each allocation of `read` fail but the last `but`, one a call.
void expect_files_named(const fs::path& file, const std::function<void()>& read, int but = 0) {
  const std::string name = file.string();
  read();  // what is kept from the first call on, such as a locale
  const int allocations = allocations_of(read) - but;
  EXPECT_GT(allocations, 0);
  for (int n = 0; n < allocations; ++n) ASSERT_TRUE(names_file(name, n, read)) << name;
  read();
  std::printf("%s: %d allocations\n", file.filename().c_str(), allocations);
}

class FaultyMemory : public ::testing::Test {
 protected:
  const TemporaryFolder folder_;

  /// Lets a reader of a file, which is written first, lack memory.
  template <class Read>
  void expect_named(const std::string& name, const std::string& text, const Read& read) {
    const fs::path file = folder_.write(name, text);
    expect_files_named(file, [&] { read(file); });
  }
};

/// The same for a reader of JSON. Destructors of nlohmann's JSON allocate, at the end of a reader:
/// there the program ends (apps/main.cpp).
template <class Read>
void expect_json_named(const fs::path& file, const Read& read) {
  std::optional<nlohmann::json> parsed = read_json(file, "JSON", "");
  const int destroying = allocations_of([&] { parsed.reset(); });
  expect_files_named(
      file, [&] { read(file); }, destroying);
}

MarkerSet two_markers() {
  MarkerSet set;
  set.markers = {{.name = "a"}, {.name = "b"}};
  set.index = {{"a", 0}, {"b", 1}};
  return set;
}

TEST_F(FaultyMemory, IsSaidByReadersOfTables) {
  const MarkerSet markers = two_markers();
  const std::string tracks = "frame,marker,u,v,sigma,status\n0,a,1,2,,ok\n0,b,1,2,0.1,rejected:x\n";
  expect_named("t2.csv", tracks, [&](const fs::path& file) { read_tracks2d(file, markers); });
  expect_named("t2.csv.gz", tracks, [&](const fs::path& file) { read_tracks2d(file, markers); });
  expect_named("t3.csv", "frame,marker,x,y,z\n0,a,1,2,3\n1,b,1,2,3\n",
               [&](const fs::path& file) { read_tracks3d(file, markers); });
  expect_named("markers.csv", "marker,s,t,tag,corner\na,0,0,1,0\nb,0.4,0.3,1,1\n",
               [](const fs::path& file) { read_markers(file, 0.4, 0.3); });
  expect_named("reference.csv", "point,x,y,z,tag,corner\nnail,1,2,3,0,1\n", read_reference_points);
  expect_named("times.csv", "frame,time\n0,0.5\n1,0.6\n", read_times);
  expect_named("held.csv", "time,x,y,z\n0,1,2,3\n1,1,2,3\n", read_held_path);
  expect_named("body.csv", "time,x,y,z,qw,qx,qy,qz\n0,1,2,3,1,0,0,0\n", read_body_path);
  expect_named("table.obj", "v 0 0 0.7\nv 1 0 0.7\nv 1 1 0.7\nf 1 2 3\n", read_obj);
}

TEST_F(FaultyMemory, IsSaidByReadersOfFoldersAndWholeFiles) {
  folder_.write("clouds/000000.csv", "x,y,z\n1,2,3\n");
  folder_.write("clouds/000001.csv.gz", "x,y,z\n1,2,3\n");
  const fs::path clouds = folder_ / "clouds";
  expect_files_named(clouds, [&] { read_point_clouds(clouds); });
  expect_files_named(clouds, [&] { list_folder(clouds); });
  expect_files_named(clouds, [&] { list_whole_folder(clouds); });
  expect_named("a.txt", "text\r\n", [](const fs::path& file) { read_text(file); });
  expect_named("a.txt.gz", "text\n", [](const fs::path& file) { read_text(file); });
  expect_named("b.txt", "text\n", [](const fs::path& file) { read_file_bytes(file, 1000); });
  expect_named("a.yaml", "a: {b: [1, two, \"three\"]}\n",
               [](const fs::path& file) { read_yaml(file); });
  expect_json_named(folder_.write("a.json", R"({"a": {"b": [1, "two", null]}})"),
                    [](const fs::path& file) { read_json(file, "JSON", "write it again"); });
}

TEST_F(FaultyMemory, IsSaidByReadersOfDescriptions) {
  CameraParameters camera;
  camera.name = "front";
  camera.image_width = camera.image_height = 100;
  camera.focal_px = {100, 100};
  camera.camera_from_world = CameraPose{.rotation = Eigen::Quaterniond::Identity()};
  write_camera(camera, folder_ / "written.yaml");
  expect_named("camera.yaml", read_text(folder_ / "written.yaml"), read_camera);

  FitResult result;
  result.mesh_columns = result.mesh_rows = 5;
  result.parameters = {{"tension_warp", "N/m", 41.2, 0.6, ParameterState::fitted, ""}};
  result.errors = {{"front", "px", {0.3, 0.42, 1000}, {0.5, 0.7, 400}, 0.29, {21, 30, 25}}};
  write_fit_result(result, folder_ / "written.json");
  expect_json_named(folder_ / "written.json", read_fit_result);

  folder_.write("right.csv", "time,x,y,z\n0,0,0,1\n1,0.1,0,1\n");
  const std::string model =
      "format: clothfit-model/1\nname: a\ncloth: {size: [1, 1], mass: 0.1}\n"
      "fabric: {tension_warp: 1, tension_weft: 1, shear: 0, flexion_warp: 0, flexion_weft: 0, "
      "damping_warp: 0, damping_weft: 0}\n"
      "held: [{at: [0, 0], motion: path, file: right.csv}, {edge: top, motion: fixed}]\n"
      "effects: [{effect: wind, parameters: {q: [0, 1, 0]}}]\n"
      "start: {kind: released_flat, orientation: [1, 0, 0, 0]}\n"
      "time: {frame_rate: 10, duration: 1}\n";
  const fs::path file = folder_.write("model.yaml", model);
  expect_files_named(folder_.path(), [&] { read_model(file); });

  write_full_recording(folder_);
  expect_files_named(folder_.path(), [&] { read_recording(folder_.path()); });
}

TEST_F(FaultyMemory, IsSaidByThoseOfCheckpointsAndJournals) {
  const std::vector<SearchParameter> ranges = {{.name = "angle", .lower = -5, .upper = 5},
                                               {.name = "c", .lower = -1, .upper = 5}};
  const auto cost = [](const Eigen::MatrixXd& individuals) -> Eigen::VectorXd {
    return individuals.colwise().squaredNorm().transpose();
  };
  EvolutionOptions options;
  options.population = 8;
  const EvolutionState first = first_generation(ranges, options, cost);
  const fs::path search = folder_ / "search", cma = folder_ / "cma", file = folder_ / "journal";
  const std::string bowl = "bowl", key = "a key";
  save_checkpoint(search, bowl, ranges, options, first);
  const auto load_evolution = [&] { load_evolution_checkpoint(search, bowl, ranges, options); };
  expect_files_named(search, load_evolution);

  const CmaOptions cma_options;
  save_checkpoint(cma, bowl, ranges, cma_options, start_cma(ranges, cma_options));
  const auto load_cma = [&] { load_cma_checkpoint(cma, bowl, ranges, cma_options); };
  expect_files_named(cma, load_cma);

  Journal(file, key, JournalStart::fresh).append(0, "a payload that is kept");
  expect_files_named(file, [&] { Journal(file, key, JournalStart::resume); });
}

}  // namespace
}  // namespace clothfit
