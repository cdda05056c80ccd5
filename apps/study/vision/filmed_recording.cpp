#include "apps/study/vision/filmed_recording.h"

#include <algorithm>
#include <opencv2/core.hpp>
#include <vector>

#include "data/input_error.h"
#include "fit/jobs/draws.h"
#include "vision/degrade/h264_video.h"
#include "vision/ingest/open_images.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

/// Pictures of a camera, each with its frame.
struct Film {
  std::vector<cv::Mat> pictures;
  std::vector<int> frames;
};

Film read_film(const Recording& recording) {
  if (recording.cameras.empty() || !recording.cameras.front().images)
    throw InputError(recording.folder.string(), "has no pictures", "a camera with `images`");
  Film film;
  const auto source = open_images(*recording.cameras.front().images);
  for (cv::Mat grey; source->next(grey); grey = cv::Mat()) {
    film.pictures.push_back(grey);
    film.frames.push_back(source->frame());
  }
  return film;
}

/// Leaves out pictures as a camera does that cannot keep up.
Film with_gaps(const Film& whole, unsigned long long seed) {
  constexpr double kLost = 0.2;
  constexpr int kSeries = 0xf11;
  Film film;
  for (size_t n = 0; n < whole.pictures.size(); ++n) {
    if (n > 0 && Draws(seed, kSeries, whole.frames[n]).uniform() < kLost) continue;
    film.pictures.push_back(whole.pictures[n]);
    film.frames.push_back(whole.frames[n]);
  }
  return film;
}

/// Writes the pictures with their times, and makes the video those of the camera.
void take_video(const Film& film, int crf, const fs::path& folder, Recording& recording) {
  std::vector<double> times_s;
  for (const int frame : film.frames) times_s.push_back(recording.frame_time_s(frame));
  fs::create_directories(folder);
  CameraEntry& camera = recording.cameras.front();
  camera.images = folder / (camera.name + ".mp4");
  write_h264_video(film.pictures, times_s, crf, *camera.images);
}

}  // namespace

Recording filmed_evenly(const Recording& recording, int crf, const fs::path& folder) {
  Recording filmed = recording;
  take_video(read_film(recording), crf, folder, filmed);
  return filmed;
}

Recording filmed_with_gaps(const Recording& recording, int crf, unsigned long long seed,
                           const fs::path& folder) {
  Recording filmed = recording;
  const Film film = with_gaps(read_film(recording), seed);
  take_video(film, crf, folder, filmed);
  filmed.frame_rate_hz.reset();
  filmed.times_file.reset();
  filmed.times_s.clear();
  // The same moment as before begins what is held out.
  if (filmed.held_out_from_frame)
    filmed.held_out_from_frame = static_cast<int>(
        std::ranges::lower_bound(film.frames, *filmed.held_out_from_frame) - film.frames.begin());
  return filmed;
}

}  // namespace clothfit
