#include "apps/study/scene/synthetic_recording.h"

#include "apps/study/scene/true_sight.h"
#include "fit/jobs/draws.h"

namespace clothfit {
namespace {

Recording recording_of(const SyntheticScene& scene) {
  Recording recording = scene_recording(scene);
  for (int i = 0; i < scene.markers; ++i) {
    for (int j = 0; j < scene.markers; ++j) {
      const std::string name = std::to_string(i) + "_" + std::to_string(j);
      recording.markers.index[name] = i * scene.markers + j;
      recording.markers.markers.push_back({.name = name,
                                           .s_m = scene.size_m * j / (scene.markers - 1),
                                           .t_m = scene.size_m * i / (scene.markers - 1)});
    }
  }
  return recording;
}

/// Decides which observations of one observer are lost, and which are gross outliers.
class Spoiled {
 public:
  Spoiled(const SyntheticScene& scene, std::uint64_t seed, int observer)
      : scene_(scene), losses_(seed, kLosses, observer), hand_(seed, kHand, 0) {
    // The hand comes to a place of its own in each recording, the same for all observers.
    hand_s_ = hand_.uniform();
    hand_t_ = hand_.uniform();
    hand_from_ = hand_.uniform() * (scene.frames - scene.frames / 3);
  }

  /// Draws for one observation, in a fixed order.
  void draw() {
    lost_ = losses_.uniform() < scene_.missing;
    outlier_ = losses_.uniform() < scene_.outliers;
  }
  bool is_lost(int frame, const Marker& marker) const {
    if (lost_) return true;
    if (!scene_.hand || frame == 0) return false;
    if (frame < hand_from_ || frame >= hand_from_ + scene_.frames / 3) return false;
    const auto covered = [&](double at_m, double corner) {
      const double from_m = 0.5 * scene_.size_m * corner;
      return at_m >= from_m && at_m <= from_m + 0.5 * scene_.size_m;
    };
    return covered(marker.s_m, hand_s_) && covered(marker.t_m, hand_t_);
  }
  /// Returns how far off an outlier is in one coordinate, 0 for the others.
  double error(double most) {
    const double share = 2 * losses_.uniform() - 1;
    return outlier_ ? most * share : 0;
  }

 private:
  const SyntheticScene& scene_;
  Draws losses_, hand_;
  double hand_s_ = 0, hand_t_ = 0, hand_from_ = 0;
  bool lost_ = false, outlier_ = false;
};

}  // namespace

SyntheticRecording make_synthetic_recording(const SyntheticScene& scene, std::uint64_t seed) {
  return make_synthetic_recording(scene, seed, seed);
}

SyntheticRecording make_synthetic_recording(const SyntheticScene& scene, std::uint64_t release_seed,
                                            std::uint64_t seed) {
  constexpr double kOutlierM = 0.1, kOutlierPx = 60;
  const double noise_share = scene.noisy ? 1 : 0;
  SyntheticRecording result;
  FitInput& input = result.input;
  input.recording = recording_of(scene);
  const TrueSight sight(scene, input.recording, release_seed);
  const std::vector<Marker>& places = input.recording.markers.markers;
  const auto marker_count = static_cast<int>(places.size());

  Spoiled spoiled(scene, seed, 0);
  Draws noise(seed, kNoise3d, 0);
  for (int f = 0; f < scene.frames; ++f) {
    const Eigen::Matrix3Xd places_m = sight.places(f);
    for (int m = 0; m < marker_count; ++m) {
      spoiled.draw();
      Eigen::Vector3d place = places_m.col(m);
      for (double& coordinate : place)
        coordinate += noise_share * scene.noise_m * noise.normal() + spoiled.error(kOutlierM);
      if (spoiled.is_lost(f, places[static_cast<size_t>(m)])) continue;
      input.tracks3d.push_back(
          {.frame = f, .marker = m, .position_m = place, .sigma_m = scene.noise_m});
    }
  }
  for (int c = 0; c < scene.cameras; ++c) {
    const CameraParameters camera = scene_camera(scene, c, 960, 720);
    input.recording.cameras.push_back({.name = camera.name});
    input.cameras.push_back(camera);
    Spoiled lost(scene, seed, 1 + c);
    Draws pixels(seed, kNoise2d, c);
    Tracks2d& tracks = input.tracks2d[camera.name];
    for (int f = 0; f < scene.frames; ++f) {
      const std::vector<std::optional<Eigen::Vector2d>> seen = sight.pixels(f, camera);
      for (int m = 0; m < marker_count; ++m) {
        lost.draw();
        Eigen::Vector2d error;
        for (double& coordinate : error)
          coordinate = noise_share * scene.noise_px * pixels.normal() + lost.error(kOutlierPx);
        const std::optional<Eigen::Vector2d>& pixel = seen[static_cast<size_t>(m)];
        if (!pixel || lost.is_lost(f, places[static_cast<size_t>(m)])) continue;
        tracks.push_back(
            {.frame = f, .marker = m, .position_px = *pixel + error, .sigma_px = scene.noise_px});
      }
    }
  }
  result.truth = scene_truth(scene);
  return result;
}

}  // namespace clothfit
