#include "tests/vision/synthetic_dots.h"

#include <turbojpeg.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <memory>
#include <opencv2/imgproc.hpp>

#include "vision/encode/encode_picture.h"

namespace clothfit {
namespace {

constexpr int kFine = 8;  // places per pixel and direction

Eigen::Vector2d bend_at(const SyntheticDot& dot, const Eigen::Vector2d& u) {
  return {0.5 * u.dot(dot.bend_px[0] * u), 0.5 * u.dot(dot.bend_px[1] * u)};
}

bool covers_ink(const SyntheticDot& dot, const Eigen::Matrix2d& inverse, const Eigen::Vector2d& p) {
  const Eigen::Vector2d from = p - dot.centre_px;
  Eigen::Vector2d u = inverse * from;
  if (u.norm() > 2) return false;
  for (int i = 0; i < 6; ++i) u = inverse * (from - bend_at(dot, u));
  return u.norm() < 1 && u.norm() >= dot.hole;
}

void print_dot(const SyntheticDotPicture& picture, const SyntheticDot& dot, cv::Mat& fine) {
  const Eigen::Matrix2d inverse = dot.px_per_radius.inverse();
  const Eigen::Vector2d half =
      2 * dot.px_per_radius.rowwise().norm() + Eigen::Vector2d::Constant(1);
  const auto low = [&](double x) { return std::max(0, static_cast<int>((x + 0.5) * kFine)); };
  for (int j = low(dot.centre_px.y() - half.y());
       j < std::min(fine.rows, low(dot.centre_px.y() + half.y())); ++j)
    for (int i = low(dot.centre_px.x() - half.x());
         i < std::min(fine.cols, low(dot.centre_px.x() + half.x())); ++i) {
      const Eigen::Vector2d p((i + 0.5) / kFine - 0.5, (j + 0.5) / kFine - 0.5);
      if (covers_ink(dot, inverse, p)) fine.at<float>(j, i) = static_cast<float>(picture.ink);
    }
}

void light_and_cover(const SyntheticDotPicture& picture, cv::Mat& fine) {
  const Eigen::Vector2d middle(0.5 * picture.width, 0.5 * picture.height);
  for (int j = 0; j < fine.rows; ++j)
    for (int i = 0; i < fine.cols; ++i) {
      const Eigen::Vector2d p((i + 0.5) / kFine - 0.5, (j + 0.5) / kFine - 0.5);
      const double light = picture.paper_levels * (1 + picture.light_slope.dot(p - middle));
      float& level = fine.at<float>(j, i);
      level *= static_cast<float>(light);
      for (const SyntheticCover& cover : picture.covers)
        if (cover.normal.dot(p - cover.point_px) > 0) level = static_cast<float>(cover.level);
    }
}

cv::Mat blur_motion(const cv::Mat& fine, const Eigen::Vector2d& motion_px) {
  constexpr int kInstants = 17;
  cv::Mat sum = cv::Mat::zeros(fine.size(), CV_32FC1), moved;
  for (int k = 0; k < kInstants; ++k) {
    const Eigen::Vector2d way = motion_px * kFine * ((k + 0.5) / kInstants - 0.5);
    const cv::Matx23d shift(1, 0, way.x(), 0, 1, way.y());
    cv::warpAffine(fine, moved, shift, fine.size(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
    sum += moved / kInstants;
  }
  return sum;
}

cv::Mat through_jpeg(const cv::Mat& grey, int quality) {
  const std::string bytes = encode_jpeg(grey, quality);
  cv::Mat decoded(grey.size(), CV_8UC1);
  const std::unique_ptr<void, int (*)(tjhandle)> decoder(tjInitDecompress(), tjDestroy);
  tjDecompress2(decoder.get(), reinterpret_cast<const unsigned char*>(bytes.data()),
                static_cast<unsigned long>(bytes.size()), decoded.data, decoded.cols,
                static_cast<int>(decoded.step), decoded.rows, TJPF_GRAY, 0);
  return decoded;
}

}  // namespace

cv::Mat render(const SyntheticDotPicture& picture, std::mt19937_64& rng) {
  cv::Mat fine(picture.height * kFine, picture.width * kFine, CV_32FC1, cv::Scalar(1));
  for (const SyntheticDot& dot : picture.dots) print_dot(picture, dot, fine);
  light_and_cover(picture, fine);
  if (picture.motion_px.norm() > 0) fine = blur_motion(fine, picture.motion_px);
  if (picture.blur_px > 0)
    cv::GaussianBlur(fine, fine, {}, picture.blur_px * kFine, 0, cv::BORDER_REPLICATE);
  cv::Mat coarse;
  cv::resize(fine, coarse, {picture.width, picture.height}, 0, 0, cv::INTER_AREA);
  std::normal_distribution<double> normal(0, 1);
  cv::Mat grey(picture.height, picture.width, CV_8UC1);
  for (int v = 0; v < grey.rows; ++v)
    for (int u = 0; u < grey.cols; ++u) {
      const double level = coarse.at<float>(v, u) + picture.noise_levels * normal(rng);
      grey.at<std::uint8_t>(v, u) =
          static_cast<std::uint8_t>(std::lround(std::clamp(level, 0.0, 255.0)));
    }
  return picture.jpeg_quality > 0 ? through_jpeg(grey, picture.jpeg_quality) : grey;
}

SyntheticDot tilted_dot(const Eigen::Vector2d& centre_px, double radius_px, double tilt,
                        double turn) {
  const Eigen::Matrix2d rotation = Eigen::Rotation2Dd(turn).toRotationMatrix();
  SyntheticDot dot;
  dot.centre_px = centre_px;
  dot.px_per_radius =
      rotation * Eigen::Vector2d(radius_px * std::cos(tilt), radius_px).asDiagonal();
  return dot;
}

}  // namespace clothfit
