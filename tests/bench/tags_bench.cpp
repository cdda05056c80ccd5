// Measures how many pictures with 64 tags are tracked per second, beside AprilTag's search over
// whole pictures in the same run: pictures of a sheet that swings, rendered once, in memory.
//
//   tags_bench [--threads 2] [--width 1280] [--photo FILE]
//
// `photo` is what stands behind the sheet; it is dark otherwise.

#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <set>
#include <string>
#include <vector>

#include "tests/vision/tag_sheet.h"
#include "vision/render/render_cloth.h"
#include "vision/track/tag_tracker.h"

namespace clothfit {
namespace {

constexpr int kAcross = 8, kPictures = 24, kRounds = 4;
constexpr double kSheet_m = 0.4;

TagLayout layout_of(const MarkerSet& markers) {
  TagLayout layout;
  for (const Marker& marker : markers.markers)
    layout[*marker.tag][static_cast<size_t>(*marker.corner)] = {marker.s_m, marker.t_m};
  return layout;
}

/// Renders the sheet, 0.8 of the picture high, as it swings once.
std::vector<cv::Mat> render_pictures(const MarkerSet& markers, int width_px) {
  const int height_px = width_px * 9 / 16;
  const SheetPrint print(markers, kSheet_m, kSheet_m, {});
  const CameraRays rays(camera_before(1.0, 0.8 * height_px / kSheet_m, width_px, height_px));
  std::vector<cv::Mat> pictures;
  for (int frame = 0; frame < kPictures; ++frame) {
    const double phase = 2 * M_PI * frame / kPictures;
    const std::vector<std::vector<PlacedSheet>> instants = {
        {place_sheet(print, 97, [&](double s, double t) {
          const double depth = 0.1 * std::sin(phase) * t + 0.01 * std::sin(25 * s - phase);
          const double aside = 0.02 * std::sin(phase) * t / kSheet_m;
          return Eigen::Vector3d(s - 0.5 * kSheet_m + aside, depth, 0.5 * kSheet_m - t);
        })}};
    pictures.push_back(render_cloth(rays, instants, {.samples = 2, .noise_levels = 2},
                                    static_cast<std::uint64_t>(frame)));
  }
  return pictures;
}

/// Puts a photo where pictures are nearly black.
void put_behind(const std::string& file, std::vector<cv::Mat>& pictures) {
  const cv::Mat photo = cv::imread(file, cv::IMREAD_GRAYSCALE);
  if (photo.empty()) throw CLI::FileError(file + " is no picture");
  cv::Mat behind;
  cv::resize(photo, behind, pictures[0].size(), 0, 0, cv::INTER_AREA);
  for (cv::Mat& picture : pictures) {
    // Black cells lie within the sheet, which is what is bright after its holes are closed.
    cv::Mat sheet;
    cv::threshold(picture, sheet, 100, 255, cv::THRESH_BINARY);
    const int reach = picture.rows / 10;
    cv::morphologyEx(sheet, sheet, cv::MORPH_CLOSE, cv::Mat::ones(reach, reach, CV_8U));
    behind.copyTo(picture, sheet == 0);
  }
}

double seconds_of(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Reads all pictures several times. Prints the rate of the best round, and returns it.
double measure(const char* name, const std::vector<cv::Mat>& pictures,
               const std::function<size_t(const cv::Mat&)>& read) {
  size_t least = read(pictures[0]);
  double best_s = std::numeric_limits<double>::infinity();
  const std::clock_t cpu = std::clock();
  for (int round = 0; round < kRounds; ++round)
    best_s = std::min(best_s, seconds_of([&] {
                        for (const cv::Mat& picture : pictures)
                          least = std::min(least, read(picture));
                      }));
  const double cpu_s = static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC;
  fmt::print("{:24} {:6.1f} pictures/s, {:5.1f} ms of CPU a picture, at least {} tags\n", name,
             kPictures / best_s, 1e3 * cpu_s / (kRounds * kPictures), least);
  return kPictures / best_s;
}

double measure_apriltag(const std::vector<cv::Mat>& pictures, int threads) {
  const std::unique_ptr<apriltag_family_t, void (*)(apriltag_family_t*)> family(tag36h11_create(),
                                                                                tag36h11_destroy);
  const std::unique_ptr<apriltag_detector_t, void (*)(apriltag_detector_t*)> detector(
      apriltag_detector_create(), apriltag_detector_destroy);
  apriltag_detector_add_family(detector.get(), family.get());
  detector->nthreads = threads;
  detector->quad_decimate = 1;
  return measure("AprilTag, whole picture", pictures, [&](const cv::Mat& picture) {
    image_u8_t image{.width = picture.cols,
                     .height = picture.rows,
                     .stride = static_cast<int32_t>(picture.step),
                     .buf = picture.data};
    zarray_t* found = apriltag_detector_detect(detector.get(), &image);
    const auto count = static_cast<size_t>(zarray_size(found));
    apriltag_detections_destroy(found);
    return count;
  });
}

void run(int threads, int width_px, const std::string& photo) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                  static_cast<size_t>(threads));
  cv::setNumThreads(1);
  const MarkerSet markers = tag_markers(kAcross, kSheet_m);
  std::vector<cv::Mat> pictures = render_pictures(markers, width_px);
  if (!photo.empty()) put_behind(photo, pictures);
  fmt::print("{} pictures of {} x {}, {} threads\n", kPictures, width_px, pictures[0].rows,
             threads);
  const double search = measure_apriltag(pictures, threads);
  const TagLayout layout = layout_of(markers);
  std::set<int> tags;
  for (const auto& [id, corners] : layout) tags.insert(id);
  TagTracker tracker(markers.family, layout, tags);
  int frame = 0;
  const double tracked = measure("clothfit", pictures, [&](const cv::Mat& picture) {
    return tracker.next(picture, frame++).read.size();
  });
  fmt::print("ratio {:.2f}\n", tracked / search);
}

}  // namespace
}  // namespace clothfit

int main(int count, char** arguments) {
  CLI::App app("Times the tracking of tags beside AprilTag's search.");
  int threads = 2, width = 1280;
  std::string photo;
  app.add_option("--threads", threads)->check(CLI::PositiveNumber);
  app.add_option("--width", width, "of the pictures, px")->check(CLI::Range(320, 8000));
  app.add_option("--photo", photo, "behind the sheet");
  CLI11_PARSE(app, count, arguments);
  clothfit::run(threads, width, photo);
}
