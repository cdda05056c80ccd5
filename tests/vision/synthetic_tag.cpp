#include "tests/vision/synthetic_tag.h"

#include <apriltag/apriltag.h>
#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagStandard41h12.h>

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

namespace clothfit {
namespace {

/// The print as cells, white beyond them.
struct Print {
  int border = 0;
  cv::Mat cells;

  explicit Print(const SyntheticTag& tag) {
    apriltag_family_t* family = nullptr;
    if (tag.family == "tag16h5") family = tag16h5_create();
    if (tag.family == "tag25h9") family = tag25h9_create();
    if (tag.family == "tag36h11") family = tag36h11_create();
    if (tag.family == "tagStandard41h12") family = tagStandard41h12_create();
    if (family == nullptr) throw std::logic_error("family not listed here: " + tag.family);
    image_u8_t* image = apriltag_to_image(family, static_cast<uint32_t>(tag.id));
    border = family->width_at_border;
    cells = cv::Mat(image->height, image->width, CV_8UC1, image->buf,
                    static_cast<size_t>(image->stride))
                .clone();
    image_u8_destroy(image);
    if (tag.family == "tag16h5") tag16h5_destroy(family);
    if (tag.family == "tag25h9") tag25h9_destroy(family);
    if (tag.family == "tag36h11") tag36h11_destroy(family);
    if (tag.family == "tagStandard41h12") tagStandard41h12_destroy(family);
  }

  double white(double x, double y) const {
    const int column = static_cast<int>(std::floor(x * border / 2 + cells.cols / 2.0));
    const int row = static_cast<int>(std::floor(y * border / 2 + cells.rows / 2.0));
    if (column < 0 || row < 0 || column >= cells.cols || row >= cells.rows) return 1;
    return cells.at<std::uint8_t>(row, column) > 127 ? 1 : 0;
  }
};

Eigen::Vector3d on_surface(double x, double y, double radius) {
  if (std::isinf(radius)) return {x, y, 0};
  return {radius * std::sin(x / radius), y, radius * (1 - std::cos(x / radius))};
}

/// Returns tag coordinates where a ray (in tag axes) meets the sheet on the side that faces the
/// camera.
Eigen::Vector2d meet(const Eigen::Vector3d& from, const Eigen::Vector3d& along, double radius) {
  if (std::isinf(radius)) {
    const Eigen::Vector3d at = from - from.z() / along.z() * along;
    return at.head<2>();
  }
  // The place satisfies |(x, z - radius)| = radius; the nearer of the two places is taken.
  const Eigen::Vector2d o(from.x(), from.z() - radius), d(along.x(), along.z());
  const double a = d.squaredNorm(), b = o.dot(d), c = o.squaredNorm() - radius * radius;
  const double root = b * b - a * c;
  if (root < 0) return {1e9, 1e9};
  const Eigen::Vector3d at = from + (-b - std::sqrt(root)) / a * along;
  return {radius * std::atan2(at.x(), radius - at.z()), at.y()};
}

Eigen::Vector2d middle_px(const SyntheticCamera& camera) {
  return {0.5 * (camera.width - 1), 0.5 * (camera.height - 1)};
}

}  // namespace

std::array<Eigen::Vector2d, 4> true_corners(const SyntheticTag& tag,
                                            const SyntheticCamera& camera) {
  const std::array<Eigen::Vector2d, 4> upright = {Eigen::Vector2d(-1, 1), Eigen::Vector2d(1, 1),
                                                  Eigen::Vector2d(1, -1), Eigen::Vector2d(-1, -1)};
  std::array<Eigen::Vector2d, 4> corners;
  for (size_t c = 0; c < 4; ++c) {
    const Eigen::Vector3d point =
        tag.camera_from_tag * on_surface(upright[c].x(), upright[c].y(), tag.radius);
    corners[c] = camera.focal_px * point.hnormalized() + middle_px(camera);
  }
  return corners;
}

cv::Mat render(const SyntheticTag& tag, const SyntheticCamera& camera, std::mt19937_64& rng) {
  constexpr int kRays = 6;
  const Print print(tag);
  const Eigen::Isometry3d tag_from_camera = tag.camera_from_tag.inverse();
  cv::Mat picture(camera.height, camera.width, CV_64FC1);
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      double white = 0;
      for (int i = 0; i < kRays * kRays; ++i) {
        const Eigen::Vector2d at(u - 0.5 + (i % kRays + 0.5) / kRays,
                                 v - 0.5 + (i / kRays + 0.5) / kRays);
        const Eigen::Vector2d ray = (at - middle_px(camera)) / camera.focal_px;
        const Eigen::Vector2d q = meet(tag_from_camera.translation(),
                                       tag_from_camera.linear() * ray.homogeneous(), tag.radius);
        white += print.white(q.x(), q.y());
      }
      picture.at<double>(v, u) = 40 + 170 * white / (kRays * kRays);
    }
  }
  cv::GaussianBlur(picture, picture, cv::Size(), camera.blur_px, camera.blur_px,
                   cv::BORDER_REPLICATE);
  std::normal_distribution<double> noise(0, camera.noise_levels);
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) picture.at<double>(v, u) += noise(rng);
  cv::Mat grey;
  picture.convertTo(grey, CV_8UC1);
  return grey;
}

SyntheticTag place_tag(const SyntheticCamera& camera, double width_px, double roll, double tilt,
                       const Eigen::Vector2d& shift_px) {
  const double distance = 2 * camera.focal_px / width_px;
  SyntheticTag tag;
  tag.camera_from_tag.linear() = (Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()) *
                                  Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitY()))
                                     .toRotationMatrix();
  tag.camera_from_tag.translation() << shift_px * distance / camera.focal_px, distance;
  return tag;
}

}  // namespace clothfit
