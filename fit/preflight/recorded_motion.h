#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "calib/camera/rigid3.h"
#include "fit/interface/fit_input.h"
#include "fit/interface/fit_options.h"
#include "fit/observe/observations.h"

namespace clothfit {

/// The tracks of a recording as its checks look at them: every marker in every frame, those that
/// drive held points and those held out among them. "Units" are a set's own: metres, or pixels.
class RecordedMotion {
 public:
  /// Throws InputError where there is nothing to look at. Refers to the input, which must outlive
  /// it.
  RecordedMotion(const FitInput& input, ObservationKind kind);

  const Recording& recording() const { return input_.recording; }
  const FitInput& input() const { return input_; }
  const std::vector<double>& time_s() const { return time_s_; }
  int frames() const { return static_cast<int>(time_s_.size()); }
  int markers() const { return static_cast<int>(marker_m_.cols()); }
  const Eigen::Matrix2Xd& marker_m() const { return marker_m_; }
  int sets() const { return static_cast<int>(sets_.size()); }
  const ObservationSet& set(int s) const { return sets_[static_cast<size_t>(s)]; }
  /// Root of the cloth's area, m.
  double size_m() const;

  /// Returns the observed places of all markers in a frame, coordinates x markers, NaN where one
  /// was not seen.
  Eigen::MatrixXd places(int s, int frame) const;
  /// Returns the first frame of a set that shows at least four markers, or -1.
  int first_frame(int s) const { return first_frame_[static_cast<size_t>(s)]; }
  /// Returns how many units a metre of the cloth takes there: the median over neighbouring markers,
  /// less what noise adds to their distances. For 3D tracks in metres of a flat sheet it is 1. 0
  /// where no frame shows neighbours.
  double units_per_m(int s) const { return units_per_m_[static_cast<size_t>(s)]; }
  /// Returns the noise per coordinate, m. `units_per_m` must not be 0.
  double noise_m(int s) const { return set(s).noise / units_per_m(s); }
  /// Returns where frame 0 puts the flat sheet (place_flat_sheet), over all sets.
  const std::optional<Rigid3>& flat_sheet() const { return flat_sheet_; }
  /// Returns frames to look at, evenly spread where there are more than `most`.
  std::vector<int> sampled_frames(int most) const;

  /// Returns the markers that any frame shows.
  const std::vector<int>& tracked() const { return tracked_; }
  /// Returns those nearest to a marker on the cloth, the nearest first, without itself. There are
  /// none of a marker that is not tracked.
  const std::vector<int>& neighbours(int m) const { return neighbours_[static_cast<size_t>(m)]; }
  /// Returns the tracked markers that are nearest to a point of the cloth, the nearest first.
  std::vector<int> nearest(const Eigen::Vector2d& point_m, int count) const;

 private:
  int find_first_frame(int s) const;
  double measured_units_per_m(int s) const;

  const FitInput& input_;
  std::vector<double> time_s_;
  Eigen::Matrix2Xd marker_m_;
  std::vector<ObservationSet> sets_;
  std::vector<std::vector<size_t>> first_row_;  ///< [set][frame], and one more
  std::vector<int> first_frame_;
  std::vector<double> units_per_m_;
  std::optional<Rigid3> flat_sheet_;
  std::vector<int> tracked_;
  std::vector<std::vector<int>> neighbours_;
};

/// Returns the distance of two observed places without what noise adds to it in the mean. `noise`
/// is that of a coordinate.
double distance_less_noise(const Eigen::VectorXd& step, double noise);

/// Returns how far a point of the cloth is from what is held, m; infinite where nothing is.
double distance_to_held_m(const Recording& recording, const Eigen::Vector2d& point_m);

/// Predicts where a point of the cloth is seen from the markers `near` it, by the affine map that
/// fits most of them. `place` holds one frame (coordinates x markers, NaN where not seen). Returns
/// nothing where fewer than four are seen, or all on a line.
std::optional<Eigen::VectorXd> place_among(const Eigen::Matrix2Xd& marker_m,
                                           const Eigen::MatrixXd& place,
                                           const std::vector<int>& near,
                                           const Eigen::Vector2d& point_m);

/// Returns the `count` of these markers that are nearest to a point of the cloth, the nearest
/// first.
std::vector<int> nearest_markers(const Eigen::Matrix2Xd& marker_m, std::vector<int> markers,
                                 const Eigen::Vector2d& point_m, int count);

}  // namespace clothfit
