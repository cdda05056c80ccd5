// Measures how many pictures of 1280 x 720 with 289 dots are tracked per second: rendered once, in
// memory, a sheet that swings by some px per picture. `threads` limits them (default 2).

#include <fmt/format.h>
#include <tbb/global_control.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <opencv2/core.hpp>
#include <vector>

#include "tests/vision/dot_sheet.h"
#include "tests/vision/tag_sheet.h"
#include "vision/render/render_cloth.h"
#include "vision/track/dot_tracks.h"

namespace clothfit {
namespace {

constexpr int kAcross = 17, kPictures = 24, kRounds = 4;
constexpr double kSpacing_m = 0.025, kMargin_m = 0.01;
constexpr double kSheet_m = (kAcross - 1) * kSpacing_m + 2 * kMargin_m;

std::vector<cv::Mat> render_pictures(const MarkerSet& markers, std::vector<double> radii_m) {
  const SheetPrint print(markers, kSheet_m, kSheet_m,
                         {.dot_radius_m = 5e-3, .dot_radii_m = std::move(radii_m)});
  const CameraRays rays(camera_before(1.0, 1400, 1280, 720));
  std::vector<cv::Mat> pictures;
  for (int frame = 0; frame < kPictures; ++frame) {
    const double phase = 2 * M_PI * frame / kPictures;
    const std::vector<std::vector<PlacedSheet>> instants = {
        {place_sheet(print, 97, [&](double s, double t) {
          const double depth = 0.1 * std::sin(phase) * t + 0.01 * std::sin(25 * s - phase);
          return Eigen::Vector3d(s - 0.5 * kSheet_m, depth, 0.5 * kSheet_m - t);
        })}};
    pictures.push_back(render_cloth(rays, instants, {.samples = 2, .noise_levels = 2},
                                    static_cast<std::uint64_t>(frame)));
  }
  return pictures;
}

double cpu_s() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

void measure(const char* name, const MarkerSet& markers, const std::vector<cv::Mat>& pictures) {
  DotTracker tracker(markers, name);
  size_t dots = tracker.next(pictures[0]).dots.size(), taken = 0;
  const auto start = std::chrono::steady_clock::now();
  const double cpu = cpu_s();
  for (int round = 0; round < kRounds; ++round)
    for (const cv::Mat& picture : pictures) {
      dots = tracker.next(picture).dots.size();
      ++taken;
    }
  const double wall =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const auto count = static_cast<double>(taken);
  fmt::print("{}: {} dots, {:.0f} pictures/s, {:.1f} ms of CPU a picture\n", name, dots,
             count / wall, 1e3 * (cpu_s() - cpu) / count);
}

void run(int threads) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                  static_cast<size_t>(threads));
  cv::setNumThreads(1);
  const MarkerSet pattern = dot_markers(kAcross, kAcross, kSpacing_m, kMargin_m);
  measure(
      "pattern", pattern,
      render_pictures(pattern, pattern_radii_m(make_dot_pattern(kAcross, kAcross), kSpacing_m)));
  const MarkerSet anchored = anchored_dot_markers(kAcross, kAcross, kSpacing_m, kMargin_m);
  measure("anchor tags", anchored, render_pictures(anchored, {}));
}

}  // namespace
}  // namespace clothfit

int main(int count, char** arguments) {
  clothfit::run(count > 1 ? std::atoi(arguments[1]) : 2);
}
