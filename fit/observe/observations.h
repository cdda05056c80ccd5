#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "data/camera_parameters.h"
#include "data/tracks.h"
#include "model/topology/surface.h"

namespace clothfit {

/// One measured place of a marker, in 3D (m, world) or in a camera's pixels (third number unused).
struct Observation {
  int frame = 0;
  int marker = 0;
  Eigen::Vector3d observed = Eigen::Vector3d::Zero();
  double sigma = 0;  ///< per coordinate, > 0
};

/// All observations of one kind, sorted by frame, then marker.
struct ObservationSet {
  std::string kind;  ///< "tracks3d" or the camera's name
  std::string unit;  ///< "m" or "px"
  int dimension = 3;
  std::optional<CameraParameters> camera;  ///< has a pose; for pixels
  std::vector<Observation> rows;
  double noise = 0;  ///< root mean square of the rows' sigma

  /// Returns where the set's observer sees a point of the world; nothing behind a camera.
  /// `by_position`, where given, is set to the derivative (for pixels, its third row is 0).
  std::optional<Eigen::Vector3d> predict(const Eigen::Vector3d& position_m,
                                         Eigen::Matrix3d* by_position = nullptr) const;
};

/// The times of a recording's frames, and the first one held out (their number when none is).
struct ObservedFrames {
  std::vector<double> time_s;
  int first_held_out = 0;
};

/// Returns the usable rows of measured tracks. A row without a sigma gets the one estimated from
/// the fitted frames (fit/observe/noise.h). Rejected rows and those of `excluded` markers (they
/// drive held points) are left out and counted in `rejected` by reason.
ObservationSet observations_3d(const Tracks3d& tracks, const ObservedFrames& frames,
                               int marker_count, const std::vector<int>& excluded,
                               std::map<std::string, int>& rejected);
ObservationSet observations_2d(const Tracks2d& tracks, const CameraParameters& camera,
                               const ObservedFrames& frames, int marker_count,
                               const std::vector<int>& excluded,
                               std::map<std::string, int>& rejected);

/// Returns (s, t) of every marker, 2 x markers, m.
Eigen::Matrix2Xd marker_places(const MarkerSet& markers);

/// Returns the set as a matrix per marker, coordinates x frames, NaN where it was not observed.
std::vector<Eigen::MatrixXd> marker_tracks(const ObservationSet& set, int marker_count, int frames);

/// Returns positions of the markers in every frame, from the mesh's: one 3 x markers matrix a
/// frame.
std::vector<Eigen::Matrix3Xd> marker_positions(const Surface::Weights& vertex_weights,
                                               const std::vector<Eigen::Matrix3Xd>& mesh_positions);

}  // namespace clothfit
