#pragma once

#include <Eigen/Core>
#include <vector>

namespace clothfit {

/// Predictions that know no physics, to judge a fit by. A model that does not beat them has learnt
/// nothing. They see the frames before `held_out_from` and, where points of the cloth are held, the
/// motion of these throughout (a model is given it too).
///
/// Tracks are a matrix per marker, coordinates x frames (metres in space or pixels of a camera),
/// NaN where the marker was not observed.
struct TrivialPrediction {
  /// Per marker, coordinates x frames; NaN where the predictor says nothing.
  std::vector<Eigen::MatrixXd> predicted;
  /// Root mean square over the coordinates of all markers observed and predicted, per frame; NaN
  /// for a frame without any.
  std::vector<double> rms_by_frame;
  double held_out_rms = 0;      ///< the same over all held-out frames together
  int held_out_count = 0;       ///< coordinates that it rests on; 0 leaves the rms NaN
  int late_markers = 0;         ///< markers that take a later frame's place for frame 0's
  int unpredicted_markers = 0;  ///< markers observed in held-out frames without a prediction
};

/// Predicts that every marker stays as in frame 0. One that was not observed there stays as in the
/// first fitted frame that shows it (`late_markers` counts these). One never observed before
/// `held_out_from` is not predicted. `held_out_from` is at least 1; at or beyond the last frame
/// nothing is held out.
TrivialPrediction predict_first_frame(const std::vector<Eigen::MatrixXd>& tracks,
                                      int held_out_from);

/// Predicts that every marker moves on from the last fitted frame with the mean of its last four
/// velocities. That is, from frame to frame, (x_last - x_first) / (t_last - t_first) over the last
/// five fitted frames. It says nothing of the fitted frames, nor of a marker seen in fewer than two
/// of the five. One that the last of them misses goes on from the latest that shows it. `time_s`
/// has one time per frame.
TrivialPrediction predict_last_velocity(const std::vector<double>& time_s,
                                        const std::vector<Eigen::MatrixXd>& tracks,
                                        int held_out_from);

/// Predicts that every marker moves with the held points: its place in frame 0 plus
/// `held_displacement`. The place is that of the first fitted frame that shows it, as above. The
/// displacement is coordinates x frames, the mean one of the held points since then, as from
/// mean_displacement(); NaN where it is unknown.
TrivialPrediction predict_rigid(const std::vector<Eigen::MatrixXd>& tracks,
                                const Eigen::MatrixXd& held_displacement, int held_out_from);

/// Returns the mean displacement of points since frame 0 (coordinates x frames). The mean is over
/// the points observed in frame 0 and in the frame; NaN where there are none.
Eigen::MatrixXd mean_displacement(const std::vector<Eigen::MatrixXd>& tracks);

}  // namespace clothfit
