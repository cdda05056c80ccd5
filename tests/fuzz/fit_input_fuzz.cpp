// From a recording to its first frames: read, checked, made a problem of a fit, simulated. Pictures
// are not looked at, and no fit is made.

#include "calib/camera/projection.h"
#include "data/recording.h"
#include "fit/interface/fit_input.h"
#include "fit/observe/held_tracks.h"
#include "fit/preflight/preflight.h"
#include "fit/problem/problem.h"
#include "fit/problem/simulation.h"
#include "tests/fuzz/scratch_folder.h"

namespace clothfit {
namespace {

/// Reads what a fit looks at, as `clothfit check` does of a recording that lacks nothing.
FitInput fit_input(const Recording& recording) {
  FitInput input{.recording = recording};
  if (recording.tracks3d) {
    input.tracks3d = read_tracks3d(*recording.tracks3d, recording.markers);
    return input;
  }
  for (const auto& [name, file] : recording.tracks2d) {
    const CameraEntry* camera = recording.find_camera(name);
    if (camera == nullptr || !camera->file) continue;
    CameraParameters parameters = read_camera(*camera->file);
    if (!parameters.camera_from_world) continue;
    parameters.name = name;
    input.tracks2d[name] = read_tracks2d(file, recording.markers);
    input.cameras.push_back(std::move(parameters));
  }
  if (follows_markers(recording)) input.held_tracks = held_tracks_from_pixels(input);
  return input;
}

/// Numbers that overflowed would be told to the user as if they meant something.
void require_numbers(const Findings& findings) {
  for (const Finding& finding : findings)
    for (const char* overflown : {" nan", "(nan", " inf", "(inf", " -nan", " -inf"})
      if (finding.found.find(overflown) != std::string::npos) __builtin_trap();
}

/// More is a matter of time, which a fit bounds by itself.
constexpr int kMostMeshNodes = 400;
constexpr double kMostSteps = 2000;

void simulate_first_frames(const FitInput& input) {
  const ClothDescription& cloth = input.recording.cloth;
  if (cloth.mesh_columns * cloth.mesh_rows > kMostMeshNodes) return;
  const FitProblem problem = make_problem(input, {}, cloth.mesh_columns, cloth.mesh_rows);
  if (!problem.placed_sheet_m.allFinite()) __builtin_trap();
  Simulation simulation =
      make_simulation(describe_model(problem, input.recording, problem.space.start()));
  const double step_s = default_time_step_s(simulation);
  auto& times_s = simulation.frame_time_s;
  while (times_s.size() > 1 && times_s.back() - times_s.front() > kMostSteps * step_s)
    times_s.pop_back();
  const SimulateResult result = run(simulation, step_s);
  if (result.usable() && !result.position_m.back().allFinite()) __builtin_trap();
}

}  // namespace
}  // namespace clothfit

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, size_t size) {
  using namespace clothfit;
  const auto& folder = write_files(files_of(text_of(data, size), "recording.yaml"));
  read_or_refuse([&] {
    const Recording recording = read_recording(folder);
    const Findings of_declarations = check_declarations(recording);
    require_numbers(of_declarations);
    refuse_wrong(of_declarations);
    const FitInput input = fit_input(recording);
    const ObservationKind kind =
        recording.tracks3d ? ObservationKind::tracks3d : ObservationKind::tracks2d;
    const Findings of_tracks = check_recording(input, kind);
    require_numbers(of_tracks);
    refuse_wrong(of_tracks);
    simulate_first_frames(input);
  });
  return 0;
}
