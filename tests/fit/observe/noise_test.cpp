// Checks the noise of tracks from their differences in time. Not checked here: noise from the
// residuals of a smooth path (smoothing_spline_test.cpp) or of a fitted cloth (fit_test.cpp).

#include "fit/observe/noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace clothfit {
namespace {

constexpr double kGap = std::numeric_limits<double>::quiet_NaN();
constexpr double kNoiseSigma = 0.0005;

class Draws {
 public:
  explicit Draws(unsigned long long seed) : engine_(seed) {}
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  double normal() {
    const double radius = std::sqrt(-2 * std::log1p(-uniform()));
    return radius * std::cos(2 * std::numbers::pi * uniform());
  }

 private:
  std::mt19937_64 engine_;
};

std::vector<double> even_times(int frames, double rate_hz) {
  std::vector<double> time_s;
  for (int f = 0; f < frames; ++f) time_s.push_back(f / rate_hz);
  return time_s;
}

/// Returns markers that swing by centimetres about once a second, each with its own phase.
std::vector<Eigen::MatrixXd> swinging_tracks(const std::vector<double>& time_s, int markers,
                                             double sigma, Draws& draws) {
  std::vector<Eigen::MatrixXd> tracks;
  for (int m = 0; m < markers; ++m) {
    Eigen::MatrixXd track(3, static_cast<Eigen::Index>(time_s.size()));
    for (Eigen::Index f = 0; f < track.cols(); ++f) {
      const double t = 2 * std::numbers::pi * time_s[static_cast<size_t>(f)];
      track.col(f) << 0.05 * std::sin(t + m), 0.02 * std::cos(1.3 * t - m), -0.4 + 0.01 * t;
      for (double& value : track.col(f)) value += sigma * draws.normal();
    }
    tracks.push_back(std::move(track));
  }
  return tracks;
}

TEST(Noise, IsRecoveredFromMovingMarkers) {
  // There are 20 x 3 x 69 differences, worth about a third of that: scatter 1 to 2 %.
  const auto time_s = even_times(72, 60);
  for (unsigned long long seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE(seed);
    Draws draws(seed);

    const NoiseEstimate noise =
        estimate_noise(time_s, swinging_tracks(time_s, 20, kNoiseSigma, draws));

    EXPECT_NEAR(noise.sigma, kNoiseSigma, 0.1 * kNoiseSigma);
    EXPECT_EQ(noise.differences, 20 * 3 * 69);
  }
}

TEST(Noise, HardlyFeelsOutliers) {
  const auto time_s = even_times(72, 60);
  for (unsigned long long seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE(seed);
    Draws draws(seed);
    auto tracks = swinging_tracks(time_s, 20, kNoiseSigma, draws);
    const double clean = estimate_noise(time_s, tracks).sigma;
    for (Eigen::MatrixXd& track : tracks) {
      for (double& value : track.reshaped())
        if (draws.uniform() < 0.05) value += 100 * kNoiseSigma * draws.normal();
    }

    const NoiseEstimate noise = estimate_noise(time_s, tracks);

    // 5 % of the values spoil 19 % of the differences (1 - 0.95^4). A plain median would be 30 %
    // too large, a root mean square 20 times.
    EXPECT_NEAR(noise.sigma, clean, 0.08 * clean);
  }
}

TEST(Noise, IsZeroForAParabola) {
  const auto time_s = even_times(10, 30);
  Eigen::MatrixXd track(2, 10);
  for (Eigen::Index f = 0; f < 10; ++f) {
    const double t = time_s[static_cast<size_t>(f)];
    track.col(f) << 1 + 2 * t - 4.9 * t * t, 3 * t;
  }

  EXPECT_LT(estimate_noise(time_s, {track}).sigma, 1e-15);
}

TEST(Noise, UsesRunsOfConsecutiveFramesOnly) {
  Draws draws(3);
  auto time_s = even_times(12, 60);
  for (size_t f = 6; f < 12; ++f) time_s[f] += 1;  // a pause between frames 5 and 6
  auto tracks = swinging_tracks(time_s, 1, kNoiseSigma, draws);

  // Six frames on either side hold three differences each.
  EXPECT_EQ(estimate_noise(time_s, tracks).differences, 3 * 6);

  // Without frame 1 only 2 ... 5 remains of the first side.
  tracks[0].col(1).setConstant(kGap);
  EXPECT_EQ(estimate_noise(time_s, tracks).differences, 3 * (1 + 3));
}

TEST(Noise, OfVeryManyTracksIsTakenFromSomeOfTheirFrames) {
  const auto time_s = even_times(500, 60);
  Draws draws(7);
  const auto tracks = swinging_tracks(time_s, 3000, kNoiseSigma, draws);

  const NoiseEstimate estimate = estimate_noise(time_s, tracks);

  EXPECT_EQ(estimate.differences, 3000 * 3 * 249);  // every other run of frames
  EXPECT_NEAR(estimate.sigma, kNoiseSigma, 0.005 * kNoiseSigma);
}

TEST(Noise, IsUnknownWithoutARun) {
  Eigen::MatrixXd track = Eigen::MatrixXd::Zero(2, 3);

  const NoiseEstimate noise = estimate_noise({0, 1, 2}, {track});

  EXPECT_TRUE(std::isnan(noise.sigma));
  EXPECT_EQ(noise.differences, 0);
}

}  // namespace
}  // namespace clothfit
