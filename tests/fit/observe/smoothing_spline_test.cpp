// Checks a smooth path through a noisy track. Not checked here: held points that follow such paths
// (tests/model/integrate/step_test.cpp), and noise estimates without a path (noise_test.cpp).

#include "fit/observe/smoothing_spline.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>

namespace clothfit {
namespace {

/// Draws normal numbers by Box and Muller: the library's own differ between libraries.
class Noise {
 public:
  explicit Noise(unsigned long long seed) : engine_(seed) {}
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  double normal() {
    const double radius = std::sqrt(-2 * std::log1p(-uniform()));
    return radius * std::cos(2 * std::numbers::pi * uniform());
  }

 private:
  std::mt19937_64 engine_;
};

/// Returns times with a mean interval of 1/60 s, each off by up to a third of it, some left out.
std::vector<double> irregular_times(int count, unsigned long long seed) {
  Noise noise(seed);
  std::vector<double> time_s;
  for (int k = 0; static_cast<int>(time_s.size()) < count; ++k) {
    if (noise.uniform() < 0.1) continue;
    time_s.push_back((k + noise.uniform() / 3) / 60);
  }
  return time_s;
}

template <class Path>
Eigen::MatrixXd sample(const std::vector<double>& time_s, const Path& path) {
  Eigen::MatrixXd samples(path(0.0).size(), static_cast<Eigen::Index>(time_s.size()));
  for (size_t k = 0; k < time_s.size(); ++k)
    samples.col(static_cast<Eigen::Index>(k)) = path(time_s[k]);
  return samples;
}

Eigen::MatrixXd with_noise(Eigen::MatrixXd samples, double sigma, unsigned long long seed) {
  Noise noise(seed);
  for (double& value : samples.reshaped()) value += sigma * noise.normal();
  return samples;
}

/// Swings 10 cm to and fro, once a second; the third coordinate lags.
Eigen::Vector3d swing(double t) {
  const double w = 2 * std::numbers::pi;
  return {0.1 * std::sin(w * t), 0.03 * std::cos(0.5 * w * t), -0.5 + 0.05 * std::sin(w * t - 1)};
}
Eigen::Vector3d line(double t) {
  return {1 - 0.3 * t, 0.2 + 2 * t, 5.0};
}

double rms(const Eigen::MatrixXd& m) {
  return std::sqrt(m.squaredNorm() / static_cast<double>(m.size()));
}

constexpr double kSigma = 0.0005;

TEST(SmoothingSpline, ReproducesAStraightLineWhateverTheSmoothing) {
  const auto time_s = irregular_times(80, 1);
  const Eigen::MatrixXd samples = sample(time_s, line);
  for (const std::optional<double> smoothing :
       {std::optional<double>(1e-12), {1e-4}, {1.0}, {1e6}, std::optional<double>()}) {
    SmoothingSplineOptions options;
    options.smoothing = smoothing;

    const SmoothingSpline spline = fit_smoothing_spline(time_s, samples, {}, options);

    for (const double t : {-3.0, 0.0, 0.123, 0.77, 1.2, 10.0}) {
      EXPECT_LT((spline.position(t) - line(t)).norm(), 1e-8) << t;
      EXPECT_LT((spline.velocity(t) - Eigen::Vector3d(-0.3, 2, 0)).norm(), 1e-8) << t;
    }
    EXPECT_LT(spline.noise_sigma, 1e-12);
    EXPECT_EQ(std::count(spline.outlier.begin(), spline.outlier.end(), true), 0);
  }
}

TEST(SmoothingSpline, PassesThroughTheSamplesWithoutSmoothing) {
  const auto time_s = irregular_times(40, 2);
  const Eigen::MatrixXd samples = with_noise(sample(time_s, swing), 0.01, 2);

  const SmoothingSpline spline =
      fit_smoothing_spline(time_s, samples, {}, {.smoothing = 1e-16, .robust = false});

  EXPECT_LT((spline.value - samples).cwiseAbs().maxCoeff(), 1e-7);
  EXPECT_NEAR(spline.degrees_of_freedom, 40, 1e-3);
}

TEST(SmoothingSpline, BecomesTheRegressionLineWithAllSmoothing) {
  const auto time_s = irregular_times(40, 3);
  const Eigen::MatrixXd samples = with_noise(sample(time_s, line), kSigma, 3);
  Eigen::MatrixXd design(40, 2);
  design.col(0).setOnes();
  design.col(1) = Eigen::Map<const Eigen::VectorXd>(time_s.data(), 40);
  const Eigen::MatrixXd regression =
      (design * design.colPivHouseholderQr().solve(samples.transpose())).transpose();

  const SmoothingSpline spline =
      fit_smoothing_spline(time_s, samples, {}, {.smoothing = 1e6, .robust = false});

  EXPECT_LT((spline.value - regression).cwiseAbs().maxCoeff(), 1e-7);
  EXPECT_NEAR(spline.degrees_of_freedom, 2, 1e-4);
}

TEST(SmoothingSpline, AgreesWithADenseSolveOfItsDefinition) {
  // The spline minimises |y - f|^2_W + lambda f' K f, K = Q R^-1 Q'. The map from samples to
  // values, its diagonal and its trace are formed densely.
  const int n = 25;
  const auto time_s = irregular_times(n, 4);
  const Eigen::MatrixXd samples = with_noise(sample(time_s, swing), kSigma, 4);
  std::vector<double> sigma;
  Noise noise(5);
  for (int k = 0; k < n; ++k) sigma.push_back(0.5 + noise.uniform());
  Eigen::MatrixXd q = Eigen::MatrixXd::Zero(n, n - 2), r = Eigen::MatrixXd::Zero(n - 2, n - 2);
  for (int i = 0; i < n - 2; ++i) {
    const auto k = static_cast<size_t>(i);
    const double a = time_s[k + 1] - time_s[k], b = time_s[k + 2] - time_s[k + 1];
    q.col(i).segment<3>(i) << 1 / a, -1 / a - 1 / b, 1 / b;
    r(i, i) = (a + b) / 3;
    if (i + 1 < n - 2) r(i, i + 1) = r(i + 1, i) = b / 6;
  }
  const double lambda = 1e-5;
  const Eigen::VectorXd weight =
      Eigen::Map<const Eigen::VectorXd>(sigma.data(), n).array().square().inverse();
  const Eigen::MatrixXd penalty = q * r.ldlt().solve(q.transpose());
  const Eigen::MatrixXd hat = (Eigen::MatrixXd(weight.asDiagonal()) + lambda * penalty)
                                  .ldlt()
                                  .solve(Eigen::MatrixXd(weight.asDiagonal()));

  const SmoothingSpline spline =
      fit_smoothing_spline(time_s, samples, sigma, {.smoothing = lambda, .robust = false});

  const Eigen::MatrixXd value = samples * hat.transpose();
  EXPECT_LT((spline.value - value).cwiseAbs().maxCoeff(), 1e-10);
  EXPECT_NEAR(spline.degrees_of_freedom, hat.trace(), 1e-8);
  for (int k = 0; k < n; ++k) {
    const double expected =
        spline.noise_sigma * sigma[static_cast<size_t>(k)] * std::sqrt(hat(k, k));
    EXPECT_NEAR(spline.value_sigma[static_cast<size_t>(k)], expected, 1e-6 * expected);
  }
}

TEST(SmoothingSpline, RecoversTheNoise) {
  // There are 200 tracks of 3 x 150 samples. Left over are some 3 x 130 numbers: one estimate
  // scatters by 1 / sqrt(2 * 390) = 3.6 %, so 10 % is 2.8 of its standard deviations.
  const int trials = 200;
  int within = 0;
  double mean = 0;
  for (unsigned long long seed = 0; seed < trials; ++seed) {
    const auto time_s = irregular_times(150, seed);
    const Eigen::MatrixXd samples = with_noise(sample(time_s, swing), kSigma, 1000 + seed);

    const SmoothingSpline spline = fit_smoothing_spline(time_s, samples);

    mean += spline.noise_sigma / kSigma / trials;
    if (std::abs(spline.noise_sigma / kSigma - 1) < 0.1) ++within;
  }
  EXPECT_NEAR(mean, 1, 0.02);  // motion that the smoothing removes counts as noise
  EXPECT_GE(within, 195);
}

TEST(SmoothingSpline, NeverTakesTheNoiseForMotion) {
  // The tracks are short and of a slow motion. Cross-validation now and then follows every sample
  // there.
  for (unsigned long long seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE(seed);
    const auto time_s = irregular_times(60, seed);
    const Eigen::MatrixXd samples =
        with_noise(sample(time_s, [](double t) { return Eigen::VectorXd(swing(t).head(1)); }),
                   kSigma, 2000 + seed);

    const SmoothingSpline spline = fit_smoothing_spline(time_s, samples);

    EXPECT_LT(spline.degrees_of_freedom, 30);
    EXPECT_GT(spline.noise_sigma, 0.6 * kSigma);
  }
}

TEST(SmoothingSpline, FollowsASwingWellBelowTheNoise) {
  const auto time_s = irregular_times(300, 7);
  const Eigen::MatrixXd truth = sample(time_s, swing);

  const SmoothingSpline spline = fit_smoothing_spline(time_s, with_noise(truth, kSigma, 7));

  EXPECT_LT(rms(spline.value - truth), 0.5 * kSigma);
  double worst_velocity = 0;
  for (double t = 0.2; t < 5; t += 0.01) {
    const Eigen::Vector3d velocity = (swing(t + 1e-5) - swing(t - 1e-5)) / 2e-5;
    worst_velocity = std::max(worst_velocity, (spline.velocity(t) - velocity).norm());
  }
  EXPECT_LT(worst_velocity, 0.03);  // of 0.6 m/s; differences of the samples are off by 0.04 rms
}

TEST(SmoothingSpline, StatesTheErrorOfItsValues) {
  // Over many tracks the values scatter about the truth as value_sigma says.
  double whitened = 0;
  int count = 0;
  for (unsigned long long seed = 0; seed < 60; ++seed) {
    const auto time_s = irregular_times(100, seed);
    const Eigen::MatrixXd truth = sample(time_s, swing);
    const SmoothingSpline spline =
        fit_smoothing_spline(time_s, with_noise(truth, kSigma, 3000 + seed));
    if (spline.value.cols() != truth.cols()) continue;  // a sample beyond 4.5 sigma
    for (Eigen::Index k = 0; k < truth.cols(); ++k) {
      whitened += (spline.value.col(k) - truth.col(k)).squaredNorm() /
                  std::pow(spline.value_sigma[static_cast<size_t>(k)], 2);
      count += 3;
    }
  }
  // The prior behind the smoothing is rougher than a sine, so the stated error is a little on the
  // safe side.
  EXPECT_GT(count, 10000);
  EXPECT_LT(std::sqrt(whitened / count), 1.1);
  EXPECT_GT(std::sqrt(whitened / count), 0.7);
}

TEST(SmoothingSpline, LeavesOutGrossOutliers) {
  for (unsigned long long seed = 0; seed < 50; ++seed) {
    SCOPED_TRACE(seed);
    const auto time_s = irregular_times(200, seed);
    const Eigen::MatrixXd truth = sample(time_s, swing);
    const Eigen::MatrixXd clean = with_noise(truth, kSigma, 4000 + seed);
    Eigen::MatrixXd samples = clean;
    Noise noise(5000 + seed);
    std::vector<bool> spoilt(200, false);
    for (int k = 0; k < 10; ++k) {  // 5 %, by 20 to 200 sigma in one coordinate
      const auto which = static_cast<size_t>(200 * noise.uniform());
      spoilt[which] = true;
      samples(static_cast<Eigen::Index>(3 * noise.uniform()), static_cast<Eigen::Index>(which)) +=
          (noise.uniform() < 0.5 ? -1 : 1) * kSigma * (20 + 180 * noise.uniform());
    }

    const SmoothingSpline spline = fit_smoothing_spline(time_s, samples);
    const SmoothingSpline without = fit_smoothing_spline(time_s, clean);

    int missed = 0, refused = 0;
    for (size_t k = 0; k < 200; ++k) {
      if (spoilt[k] && !spline.outlier[k]) ++missed;
      if (!spoilt[k] && spline.outlier[k]) ++refused;
    }
    EXPECT_EQ(missed, 0);
    EXPECT_LE(refused, 1);
    EXPECT_NEAR(spline.noise_sigma, without.noise_sigma, 0.05 * kSigma);
    double square = 0;
    for (size_t k = 0; k < 200; ++k) {
      if (spline.outlier[k]) continue;  // a gap, at the ends even an extrapolation
      square += (spline.position(time_s[k]) - without.position(time_s[k])).squaredNorm();
    }
    EXPECT_LT(std::sqrt(square / (3 * 190)), 0.5 * kSigma);
  }
}

TEST(SmoothingSpline, TakesNoKinkForOutliersAndRoundsItByLessThanASample) {
  // The gripper starts at once: the velocity jumps by 0.6 m/s, 10 mm or 20 sigma per sample.
  const auto path = [](double t) { return Eigen::Vector2d(0.6 * std::max(0.0, t - 1), 0.1); };
  for (unsigned long long seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(seed);
    const auto time_s = irregular_times(120, seed);
    const Eigen::MatrixXd truth = sample(time_s, path);

    const SmoothingSpline spline =
        fit_smoothing_spline(time_s, with_noise(truth, kSigma, 6000 + seed));

    EXPECT_LE(std::count(spline.outlier.begin(), spline.outlier.end(), true), 2);
    for (size_t k = 0; k < time_s.size(); ++k)
      EXPECT_LT((spline.position(time_s[k]) - path(time_s[k])).norm(), 0.010) << time_s[k];
  }
}

/// Moves a support that rests for three seconds and is swung about for four, along so many axes.
Eigen::Vector3d rest_then_motion(double time_s, int axes) {
  const double t = std::max(0.0, time_s - 3);
  Eigen::Vector3d place(0.1 * (1 - std::cos(4 * t)), 0.15 * (1 - std::cos(3 * t)),
                        0.05 * (std::cos(6 * t) - 1));
  place.tail(3 - axes).setZero();
  return place;
}

TEST(SmoothingSpline, TakesNoFastMotionAfterARestForOutliers) {
  // Given that support seen ten times a second to half a millimetre. Its stamps are off by up to 20
  // ms, and twice it is seen 15 cm away, at rest and in motion.
  for (const int axes : {1, 2, 3}) {
    for (const unsigned long long seed : {1, 2, 3, 4, 5}) {
      SCOPED_TRACE(testing::Message() << axes << " axes, seed " << seed);
      Noise jitter(seed);
      std::vector<double> stamp_s;
      Eigen::MatrixXd samples(3, 70);
      for (Eigen::Index k = 0; k < 70; ++k) {
        const double seen_s = 0.1 * static_cast<double>(k);
        stamp_s.push_back(seen_s + 0.04 * (jitter.uniform() - 0.5));
        samples.col(k) = rest_then_motion(seen_s, axes);
      }
      samples = with_noise(samples, 0.5e-3, 10 + seed);
      for (const Eigen::Index spoilt : {12, 51}) samples(0, spoilt) += 0.15;

      const SmoothingSpline spline = fit_smoothing_spline(stamp_s, samples);

      EXPECT_TRUE(spline.outlier[12] && spline.outlier[51]);
      EXPECT_LE(std::count(spline.outlier.begin(), spline.outlier.end(), true), 5);
      for (size_t k = 1; k < 69; ++k) {
        if (k == 12 || k == 51) continue;
        // The tolerance is 20 ms at 0.6 m/s, and what a curve through such samples adds.
        const Eigen::Vector3d truth = rest_then_motion(0.1 * static_cast<double>(k), axes);
        EXPECT_LT((spline.position(stamp_s[k]) - truth).norm(), 0.025) << "sample " << k;
      }
    }
  }
}

TEST(SmoothingSpline, LeavesOutARowOfOutliersInATrackAtRest) {
  // Given a hand that for eight frames is taken for the marker, somewhere within some centimetres
  for (const unsigned long long seed : {1, 2, 3, 4, 5}) {
    const auto time_s = irregular_times(70, seed);
    Eigen::MatrixXd samples = with_noise(Eigen::MatrixXd::Zero(3, 70), kSigma, 20 + seed);
    samples.middleCols(30, 8) = with_noise(Eigen::MatrixXd::Constant(3, 8, 0.1), 0.03, 30 + seed);

    const SmoothingSpline spline = fit_smoothing_spline(time_s, samples);

    for (size_t k = 0; k < 70; ++k)
      EXPECT_EQ(spline.outlier[k], k >= 30 && k < 38) << "seed " << seed << ", sample " << k;
  }
}

TEST(SmoothingSpline, WeighsSamplesByTheirSigma) {
  const auto time_s = irregular_times(200, 8);
  const Eigen::MatrixXd truth = sample(time_s, swing);
  Eigen::MatrixXd samples = truth;
  std::vector<double> sigma;
  Noise noise(8);
  for (Eigen::Index k = 0; k < samples.cols(); ++k) {
    sigma.push_back(k % 2 == 0 ? kSigma : 10 * kSigma);
    for (double& value : samples.col(k)) value += sigma.back() * noise.normal();
  }

  const SmoothingSpline weighted = fit_smoothing_spline(time_s, samples, sigma);
  const SmoothingSpline unweighted = fit_smoothing_spline(time_s, samples, {}, {.robust = false});

  EXPECT_NEAR(weighted.noise_sigma, 1, 0.1);  // the sigmas given are right
  EXPECT_LT(rms(weighted.value - truth), 0.5 * rms(unweighted.value - truth));
}

TEST(SmoothingSpline, DerivativesAgreeWithDifferences) {
  const auto time_s = irregular_times(60, 9);
  const SmoothingSpline spline =
      fit_smoothing_spline(time_s, with_noise(sample(time_s, swing), kSigma, 9));
  const double h = 1e-5;
  for (double t = -0.2; t < 1.4; t += 0.0137) {
    const Eigen::VectorXd velocity = (spline.position(t + h) - spline.position(t - h)) / (2 * h);
    const Eigen::VectorXd acceleration =
        (spline.velocity(t + h) - spline.velocity(t - h)) / (2 * h);
    EXPECT_LT((spline.velocity(t) - velocity).norm(), 1e-6) << t;
    // f'' has corners at the knots: a difference across one is off by h f''' / 2.
    EXPECT_LT((spline.acceleration(t) - acceleration).norm(), 1e-2) << t;
  }
}

TEST(SmoothingSpline, IsStraightBeyondItsEnds) {
  const auto time_s = irregular_times(60, 10);
  const SmoothingSpline spline = fit_smoothing_spline(time_s, sample(time_s, swing));
  for (const auto& [end, outside] :
       {std::pair{time_s.front(), time_s.front() - 0.5}, {time_s.back(), time_s.back() + 0.5}}) {
    EXPECT_LT(spline.acceleration(end).norm(), 1e-9);
    EXPECT_EQ(spline.acceleration(outside).norm(), 0);
    EXPECT_LT(
        (spline.position(end) + (outside - end) * spline.velocity(end) - spline.position(outside))
            .norm(),
        1e-12);
  }
}

TEST(SmoothingSpline, MakesDoWithFewSamples) {
  const SmoothingSpline point = fit_smoothing_spline({0.5}, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(point.position(9.0), Eigen::Vector3d(1, 2, 3));
  EXPECT_TRUE(std::isnan(point.noise_sigma));

  const SmoothingSpline two = fit_smoothing_spline({0, 2}, sample({0, 2}, line));
  EXPECT_LT((two.position(5) - line(5)).norm(), 1e-12);
  EXPECT_TRUE(std::isnan(two.noise_sigma));

  // One second difference says nothing of its own smoothness: the straighter path is taken.
  const SmoothingSpline three = fit_smoothing_spline({0, 1, 2}, Eigen::RowVector3d(0, 1, 0));
  EXPECT_NEAR(three.position(1)(0), 1.0 / 3, 0.05);
}

}  // namespace
}  // namespace clothfit
