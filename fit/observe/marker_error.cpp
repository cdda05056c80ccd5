#include "fit/observe/marker_error.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace clothfit {
namespace {

struct Squares {
  double sum = 0;
  int count = 0;
};

Squares squared_distances(const Eigen::MatrixXd& observed, const Eigen::MatrixXd& predicted) {
  assert(observed.rows() == predicted.rows() && observed.cols() == predicted.cols());
  Squares squares;
  for (Eigen::Index frame = 0; frame < observed.cols(); ++frame) {
    const double squared = (predicted.col(frame) - observed.col(frame)).squaredNorm();
    if (!std::isfinite(squared)) continue;
    squares.sum += squared;
    ++squares.count;
  }
  return squares;
}

double root_of_mean(double sum, double weight) {
  return weight > 0 ? std::sqrt(sum / weight) : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

double rms_distance(const std::vector<Eigen::MatrixXd>& observed,
                    const std::vector<Eigen::MatrixXd>& predicted) {
  assert(observed.size() == predicted.size());
  Squares all;
  for (size_t m = 0; m < observed.size(); ++m) {
    const Squares marker = squared_distances(observed[m], predicted[m]);
    all.sum += marker.sum;
    all.count += marker.count;
  }
  return root_of_mean(all.sum, all.count);
}

std::vector<Eigen::MatrixXd> centred(const std::vector<Eigen::MatrixXd>& observed,
                                     std::vector<Eigen::MatrixXd> predicted, int held_out_from) {
  assert(observed.size() == predicted.size());
  for (size_t m = 0; m < observed.size(); ++m) {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(observed[m].rows());
    int count = 0;
    for (Eigen::Index frame = 0; frame < std::min<Eigen::Index>(held_out_from, observed[m].cols());
         ++frame) {
      const Eigen::VectorXd difference = observed[m].col(frame) - predicted[m].col(frame);
      if (!difference.allFinite()) continue;
      sum += difference;
      ++count;
    }
    if (count > 0) predicted[m].colwise() += sum / count;
  }
  return predicted;
}

double weighted_rms_distance(const std::vector<Eigen::MatrixXd>& observed,
                             const std::vector<Eigen::MatrixXd>& predicted,
                             const std::vector<double>& weights) {
  assert(observed.size() == predicted.size() && observed.size() == weights.size());
  double sum = 0, weight = 0;
  for (size_t m = 0; m < observed.size(); ++m) {
    const Squares marker = squared_distances(observed[m], predicted[m]);
    if (marker.count == 0) continue;
    sum += weights[m] * marker.sum / marker.count;
    weight += weights[m];
  }
  return root_of_mean(sum, weight);
}

}  // namespace clothfit
