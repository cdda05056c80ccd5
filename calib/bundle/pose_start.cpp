#include "calib/bundle/pose_start.h"

#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

namespace clothfit {
namespace {

Rigid3 to_rigid(const cv::Mat& rotation_vector, const cv::Mat& translation) {
  cv::Mat_<double> w, t;
  rotation_vector.convertTo(w, CV_64F);
  translation.convertTo(t, CV_64F);
  return turn_and_shift({w(0), w(1), w(2)}, {t(0), t(1), t(2)});
}

bool is_finite(const Rigid3& pose) {
  return pose.rotation.coeffs().allFinite() && pose.translation_m.allFinite();
}

std::vector<cv::Point2d> to_points(const std::vector<Eigen::Vector2d>& points) {
  std::vector<cv::Point2d> converted;
  converted.reserve(points.size());
  for (const auto& point : points) converted.emplace_back(point.x(), point.y());
  return converted;
}

}  // namespace

std::vector<int> homography_inliers(const std::vector<Eigen::Vector2d>& on_plane_m,
                                    const std::vector<Eigen::Vector2d>& image, double tolerance) {
  std::vector<int> inliers;
  if (on_plane_m.size() < 4) return inliers;
  try {
    cv::Mat mask;
    const cv::Mat homography = cv::findHomography(to_points(on_plane_m), to_points(image),
                                                  cv::RANSAC, tolerance, mask, 5000, 0.9999);
    if (homography.empty()) return inliers;
    for (int i = 0; i < mask.rows; ++i)
      if (mask.at<unsigned char>(i) != 0) inliers.push_back(i);
  } catch (const cv::Exception&) {  // points on a line, and the like
    inliers.clear();
  }
  return inliers;
}

std::vector<Rigid3> plane_poses(const std::vector<Eigen::Vector2d>& on_plane_m,
                                const std::vector<Eigen::Vector2d>& on_image, double tolerance) {
  std::vector<cv::Point3d> plane;
  std::vector<cv::Point2d> image;
  const auto take = [&](size_t i) {
    plane.emplace_back(on_plane_m[i].x(), on_plane_m[i].y(), 0);
    image.emplace_back(on_image[i].x(), on_image[i].y());
  };
  if (tolerance > 0)
    for (const int i : homography_inliers(on_plane_m, on_image, tolerance))
      take(static_cast<size_t>(i));
  else
    for (size_t i = 0; i < on_plane_m.size(); ++i) take(i);
  std::vector<Rigid3> poses;
  if (plane.size() < 4) return poses;
  try {
    std::vector<cv::Mat> rotations, translations;
    cv::solvePnPGeneric(plane, image, cv::Mat::eye(3, 3, CV_64F), cv::noArray(), rotations,
                        translations, false, cv::SOLVEPNP_IPPE);
    for (size_t i = 0; i < rotations.size(); ++i) {
      const Rigid3 pose = to_rigid(rotations[i], translations[i]);
      if (is_finite(pose) && pose.translation_m.z() > 0) poses.push_back(pose);
    }
  } catch (const cv::Exception&) {  // points on a line, and the like
    poses.clear();
  }
  return poses;
}

std::optional<Rigid3> point_pose(const std::vector<Eigen::Vector3d>& in_world_m,
                                 const std::vector<Eigen::Vector2d>& on_image) {
  if (in_world_m.size() < 4) return std::nullopt;
  std::vector<cv::Point3d> world;
  for (const auto& point : in_world_m) world.emplace_back(point.x(), point.y(), point.z());
  try {
    cv::Mat rotation, translation;
    if (!cv::solvePnP(world, to_points(on_image), cv::Mat::eye(3, 3, CV_64F), cv::noArray(),
                      rotation, translation, false, cv::SOLVEPNP_SQPNP))
      return std::nullopt;
    const Rigid3 pose = to_rigid(rotation, translation);
    if (is_finite(pose)) return pose;
  } catch (const cv::Exception&) {  // points on a line, and the like
  }
  return std::nullopt;
}

}  // namespace clothfit
