#include "fit/observe/trivial_predictors.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

namespace clothfit {
namespace {

constexpr double kNotDefined = std::numeric_limits<double>::quiet_NaN();
constexpr Eigen::Index kVelocityIntervals = 4;

bool observed(const Eigen::MatrixXd& track, Eigen::Index frame) {
  return track.col(frame).allFinite();
}

/// Returns the first frame in [from, to) that shows the marker.
std::optional<Eigen::Index> first_observed(const Eigen::MatrixXd& track, Eigen::Index from,
                                           Eigen::Index to) {
  for (Eigen::Index frame = from; frame < to; ++frame)
    if (observed(track, frame)) return frame;
  return std::nullopt;
}

std::optional<Eigen::Index> last_observed(const Eigen::MatrixXd& track, Eigen::Index from,
                                          Eigen::Index to) {
  for (Eigen::Index frame = to - 1; frame >= from; --frame)
    if (observed(track, frame)) return frame;
  return std::nullopt;
}

/// Returns the number of frames before the held-out ones.
Eigen::Index fitted_frames(const Eigen::MatrixXd& track, int held_out_from) {
  assert(held_out_from >= 1);
  return std::min<Eigen::Index>(held_out_from, track.cols());
}

/// Judges `prediction.predicted` by the tracks.
TrivialPrediction judged(TrivialPrediction prediction, const std::vector<Eigen::MatrixXd>& tracks,
                         int held_out_from) {
  const Eigen::Index frames = tracks.empty() ? 0 : tracks.front().cols();
  const auto root_mean = [](double square, int count) {
    return count > 0 ? std::sqrt(square / count) : kNotDefined;
  };
  std::vector<bool> unpredicted(tracks.size(), false);
  double held_out_square = 0;
  for (Eigen::Index frame = 0; frame < frames; ++frame) {
    double square = 0;
    int count = 0;
    for (size_t m = 0; m < tracks.size(); ++m) {
      assert(tracks[m].cols() == frames);
      if (!observed(tracks[m], frame)) continue;
      if (observed(prediction.predicted[m], frame)) {
        square += (prediction.predicted[m].col(frame) - tracks[m].col(frame)).squaredNorm();
        count += static_cast<int>(tracks[m].rows());
      } else if (frame >= held_out_from) {
        unpredicted[m] = true;
      }
    }
    prediction.rms_by_frame.push_back(root_mean(square, count));
    if (frame >= held_out_from) {
      held_out_square += square;
      prediction.held_out_count += count;
    }
  }
  prediction.held_out_rms = root_mean(held_out_square, prediction.held_out_count);
  prediction.unpredicted_markers =
      static_cast<int>(std::count(unpredicted.begin(), unpredicted.end(), true));
  return prediction;
}

}  // namespace

TrivialPrediction predict_rigid(const std::vector<Eigen::MatrixXd>& tracks,
                                const Eigen::MatrixXd& held_displacement, int held_out_from) {
  TrivialPrediction prediction;
  for (const Eigen::MatrixXd& track : tracks) {
    assert(held_displacement.rows() == track.rows() && held_displacement.cols() == track.cols());
    Eigen::MatrixXd predicted = Eigen::MatrixXd::Constant(track.rows(), track.cols(), kNotDefined);
    if (const auto start = first_observed(track, 0, fitted_frames(track, held_out_from))) {
      predicted = held_displacement.colwise() + (track.col(*start) - held_displacement.col(*start));
      if (*start > 0) ++prediction.late_markers;
    }
    prediction.predicted.push_back(std::move(predicted));
  }
  return judged(std::move(prediction), tracks, held_out_from);
}

TrivialPrediction predict_first_frame(const std::vector<Eigen::MatrixXd>& tracks,
                                      int held_out_from) {
  if (tracks.empty()) return judged({}, tracks, held_out_from);
  return predict_rigid(tracks, Eigen::MatrixXd::Zero(tracks.front().rows(), tracks.front().cols()),
                       held_out_from);
}

TrivialPrediction predict_last_velocity(const std::vector<double>& time_s,
                                        const std::vector<Eigen::MatrixXd>& tracks,
                                        int held_out_from) {
  TrivialPrediction prediction;
  const auto time = [&](Eigen::Index frame) { return time_s[static_cast<size_t>(frame)]; };
  for (const Eigen::MatrixXd& track : tracks) {
    assert(time_s.size() == static_cast<size_t>(track.cols()));
    Eigen::MatrixXd predicted = Eigen::MatrixXd::Constant(track.rows(), track.cols(), kNotDefined);
    const Eigen::Index fitted = fitted_frames(track, held_out_from);
    const Eigen::Index from = std::max<Eigen::Index>(0, fitted - 1 - kVelocityIntervals);
    const auto first = first_observed(track, from, fitted);
    const auto last = last_observed(track, from, fitted);
    if (first && *first < *last) {
      const Eigen::VectorXd velocity =
          (track.col(*last) - track.col(*first)) / (time(*last) - time(*first));
      for (Eigen::Index frame = fitted; frame < track.cols(); ++frame)
        predicted.col(frame) = track.col(*last) + (time(frame) - time(*last)) * velocity;
    }
    prediction.predicted.push_back(std::move(predicted));
  }
  return judged(std::move(prediction), tracks, held_out_from);
}

Eigen::MatrixXd mean_displacement(const std::vector<Eigen::MatrixXd>& tracks) {
  if (tracks.empty()) return {};
  const Eigen::Index coordinates = tracks.front().rows(), frames = tracks.front().cols();
  Eigen::MatrixXd mean = Eigen::MatrixXd::Constant(coordinates, frames, kNotDefined);
  for (Eigen::Index frame = 0; frame < frames; ++frame) {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(coordinates);
    int count = 0;
    for (const Eigen::MatrixXd& track : tracks) {
      if (!observed(track, 0) || !observed(track, frame)) continue;
      sum += track.col(frame) - track.col(0);
      ++count;
    }
    if (count > 0) mean.col(frame) = sum / count;
  }
  return mean;
}

}  // namespace clothfit
