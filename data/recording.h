#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "data/markers.h"
#include "data/obj_mesh.h"

namespace clothfit {

/// Whether a recording or a model may name tables, cameras, held paths and obstacles that lie
/// outside its folder. They are copied into results, so that a recording from elsewhere could bring
/// out any file of its reader's. Pictures, videos, clouds and body logs may lie anywhere: they are
/// never copied.
enum class OutsideFiles { refused, allowed };

/// `by_area`: an edge vertex weighs half, a corner a quarter. `equal`: as in the founding paper.
enum class MassDistribution { by_area, equal };

/// The largest mesh that a fit takes, 256 x 256; it then keeps some gigabytes of one run.
inline constexpr int kMostMeshVertices = 65'536;
constexpr bool is_possible_mesh(int columns, int rows) {
  return columns >= 2 && rows >= 2 && columns <= kMostMeshVertices / rows;
}

struct ClothDescription {
  double width_m = 0;             ///< along s; flat and unstretched; > 0
  double height_m = 0;            ///< along t; > 0
  std::optional<double> mass_kg;  ///< absent when it was not weighed
  MassDistribution masses = MassDistribution::by_area;
  int mesh_columns = 17;  ///< suggested mesh for a fit; >= 2
  int mesh_rows = 17;     ///< >= 2
};

/// Bounds of the inner corners along a side of a board. Fewer cannot be told from other corners,
/// more are finer than any picture shows.
inline constexpr int kFewestBoardCorners = 3;
inline constexpr int kMostBoardCorners = 60;

/// A printed calibration board; columns and rows count inner corners.
struct BoardDescription {
  int columns = 0;
  int rows = 0;
  double square_m = 0;
};
constexpr bool is_possible(const BoardDescription& board) {
  const auto possible = [](int n) { return n >= kFewestBoardCorners && n <= kMostBoardCorners; };
  return possible(board.columns) && possible(board.rows) && board.square_m > 0;
}

struct CalibrationStills {
  std::filesystem::path images;  ///< folder
  BoardDescription board;
};

/// A camera of a recording. Paths are absolute once read. Without images it belongs to a recording
/// of tracks alone; without a file it has stills to calibrate from.
struct CameraEntry {
  std::string name;
  std::optional<std::filesystem::path> file;
  std::optional<std::filesystem::path> images;  ///< folder of pictures, or a video file
  std::optional<CalibrationStills> calibration;
};

enum class HeldMotion {
  fixed,   ///< stays where it is in the start shape
  path,    ///< known path, from a file
  tracked  ///< follows its own measured track
};
enum class ClothEdge { top, bottom, left, right };  ///< top is t = 0, left is s = 0

/// A prescribed point (`edge` empty) or edge of the cloth.
struct HeldPoint {
  Eigen::Vector2d at_m = Eigen::Vector2d::Zero();  ///< (s, t)
  std::optional<ClothEdge> edge;
  HeldMotion motion = HeldMotion::fixed;
  std::optional<std::filesystem::path> file;  ///< for `path`
};

/// A known path of a held point: times rise, positions in world coordinates.
struct HeldPath {
  std::vector<double> time_s;
  std::vector<Eigen::Vector3d> position_m;
};

enum class StartKind { at_rest, released_flat, unknown };

/// An effect known to act. A parameter that is left out is fitted.
struct DeclaredEffect {
  std::string name;
  std::map<std::string, std::vector<double>> parameters;
  int line = 0;  ///< of recording.yaml; 0 when it was not read from there
};

struct RigidBody {
  std::string name;
  std::filesystem::path file;
  std::optional<double> clock_offset_s;  ///< absent when unknown
  std::vector<Eigen::Vector2d> holds_m;  ///< (s, t) of the points it holds
};

struct Clouds {
  std::string camera;
  std::filesystem::path folder;
};

/// The checked content of recording.yaml, with markers, times, reference points and obstacle read
/// in. Tracks, cameras and pictures are read when they are needed. Paths are absolute.
struct Recording {
  std::filesystem::path folder;
  std::string name;
  std::string origin;
  ClothDescription cloth;
  std::filesystem::path markers_file;
  MarkerSet markers;
  std::optional<double> frame_rate_hz;              ///< where the rate is constant
  std::optional<std::filesystem::path> times_file;  ///< else: the file of `times_s`
  std::vector<double> times_s;                      ///< rising
  Eigen::Vector3d gravity_m_per_s2{0, 0, -9.81};
  std::vector<CameraEntry> cameras;
  std::optional<std::filesystem::path> tracks3d;
  std::map<std::string, std::filesystem::path> tracks2d;  ///< camera name -> file
  std::optional<std::filesystem::path> reference_file;
  std::vector<ReferencePoint> reference;
  std::vector<RigidBody> bodies;
  std::optional<Clouds> clouds;
  std::optional<std::filesystem::path> obstacle_file;
  std::optional<SurfaceMesh> obstacle;  ///< read from its file; touched by the effect contact_mesh
  std::vector<HeldPoint> held;
  StartKind start = StartKind::at_rest;
  std::vector<DeclaredEffect> declared;
  std::optional<int> held_out_from_frame;  ///< no fit and no decision uses frames from this one on

  /// Returns the time of a frame; frame 0 need not be at 0. Throws InputError where the times file
  /// ends before this frame: the tracks then name one that was never timed.
  double frame_time_s(int frame) const;
  const CameraEntry* find_camera(const std::string& camera_name) const;
};

/// Reads `folder`/recording.yaml and the small tables and the surface it names. Throws InputError.
Recording read_recording(const std::filesystem::path& folder,
                         OutsideFiles outside = OutsideFiles::refused);

/// Returns every file and folder that a recording consists of, its own folder first. Results must
/// replace none of them.
std::vector<std::filesystem::path> input_paths(const Recording& recording);

/// Writes `folder`/recording.yaml and copies no file. All files are named relative to `folder`,
/// those outside it too ("../..."), so that pictures are used where they lie.
void write_recording(const Recording& recording, const std::filesystem::path& folder);

/// Reads a held point's path (columns time,x,y,z). Throws InputError.
HeldPath read_held_path(const std::filesystem::path& file);
void write_held_path(const HeldPath& path, const std::filesystem::path& file);

/// Each returns the word that recording.yaml uses.
std::string to_string(MarkerKind kind);
std::string to_string(HeldMotion motion);
std::string to_string(StartKind start);
std::string to_string(ClothEdge edge);

}  // namespace clothfit
