#include "apps/study/vision/dot_rows.h"

#include <map>
#include <utility>

#include "apps/study/vision/judge_dots.h"
#include "apps/study/vision/judged_recording.h"
#include "apps/study/vision/pictures_in_memory.h"
#include "data/input_error.h"
#include "data/recording.h"
#include "fit/jobs/draws.h"
#include "vision/degrade/brightness.h"
#include "vision/degrade/motion_blur.h"
#include "vision/track/track.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

/// True sightings by frame and marker.
using Sightings = std::map<std::pair<int, int>, TrueSighting>;

/// Returns how dots move around a frame: half of the way from the frame before to the one after.
std::vector<PointMotion> dot_motions(const Sightings& truth, int frame) {
  std::vector<PointMotion> motions;
  for (auto here = truth.lower_bound({frame, 0}); here != truth.end() && here->first.first == frame;
       ++here) {
    const auto before = truth.find({frame - 1, here->first.second});
    const auto after = truth.find({frame + 1, here->first.second});
    const TrueSighting& from = before != truth.end() ? before->second : here->second;
    const TrueSighting& to = after != truth.end() ? after->second : here->second;
    motions.push_back(
        {.at_px = here->second.pixel_px, .motion_px = (to.pixel_px - from.pixel_px) / 2});
  }
  return motions;
}

const CameraEntry& camera_of(const Recording& recording, const std::string& name) {
  for (const CameraEntry& camera : recording.cameras)
    if (camera.name == name && camera.images) return camera;
  throw InputError(recording.folder.string(), "has no pictures of camera '" + name + "'",
                   "a camera with `images`");
}

}  // namespace

PictureSpoil untouched() {
  return [](const cv::Mat& grey, const std::vector<PointMotion>&, std::uint64_t) { return grey; };
}

PictureSpoil with_noise(double noise_levels) {
  return [=](const cv::Mat& grey, const std::vector<PointMotion>&, std::uint64_t seed) {
    return with_brightness(grey, 1, noise_levels, seed);
  };
}

PictureSpoil blurred_by(double length_px) {
  return [=](const cv::Mat& grey, const std::vector<PointMotion>& motions, std::uint64_t seed) {
    constexpr double kSensorNoise = 1;  // grey levels
    const auto scaled = scaled_to_median(motions, length_px);
    return with_brightness(blur_along(grey, displacement_field(scaled, grey.size())), 1,
                           kSensorNoise, seed);
  };
}

TagScore score_dots(const fs::path& folder, const std::string& camera, const PictureSpoil& spoil,
                    std::uint64_t seed) {
  const Recording recording = read_recording(folder);
  const CameraEntry& entry = camera_of(recording, camera);
  const auto sightings =
      read_true_sightings(folder / ("truth_tracks2d_" + camera + ".csv.gz"), recording.markers);
  Sightings truth;
  TagScore score;
  for (const TrueSighting& sighting : sightings) {
    if (recording.markers.markers[static_cast<size_t>(sighting.marker)].tag) continue;
    truth[{sighting.frame, sighting.marker}] = sighting;
    score.visible += sighting.visible ? 1 : 0;
  }
  std::vector<cv::Mat> pictures;
  for (const fs::path& file : picture_files(*entry.images)) {
    const auto frame = static_cast<int>(pictures.size());
    pictures.push_back(
        spoil(read_grey(file), dot_motions(truth, frame), derived_seed(seed, frame)));
  }
  PicturesInMemory source(pictures);
  const TrackResult result = track(recording, entry, source, TrackOptions(), {});
  constexpr double kFalse_px = 3;  // another dot's place is further away
  for (const Position2d& row : result.tracks) {
    const auto place = truth.find({row.frame, row.marker});
    if (!row.rejected.empty() || place == truth.end()) continue;
    const double error_px = (row.position_px - place->second.pixel_px).norm();
    score.false_tags += error_px > kFalse_px;
    score.hidden_reported += !place->second.visible;
    if (error_px > kFalse_px || !place->second.visible) continue;
    ++score.found;
    score.error_px.push_back(error_px);
    score.error_over_sigma.push_back(error_px / row.sigma_px);
  }
  return score;
}

}  // namespace clothfit
