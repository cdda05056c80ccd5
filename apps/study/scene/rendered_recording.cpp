#include "apps/study/scene/rendered_recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "calib/camera/projection.h"
#include "data/input_error.h"
#include "fit/jobs/draws.h"
#include "model/topology/surface.h"
#include "vision/encode/encode_picture.h"
#include "vision/render/render_cloth.h"
#include "vision/render/true_markers.h"
#include "vision/track/track.h"

namespace clothfit {
namespace {

constexpr double kTagShare = 0.72;     // a tag's width, border to border, over the spacing of tags
constexpr int kMostTags = 24;          // a side: tag36h11 has 587
constexpr double kSmallestTagPx = 16;  // two pixels for each of the eight cells across
constexpr double kMostBlurPx = 5;
constexpr int kMostPixels = 8192;  // a side

/// Returns tags row by row, each with its four corners.
MarkerSet tag_corners(int tags, double size_m) {
  constexpr std::array<std::array<double, 2>, 4> kCorners{{{-1, 1}, {1, 1}, {1, -1}, {-1, -1}}};
  const double spacing_m = size_m / tags;
  MarkerSet set{.kind = MarkerKind::apriltag, .family = "tag36h11", .markers = {}, .index = {}};
  for (int tag = 0; tag < tags * tags; ++tag) {
    for (int corner = 0; corner < 4; ++corner) {
      const auto [right, down] = kCorners[static_cast<size_t>(corner)];
      const std::string name = fmt::format("{}_{}", tag, corner);
      set.index[name] = static_cast<int>(set.markers.size());
      set.markers.push_back({.name = name,
                             .s_m = (tag % tags + 0.5 + 0.5 * kTagShare * right) * spacing_m,
                             .t_m = (tag / tags + 0.5 + 0.5 * kTagShare * down) * spacing_m,
                             .tag = tag,
                             .corner = corner});
    }
  }
  return set;
}

Eigen::Matrix2Xd places_m(const std::vector<Marker>& markers) {
  Eigen::Matrix2Xd places(2, static_cast<Eigen::Index>(markers.size()));
  for (Eigen::Index m = 0; m < places.cols(); ++m) {
    const Marker& marker = markers[static_cast<size_t>(m)];
    places.col(m) << marker.s_m, marker.t_m;
  }
  return places;
}

/// Returns the pixels of a length at the distance of the cloth's middle in the first camera.
double pixels_of(double length_m, const SyntheticScene& scene, const PictureOptions& options) {
  const CameraParameters camera = scene_camera(scene, 0, options.width_px, options.height_px);
  const Eigen::Vector3d middle_m(0.5 * scene.size_m, 0, -0.5 * scene.size_m);
  const double distance_m = (camera_from_world(camera) * middle_m).z();
  return length_m * camera.focal_px.x() / distance_m;
}

/// Returns vertices a side of the mesh that is drawn. The truth's cells are cut into equal parts of
/// two pixels at most. Where the surface bends with a radius of 50 pixels, the triangles then lie a
/// hundredth of a pixel beside it, along its normal.
int drawn_vertices(const SyntheticScene& scene, const PictureOptions& options) {
  constexpr double kLargestPx = 2;
  const int cells = scene.truth_mesh - 1;
  const double parts = pixels_of(scene.size_m, scene, options) / (cells * kLargestPx);
  return 1 + cells * std::max(1, static_cast<int>(std::ceil(parts)));
}

Eigen::Matrix2Xd grid_m(int vertices, double size_m) {
  Eigen::Matrix2Xd places(2, vertices * vertices);
  for (int i = 0; i < vertices; ++i)
    for (int j = 0; j < vertices; ++j)
      places.col(i * vertices + j) << size_m * j / (vertices - 1), size_m * i / (vertices - 1);
  return places;
}

RenderOptions render_options(const PictureOptions& options) {
  return {.samples = options.samples,
          .blur_px = options.blur_px,
          .noise_levels = options.noise_levels,
          .shot_levels = options.shot_levels};
}

/// Returns shapes of the cloth at the instants of every exposure, on the truth's mesh.
///
/// At the frame itself, the middle of the exposure, the shape is that of the recording without
/// pictures, to the bit. Steps that are cut differently would move it by the integrator's error,
/// which is no matter of pictures. The other instants come from a second run that stops at them
/// too: the motion between them and the frame there is added. Before it is let go the cloth is
/// held.
std::vector<std::vector<Eigen::Matrix3Xd>> exposed_shapes(const SyntheticScene& scene,
                                                          const PictureOptions& options,
                                                          std::uint64_t seed) {
  const std::vector<double> frame_s = scene_frame_times_s(scene);
  std::vector<std::vector<Eigen::Matrix3Xd>> shapes;
  for (Eigen::Matrix3Xd& shape : simulate_scene(scene, seed, frame_s))
    shapes.push_back({std::move(shape)});
  if (options.exposure_s == 0 || options.instants == 1) return shapes;

  const auto instant_s = [&](double middle_s, int k) {
    const int from_middle = k - options.instants / 2;
    return std::max(0.0, middle_s + options.exposure_s * from_middle / options.instants);
  };
  std::vector<double> time_s;
  for (const double middle_s : frame_s)
    for (int k = 0; k < options.instants; ++k) time_s.push_back(instant_s(middle_s, k));
  std::ranges::sort(time_s);
  const auto repeated = std::ranges::unique(time_s);
  time_s.erase(repeated.begin(), repeated.end());
  const std::vector<Eigen::Matrix3Xd> run = simulate_scene(scene, seed, time_s);
  const auto at = [&](double when_s) -> const Eigen::Matrix3Xd& {
    return run[static_cast<size_t>(std::ranges::lower_bound(time_s, when_s) - time_s.begin())];
  };
  for (size_t f = 0; f < shapes.size(); ++f) {
    const Eigen::Matrix3Xd middle = std::move(shapes[f].front());
    shapes[f].clear();
    for (int k = 0; k < options.instants; ++k)
      shapes[f].push_back(middle + (at(instant_s(frame_s[f], k)) - at(frame_s[f])));
  }
  return shapes;
}

/// A printed cloth that moves before cameras.
class Stage {
 public:
  Stage(const SyntheticScene& scene, const PictureOptions& options, std::uint64_t seed)
      : scene_(scene),
        options_(options),
        seed_(seed),
        markers_(tag_corners(options.tags, scene.size_m)),
        print_(markers_, scene.size_m, scene.size_m),
        drawn_(drawn_vertices(scene, options)),
        drawn_surface_(surface(grid_m(drawn_, scene.size_m))),
        marker_surface_(surface(places_m(markers_.markers))),
        shapes_(exposed_shapes(scene, options, seed)) {}

  int frames() const { return static_cast<int>(shapes_.size()); }
  const MarkerSet& markers() const { return markers_; }

  CameraParameters camera(int number) const {
    return scene_camera(scene_, number, options_.width_px, options_.height_px);
  }
  CameraRays rays(int number) const {
    constexpr int kMarginPx = 20;  // four standard deviations of the most blur
    return CameraRays(camera(number), kMarginPx);
  }

  /// Takes the picture of the camera with these rays at a frame.
  cv::Mat picture(const CameraRays& rays, int number, int frame) const {
    std::vector<std::vector<PlacedSheet>> instants;
    for (const Eigen::Matrix3Xd& shape : shapes_[static_cast<size_t>(frame)])
      instants.push_back({drawn(shape)});
    const std::uint64_t noise_seed = derived_seed(derived_seed(seed_, kPictures + number), frame);
    return render_cloth(rays, instants, render_options(options_), noise_seed);
  }

  /// Returns where a camera truly has the markers at a frame. Their visibility is that of the sheet
  /// that is drawn; their places are the projected points of the simulated surface.
  std::vector<TrueMarker> truth(const CameraParameters& camera, int frame) const {
    const std::vector<Eigen::Matrix3Xd>& shapes = shapes_[static_cast<size_t>(frame)];
    const Eigen::Matrix3Xd& shape = shapes[shapes.size() / 2];
    const PlacedSheet sheet = drawn(shape);
    std::vector<TrueMarker> truth = true_markers(camera, {&sheet, 1}, 0, markers_.markers);
    const Eigen::Matrix3Xd point_m = marker_surface_.evaluate(shape);
    for (size_t m = 0; m < truth.size(); ++m) {
      const Eigen::Vector3d point = point_m.col(static_cast<Eigen::Index>(m));
      if (const auto pixel = project(camera, camera_from_world(camera) * point))
        truth[m].pixel_px = *pixel;
    }
    return truth;
  }

 private:
  Surface surface(const Eigen::Matrix2Xd& points_m) const {
    return make_surface(scene_.truth_mesh, scene_.truth_mesh, scene_.size_m, scene_.size_m,
                        points_m);
  }
  PlacedSheet drawn(const Eigen::Matrix3Xd& shape) const {
    return {.print = &print_,
            .columns = drawn_,
            .rows = drawn_,
            .position_m = drawn_surface_.evaluate(shape)};
  }

  const SyntheticScene& scene_;
  const PictureOptions& options_;
  std::uint64_t seed_;
  MarkerSet markers_;
  SheetPrint print_;
  int drawn_ = 0;  ///< vertices a side of the sheet that is drawn
  Surface drawn_surface_, marker_surface_;
  std::vector<std::vector<Eigen::Matrix3Xd>> shapes_;  ///< by frame and instant
};

/// The pictures of one camera, rendered as they are asked for.
class StagedPictures : public ImageSource {
 public:
  StagedPictures(const Stage& stage, int camera)
      : stage_(stage), camera_(camera), rays_(stage.rays(camera)) {}

  std::string current_name() const override {
    return next_ == 0 ? std::string() : fmt::format("picture {}", next_ - 1);
  }
  int count() const override { return stage_.frames(); }

 protected:
  bool read_next(cv::Mat& grey) override {
    if (next_ == stage_.frames()) return false;
    grey = stage_.picture(rays_, camera_, next_++);
    return true;
  }
  int own_number() const override { return next_ - 1; }
  std::string where() const override { return "rendered pictures"; }

 private:
  const Stage& stage_;
  int camera_;
  CameraRays rays_;
  int next_ = 0;
};

TrackerErrors errors_of(const Tracks2d& tracks, const Stage& stage,
                        const CameraParameters& camera) {
  constexpr double kFar = 5;
  TrackerErrors errors{.pictures = stage.frames()};
  std::vector<std::vector<TrueMarker>> truth;
  for (int f = 0; f < stage.frames(); ++f) {
    truth.push_back(stage.truth(camera, f));
    errors.shown +=
        static_cast<int>(std::ranges::count(truth.back(), MarkerSight::seen, &TrueMarker::sight));
  }
  for (const Position2d& row : tracks) {
    if (!row.rejected.empty()) {
      ++errors.rejected[row.rejected];
      continue;
    }
    const TrueMarker& marker =
        truth[static_cast<size_t>(row.frame)][static_cast<size_t>(row.marker)];
    const Eigen::Vector2d error_px = row.position_px - marker.pixel_px;
    ++errors.accepted;
    errors.squared_error_px2 += error_px.squaredNorm();
    errors.stated_variance_px2 += 2 * row.sigma_px * row.sigma_px;
    errors.chi_squared += error_px.squaredNorm() / (row.sigma_px * row.sigma_px);
    if (error_px.cwiseAbs().maxCoeff() > kFar * row.sigma_px) ++errors.beyond_5_sigma;
  }
  return errors;
}

}  // namespace

void PictureOptions::validate(const SyntheticScene& scene) const {
  scene.validate();
  const auto require = [](bool good, const char* option, const char* expected) {
    if (!good) throw InputError(option, "is out of range", expected);
  };
  require(tags >= 2 && tags <= kMostTags, "--tags", "2 to 24 a side");
  require(width_px >= 16 && width_px <= kMostPixels && height_px >= 16 && height_px <= kMostPixels,
          "--picture", "16 to 8192 pixels a side");
  require(exposure_s >= 0 && exposure_s * scene.frame_rate_hz <= 1, "--exposure-ms",
          "milliseconds, 0 to the time between frames");
  require(instants >= 1 && instants <= 99 && instants % 2 == 1, "--instants",
          "an odd number, 1 to 99");
  require(samples >= 1 && samples <= 16, "--samples", "1 to 16 across a pixel");
  require(blur_px >= 0 && blur_px <= kMostBlurPx, "--blur-px", "pixels, 0 to 5");
  require(noise_levels >= 0 && noise_levels <= 255, "--grey-noise", "grey levels, 0 to 255");
  require(shot_levels >= 0 && shot_levels <= 255, "--shot-noise",
          "variance per grey level, 0 to 255");
  const auto refuse = [](bool given, const char* option) {
    if (given)
      throw InputError(option, "cannot be rendered",
                       "no such option beside --render, whose tracker loses what it loses");
  };
  refuse(scene.missing > 0, "--missing");
  refuse(scene.hand, "--hand");
  refuse(scene.outliers > 0, "--outliers");
  refuse(!scene.noisy, "noisy");

  const double tag_px = pixels_of(kTagShare * scene.size_m / tags, scene, *this);
  if (tag_px < kSmallestTagPx)
    throw InputError("--tags", fmt::format("tags would be {:.1f} px wide", tag_px),
                     fmt::format("{} px or more", kSmallestTagPx),
                     "fewer --tags, or larger pictures with --picture");
}

int TrackerErrors::rejections() const {
  int count = 0;
  for (const auto& [reason, rows] : rejected) count += rows;
  return count;
}

double TrackerErrors::rms_error_px() const {
  return std::sqrt(squared_error_px2 / (2 * accepted));
}

double TrackerErrors::rms_sigma_px() const {
  return std::sqrt(stated_variance_px2 / (2 * accepted));
}

double TrackerErrors::chi_squared_per_number() const {
  return chi_squared / (2 * accepted);
}

void TrackerErrors::add(const TrackerErrors& other) {
  pictures += other.pictures;
  shown += other.shown;
  accepted += other.accepted;
  for (const auto& [reason, rows] : other.rejected) rejected[reason] += rows;
  squared_error_px2 += other.squared_error_px2;
  stated_variance_px2 += other.stated_variance_px2;
  chi_squared += other.chi_squared;
  beyond_5_sigma += other.beyond_5_sigma;
}

RenderedRecording make_rendered_recording(const SyntheticScene& scene,
                                          const PictureOptions& options, std::uint64_t seed) {
  options.validate(scene);
  const Stage stage(scene, options, seed);
  RenderedRecording result;
  FitInput& input = result.recording.input;
  input.recording = scene_recording(scene);
  input.recording.markers = stage.markers();
  for (int c = 0; c < scene.cameras; ++c) {
    const CameraParameters camera = stage.camera(c);
    input.recording.cameras.push_back({.name = camera.name});
    input.cameras.push_back(camera);
    StagedPictures pictures(stage, c);
    TrackResult tracked =
        track(input.recording, pictures, "rendered pictures of " + camera.name, {}, {});
    result.tracker.add(errors_of(tracked.tracks, stage, camera));
    input.tracks2d[camera.name] = std::move(tracked.tracks);
  }
  result.recording.truth = scene_truth(scene);
  return result;
}

std::string rendered_picture_png(const SyntheticScene& scene, const PictureOptions& options,
                                 std::uint64_t seed, int camera, int frame) {
  options.validate(scene);
  const Stage stage(scene, options, seed);
  return encode_png(stage.picture(stage.rays(camera), camera, frame));
}

}  // namespace clothfit
