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
constexpr size_t kFewestSamples = 2 * TagUnknowns::kCount;
constexpr int kMostSteps = 20;

const std::array<Eigen::Vector2d, 4>& border_corners() {
  static const std::array<Eigen::Vector2d, 4> corners = {{{-1, 1}, {1, 1}, {1, -1}, {-1, -1}}};
  return corners;
}

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

/// Lists the blurs to start from. Where the motion is known, that is it and a sharp picture, the
/// likelier first; else a sharp picture and motion in four directions.
std::vector<PictureBlur::Unknowns> starts(const std::optional<Eigen::Vector2d>& motion_px) {
  std::vector<PictureBlur::Unknowns> blurs = {PictureBlur::unknowns(kSharp_px, {0, 0})};
  constexpr double kSharpMotion_px = 1.5;
  if (motion_px) {
    blurs.push_back(PictureBlur::unknowns(kSharp_px, *motion_px));
    if (motion_px->norm() > kSharpMotion_px) std::swap(blurs[0], blurs[1]);
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

/// Fits from where the fit starts, and notes what it shows.
RefinedTag refined_from(TagFit& fit, const TagPattern& pattern,
                        const Eigen::Matrix3d& pixel_from_tag,
                        const Eigen::Matrix2d& pixel_by_tag) {
  RefinedTag result;
  result.corner_px.fill(Eigen::Vector2d::Zero());
  result.usable = fit.converge(kMostSteps);
  result.usable = result.usable && fit.contrast() > 0;  // white is brighter than black
  if (!fit.unknowns().allFinite()) return RefinedTag{.corner_px = result.corner_px};
  result.noise_levels = fit.noise_levels();
  result.roughness_px = fit.roughness_px();
  result.explained = fit.robust().mean();
  result.contrast_levels = fit.contrast();
  result.black_levels = fit.black();
  result.motion_px = PictureBlur(fit.unknowns().segment<3>(TagUnknowns::kBlur)).motion_px();
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

}  // namespace

RefinedTag refine_tag(const cv::Mat& grey, const TagPattern& pattern,
                      const Eigen::Matrix3d& pixel_from_tag, const RefineHints& hints) {
  assert(grey.type() == CV_8UC1);
  RefinedTag result;
  result.corner_px.fill(Eigen::Vector2d::Zero());
  const std::vector<TagSample> samples = tag_samples(grey, pattern, pixel_from_tag);
  if (samples.size() < kFewestSamples) return result;
  const Eigen::Matrix2d pixel_by_tag = steps_at_middle(pixel_from_tag);
  for (const PictureBlur::Unknowns& start : starts(hints.motion_px)) {
    TagFit fit(pattern, pixel_by_tag, samples, start);
    fit.thin_out();
    if (fit.samples().size() < kFewestSamples) return result;
    if (hints.picture) expect(*hints.picture, fit);
    const RefinedTag refined = refined_from(fit, pattern, pixel_from_tag, pixel_by_tag);
    if (refined.usable && refined.evidence.shows_tag()) return refined;
    // What a start says that led nowhere counts less than what a better one does.
    if (refined.usable > result.usable ||
        (refined.usable == result.usable && refined.explained > result.explained))
      result = refined;
  }
  return result;
}

std::optional<Eigen::Matrix3d> align_tag(const cv::Mat& grey, const TagPattern& pattern,
                                         const Eigen::Matrix3d& pixel_from_tag,
                                         const std::optional<ExpectedPicture>& expected) {
  const Eigen::Matrix2d pixel_by_tag = steps_at_middle(pixel_from_tag);
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& corner : border_corners())
    box.extend(mapped(pixel_from_tag, 1.5 * corner));
  if (!box.sizes().allFinite()) return {};
  const cv::Rect whole(0, 0, grey.cols, grey.rows);
  const cv::Rect window = whole & cv::Rect(cv::Point2d(box.min().x(), box.min().y()),
                                           cv::Point2d(box.max().x() + 1, box.max().y() + 1));
  if (window.empty()) return {};
  const double smooth_px = pattern.cell() * pixel_by_tag.colwise().norm().mean() / 3;
  cv::Mat smooth;
  cv::GaussianBlur(grey(window), smooth, cv::Size(), smooth_px, smooth_px, cv::BORDER_REPLICATE);
  Eigen::Matrix3d window_from_tag = pixel_from_tag;
  window_from_tag.row(0) -= window.x * pixel_from_tag.row(2);
  window_from_tag.row(1) -= window.y * pixel_from_tag.row(2);
  const std::vector<TagSample> samples = tag_samples(smooth, pattern, window_from_tag);
  if (samples.size() < kFewestSamples) return {};
  TagFit fit(pattern, pixel_by_tag, samples,
             PictureBlur::unknowns(std::hypot(kSharp_px, smooth_px), {0, 0}));
  if (expected) fit.expect_light(expected->black_levels, expected->contrast_levels);
  fit.thin_out();
  if (fit.samples().size() < kFewestSamples || !fit.converge(kMostSteps) || !(fit.contrast() > 0))
    return {};
  const std::array<CornerPlace, 4> places = corner_places(fit, pixel_from_tag, pixel_by_tag);
  std::array<Eigen::Vector2d, 4> corners;
  for (size_t c = 0; c < 4; ++c) corners[c] = places[c].pixel_px;
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
