#include "tests/fit/smooth_misfit.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "fit/jobs/draws.h"

namespace clothfit {

namespace {

constexpr int kSide = 6;
constexpr int kFrames = 20;
constexpr double kLength_m = 0.4;

/// Returns the Cholesky factor of a squared-exponential covariance between evenly spaced places.
Eigen::MatrixXd factor(int count, double spacing, double range) {
  Eigen::MatrixXd covariance(count, count);
  for (int i = 0; i < count; ++i)
    for (int j = 0; j < count; ++j)
      covariance(i, j) = std::exp(-0.5 * std::pow((i - j) * spacing / range, 2));
  covariance.diagonal().array() += 1e-6;
  return covariance.llt().matrixL();
}

}  // namespace

ObservationPlaces misfit_places() {
  constexpr int kCount = kSide * kSide * kFrames;
  ObservationPlaces places{Eigen::VectorXd(kCount), Eigen::VectorXd(kCount),
                           Eigen::VectorXd(kCount), Eigen::VectorXi::Zero(kCount)};
  for (int i = 0; i < kCount; ++i) {
    places.time_s[i] = i % kFrames / (kFrames - 1.0);
    places.s_m[i] = kLength_m * (i / kFrames % kSide) / (kSide - 1);
    places.t_m[i] = kLength_m * (i / kFrames / kSide) / (kSide - 1);
  }
  return places;
}

MisfitReplicate draw_misfit(const SmoothMisfit& misfit, std::uint64_t seed, int replicate) {
  const Eigen::MatrixXd along = factor(kSide, kLength_m / (kSide - 1), misfit.range_m);
  const Eigen::MatrixXd in_time = factor(kFrames, 1.0 / (kFrames - 1), misfit.range_s);
  constexpr int kCount = kSide * kSide * kFrames;
  int fields = 0;
  const auto field = [&] {
    Draws draws(seed, replicate, fields++);
    // White is frames x markers: time runs down the columns.
    Eigen::MatrixXd white(kFrames, kSide * kSide);
    for (double& number : white.reshaped()) number = draws.normal();
    Eigen::MatrixXd smooth(kFrames, kSide * kSide);
    for (int f = 0; f < kFrames; ++f) {
      const Eigen::MatrixXd sheet = white.row(f).reshaped(kSide, kSide);
      smooth.row(f) = (along * sheet * along.transpose()).reshaped().transpose();
    }
    return Eigen::VectorXd((in_time * smooth).reshaped());
  };

  MisfitReplicate result;
  result.fit.jacobian.resize(kCount, misfit.coordinates);
  for (int p = 0; p < misfit.coordinates; ++p) result.fit.jacobian.col(p) = field();
  Eigen::VectorXd error = misfit.misfit_sigma * field();
  Draws noise(seed, replicate, fields);
  for (double& number : error) number += noise.normal();
  // The prediction less the observation, J x - error, is least here.
  const Eigen::MatrixXd& j = result.fit.jacobian;
  result.estimate = (j.transpose() * j).ldlt().solve(j.transpose() * error);
  result.fit.residual = j * result.estimate - error;
  return result;
}

}  // namespace clothfit
