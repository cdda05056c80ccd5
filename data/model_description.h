#pragma once

#include <Eigen/Geometry>
#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "data/recording.h"

namespace clothfit {

/// A parameter of the set `fabric`, as model files, fit.json and `--set` name it.
struct FabricParameterName {
  const char* name;
  const char* unit;
};
inline constexpr std::array<FabricParameterName, 7> kFabricParameters = {{{"tension_warp", "N/m"},
                                                                          {"tension_weft", "N/m"},
                                                                          {"shear", "N/m"},
                                                                          {"flexion_warp", "N/m"},
                                                                          {"flexion_weft", "N/m"},
                                                                          {"damping_warp", "s"},
                                                                          {"damping_weft", "s"}}};

/// Springs of the six types, 0 to 5, as a model file gives them instead of a fabric. They belong to
/// one mesh.
struct ModelSprings {
  using ByType = std::array<double, 6>;
  ByType natural_length_m{};                    ///< > 0
  ByType stiffness_n_per_m{};                   ///< not all 0
  ByType damping_ns_per_m{};                    ///< along the spring
  std::optional<ByType> critical_elongation{};  ///< present where strain is limited
  bool operator==(const ModelSprings&) const = default;
};

/// The state of a cloth that already moves when its simulation begins. 3 x vertices, column i *
/// columns + j is vertex [i, j]; world.
struct ModelStartState {
  Eigen::Matrix3Xd position_m;
  Eigen::Matrix3Xd velocity_m_per_s;
};

/// The place of the flat, unstretched sheet: x_world = orientation * (s, t, 0) + position_m.
struct SheetPose {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
};

enum class StrainLimitKind { off, positions, rates_first, consistent };

/// Returns the word of model files.
std::string to_string(StrainLimitKind kind);

/// A prescribed point or edge; `motion` is fixed or path.
struct ModelHeldPoint {
  HeldPoint point;
  HeldPath path;  ///< for `path`
};

/// The content of a model file (format clothfit-model/1): a cloth with every number that its
/// simulation needs.
struct ModelDescription {
  std::string file;  ///< as the user gave it, for messages; empty when it was not read from one
  std::string name;
  ClothDescription cloth;  ///< with its mass
  int mesh_columns = 0;    ///< of the simulation
  int mesh_rows = 0;
  std::map<std::string, double> fabric;  ///< a value for each of kFabricParameters
  std::optional<ModelSprings> springs;   ///< given instead of a fabric
  StrainLimitKind strain_limit = StrainLimitKind::off;
  /// Limit of every spring, as a share of its natural length; `springs` have their own.
  double critical_elongation = 0;
  Eigen::Vector3d gravity_m_per_s2{0, 0, -9.81};
  std::optional<SurfaceMesh> obstacle;  ///< touched by the effect contact_mesh
  std::filesystem::path obstacle_file;  ///< that it was read from; empty where it was not
  std::vector<ModelHeldPoint> held;
  std::vector<DeclaredEffect> effects;  ///< a parameter that is left out is at its neutral value
  StartKind start = StartKind::released_flat;
  SheetPose sheet;                             ///< for starts without `start_state`
  std::optional<ModelStartState> start_state;  ///< for a start that recordings call `unknown`
  std::vector<double> frame_time_s;            ///< rising, at least two
  std::optional<double> frame_rate_hz;         ///< when they are evenly spaced
  std::optional<double> time_step_s;           ///< absent: as stability allows

  /// Lines in the file, for messages; 0 when unknown.
  int fabric_line = 0;  ///< of `fabric` or `springs`
  int time_step_line = 0;
  /// Returns FILE:LINE of this model, in the form of InputError.
  std::string where(int line) const;
};

/// The largest number of frames that a simulation may have.
inline constexpr int kMostModelFrames = 1'000'000;

/// Returns the times of the frames from 0 to `duration_s` at a constant rate. Nothing when that is
/// less than two frames or more than kMostModelFrames.
std::optional<std::vector<double>> frame_times(double frame_rate_hz, double duration_s);

/// Reads a model file and the tables and the surface that it names. Throws InputError, with file
/// and line.
ModelDescription read_model(const std::filesystem::path& file,
                            OutsideFiles outside = OutsideFiles::refused);

/// Writes `folder`/model.yaml, which read_model reads back to the last bit. Beside it stand
/// held/NUMBER.csv for the paths of held points, obstacle.obj for the obstacle, start.csv for a
/// start in motion, and times.csv where the frames are not evenly spaced: nothing outside the
/// folder is needed.
void write_model(const ModelDescription& model, const std::filesystem::path& folder);

}  // namespace clothfit
