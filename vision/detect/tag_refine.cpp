#include "vision/detect/tag_refine.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "vision/detect/corner_place.h"
#include "vision/detect/tag_fit.h"
#include "vision/detect/tag_samples.h"

namespace clothfit {
namespace {

constexpr double kSharp_px = 0.5;  // blur of a good lens and a pixel
constexpr Eigen::Index kFewestSamples = 2 * TagUnknowns::kCount;
constexpr int kMostSteps = 20, kQuickSteps = 10;

/// Returns small steps from tag coordinates to pixels at the middle of the tag.
Eigen::Matrix2d steps_at_middle(const Eigen::Matrix3d& pixel_from_tag) {
  Eigen::Matrix2d steps;
  steps.col(0) = (mapped(pixel_from_tag, {1, 0}) - mapped(pixel_from_tag, {-1, 0})) / 2;
  steps.col(1) = (mapped(pixel_from_tag, {0, 1}) - mapped(pixel_from_tag, {0, -1})) / 2;
  return steps;
}

void expect(const ExpectedPicture& expected, TagFit& fit) {
  fit.expect_light(expected.black_levels, expected.contrast_levels);
  fit.bound_noise(expected.most_noise_levels, expected.most_roughness_px);
}

/// Lists the blurs to start from: where the motion is known, that is it and a sharp picture, the
/// likelier first; else a sharp picture and motion in four directions.
std::vector<PictureBlur::Unknowns> starts(const RefineHints& hints) {
  std::vector<PictureBlur::Unknowns> blurs = {PictureBlur::unknowns(kSharp_px, {0, 0})};
  constexpr double kSharpMotion_px = 1.5;
  if (hints.motion_px) {
    blurs.push_back(PictureBlur::unknowns(hints.lens_px.value_or(kSharp_px), *hints.motion_px));
    if (hints.lens_px || hints.motion_px->norm() > kSharpMotion_px) std::swap(blurs[0], blurs[1]);
    return blurs;
  }
  constexpr double kLength_px = 6;
  for (int k = 0; k < 4; ++k) {
    const double direction = k * M_PI / 4;
    const Eigen::Vector2d along(std::cos(direction), std::sin(direction));
    blurs.push_back(PictureBlur::unknowns(kSharp_px, kLength_px * along));
  }
  return blurs;
}

/// Fits from where the fit starts, and notes what it shows, in pixels of the window.
RefinedTag refined_from(TagFit& fit, bool quick, const TagPattern& pattern,
                        const Eigen::Matrix3d& pixel_from_tag,
                        const Eigen::Matrix2d& pixel_by_tag) {
  RefinedTag result;
  result.corner_px.fill(Eigen::Vector2d::Zero());
  result.usable =
      quick ? fit.converge(kQuickSteps, TagFit::Ending::kPredicted) : fit.converge(kMostSteps);
  result.usable = result.usable && fit.contrast() > 0;  // white is brighter than black
  if (!fit.unknowns().allFinite()) return RefinedTag{.corner_px = result.corner_px};
  result.noise_levels = fit.noise_levels();
  result.roughness_px = fit.roughness_px();
  result.explained = fit.robust().mean();
  result.contrast_levels = fit.contrast();
  result.black_levels = fit.black();
  const PictureBlur blur(fit.unknowns().segment<3>(TagUnknowns::kBlur));
  result.lens_px = std::sqrt(blur.lens_variance_px2());
  result.motion_px = blur.motion_px();
  result.evidence = tag_evidence(fit, pattern, pixel_by_tag);
  if (!result.usable) return result;
  const std::array<CornerPlace, 4> places = corner_places(fit, pixel_from_tag, pixel_by_tag);
  for (size_t c = 0; c < 4; ++c) {
    result.corner_px[c] = places[c].pixel_px;
    result.sigma_px[c] = places[c].sigma_px;
    result.usable =
        result.usable && places[c].pixel_px.allFinite() && std::isfinite(places[c].sigma_px);
  }
  return result;
}

/// Takes lengths to pixels of the picture, and noise to that of single ones.
RefinedTag in_picture(RefinedTag tag, const TagWindow& window) {
  for (size_t c = 0; c < 4; ++c) {
    tag.corner_px[c] = window.to_picture(tag.corner_px[c]);
    tag.sigma_px[c] *= window.shrunk_by;
  }
  tag.noise_levels *= window.shrunk_by;
  tag.roughness_px *= window.shrunk_by;
  tag.lens_px *= window.shrunk_by;
  tag.motion_px *= window.shrunk_by;
  return tag;
}

/// Takes lengths and noise to pixels of the window.
RefineHints in_window(RefineHints hints, const TagWindow& window) {
  if (hints.lens_px) *hints.lens_px /= window.shrunk_by;
  if (hints.motion_px) *hints.motion_px /= window.shrunk_by;
  if (hints.picture) {
    hints.picture->most_noise_levels /= window.shrunk_by;
    hints.picture->most_roughness_px /= window.shrunk_by;
  }
  return hints;
}

}  // namespace

RefinedTag refine_tag(const cv::Mat& grey, const TagPattern& pattern,
                      const Eigen::Matrix3d& pixel_from_tag, const RefineHints& hints) {
  assert(grey.type() == CV_8UC1);
  RefinedTag result;
  result.corner_px.fill(Eigen::Vector2d::Zero());
  const auto window = tag_window(grey, pixel_from_tag, sample_reach(pattern));
  if (!window) return result;
  const Eigen::Matrix3d window_from_tag = window->from_picture(pixel_from_tag);
  const TagSamples samples = tag_samples(*window, pattern, window_from_tag);
  if (samples.count < kFewestSamples) return result;
  const Eigen::Matrix2d pixel_by_tag = steps_at_middle(window_from_tag);
  const RefineHints near = in_window(hints, *window);
  for (const PictureBlur::Unknowns& start : starts(near)) {
    TagFit fit(pattern, pixel_by_tag, samples, start);
    if (near.picture) expect(*near.picture, fit);
    const RefinedTag refined =
        refined_from(fit, hints.quick, pattern, window_from_tag, pixel_by_tag);
    const bool shows_tag = refined.usable && refined.evidence.shows_tag();
    // What a start says that led nowhere counts less than what a better one does.
    if (shows_tag || refined.usable > result.usable ||
        (refined.usable == result.usable && refined.explained > result.explained))
      result = refined;
    if (shows_tag || hints.quick) break;
  }
  return in_picture(result, *window);
}

std::optional<Eigen::Matrix3d> align_tag(const cv::Mat& grey, const TagPattern& pattern,
                                         const Eigen::Matrix3d& pixel_from_tag,
                                         const std::optional<ExpectedPicture>& expected) {
  constexpr double kReach = 1.5;  // half a tag around it, for the smoothing
  auto window = tag_window(grey, pixel_from_tag, kReach);
  if (!window) return {};
  const Eigen::Matrix3d window_from_tag = window->from_picture(pixel_from_tag);
  const Eigen::Matrix2d pixel_by_tag = steps_at_middle(window_from_tag);
  const double smooth_px = pattern.cell() * pixel_by_tag.colwise().norm().mean() / 3;
  cv::GaussianBlur(window->levels, window->levels, cv::Size(), smooth_px, smooth_px,
                   cv::BORDER_REPLICATE);
  const TagSamples samples = tag_samples(*window, pattern, window_from_tag);
  if (samples.count < kFewestSamples) return {};
  TagFit fit(pattern, pixel_by_tag, samples,
             PictureBlur::unknowns(std::hypot(kSharp_px, smooth_px), {0, 0}));
  if (expected) fit.expect_light(expected->black_levels, expected->contrast_levels);
  if (!fit.converge(kMostSteps) || !(fit.contrast() > 0)) return {};
  std::array<Eigen::Vector2d, 4> corners = corner_pixels(fit, window_from_tag);
  for (Eigen::Vector2d& corner : corners) corner = window->to_picture(corner);
  if (!shows_front(corners)) return {};
  return homography_to(corners);
}

bool shows_front(const std::array<Eigen::Vector2d, 4>& corner_px) {
  constexpr double kEdgeOn = 0.15;  // of the area seen head on
  double twice = 0, longest = 0;
  for (size_t c = 0; c < 4; ++c) {
    const Eigen::Vector2d& here = corner_px[c];
    const Eigen::Vector2d to = corner_px[(c + 1) % 4] - here, back = corner_px[(c + 3) % 4] - here;
    // Corners run counter-clockwise as seen, which is a negative turn with y pointing down.
    if (!(to.y() * back.x() - to.x() * back.y() > 0)) return false;
    twice += here.y() * corner_px[(c + 1) % 4].x() - here.x() * corner_px[(c + 1) % 4].y();
    longest = std::max(longest, to.norm());
  }
  return std::isfinite(twice) && 0.5 * twice > kEdgeOn * longest * longest;
}

Eigen::Matrix3d homography_to(const std::array<Eigen::Vector2d, 4>& corner_px) {
  Eigen::Matrix<double, 8, 8> equations = Eigen::Matrix<double, 8, 8>::Zero();
  Eigen::Matrix<double, 8, 1> right;
  for (size_t c = 0; c < 4; ++c) {
    const Eigen::Vector3d tag = border_corners()[c].homogeneous();
    for (int k = 0; k < 2; ++k) {
      const auto row = 2 * static_cast<Eigen::Index>(c) + k;
      equations.block<1, 3>(row, 3 * k) = tag.transpose();
      equations.block<1, 2>(row, 6) = -corner_px[c][k] * tag.head<2>().transpose();
      right[row] = corner_px[c][k];
    }
  }
  const Eigen::Matrix<double, 8, 1> entries = equations.partialPivLu().solve(right);
  Eigen::Matrix3d homography;
  homography << entries.head<3>().transpose(), entries.segment<3>(3).transpose(), entries[6],
      entries[7], 1;
  return homography;
}

}  // namespace clothfit
