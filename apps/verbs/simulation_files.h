#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "data/model_description.h"
#include "data/progress.h"

namespace clothfit {

enum class SimulationFormat { csv, obj, pc2, gltf };

/// Writes the motion of a mesh (positions of every frame, finite) into `folder`:
///
///   csv   a recording of its own: recording.yaml, markers.csv (a marker at every vertex, named
///         ROW_COLUMN), tracks3d.csv. `folder`/model.yaml must have been written
///   obj   obj/000000.obj, ...: one file a frame
///   pc2   cloth.pc2, and cloth.obj (the first frame) for the point cache to move
///   gltf  cloth.glb
///
/// Tracks and OBJ files are written frame by frame: beside the positions they take no memory.
/// Returns the files written, relative to the folder. Throws InputError, Cancelled.
std::vector<std::string> write_simulation_files(const ModelDescription& model,
                                                std::vector<Eigen::Matrix3Xd> position_m,
                                                const std::vector<SimulationFormat>& formats,
                                                const std::filesystem::path& folder,
                                                const ProgressCallback& progress);

}  // namespace clothfit
