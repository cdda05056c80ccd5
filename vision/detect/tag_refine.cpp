#include "vision/detect/tag_refine.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cassert>
#include <cmath>
#include <optional>

#include "vision/detect/corner_place.h"
#include "vision/detect/tag_fit.h"
#include "vision/detect/tag_samples.h"

namespace clothfit {
namespace {

/// Returns small steps from tag coordinates to pixels at the middle of the tag.
Eigen::Matrix2d steps_at_middle(const Eigen::Matrix3d& pixel_from_tag) {
  Eigen::Matrix2d steps;
  steps.col(0) = (mapped(pixel_from_tag, {1, 0}) - mapped(pixel_from_tag, {-1, 0})) / 2;
  steps.col(1) = (mapped(pixel_from_tag, {0, 1}) - mapped(pixel_from_tag, {0, -1})) / 2;
  return steps;
}

}  // namespace

RefinedTag refine_tag(const cv::Mat& grey, const TagPattern& pattern,
                      const Eigen::Matrix3d& pixel_from_tag) {
  assert(grey.type() == CV_8UC1);
  RefinedTag result;
  std::vector<TagSample> samples = tag_samples(grey, pattern, pixel_from_tag);
  constexpr size_t kFewest = 2 * TagUnknowns::kCount;
  if (samples.size() < kFewest) return result;

  const Eigen::Matrix2d pixel_by_tag = steps_at_middle(pixel_from_tag);
  constexpr double kSharp = 0.5;  // px
  TagFit fit(pattern, pixel_by_tag, samples, PictureBlur::unknowns(kSharp, {0, 0}));
  fit.thin_out();
  if (fit.samples().size() < kFewest) return result;
  constexpr int kMostSteps = 20;
  const bool converged = fit.converge(kMostSteps);
  result.explained = fit.robust().mean();
  if (std::getenv("DBG")) {
    PictureBlur b(fit.unknowns().segment<3>(TagUnknowns::kBlur));
    printf("DBG conv %d rough %.3f expl %.3f contrast %.1f lens %.3f motion %.2f\n", converged,
           fit.roughness_px(), result.explained, fit.contrast(), std::sqrt(b.lens_variance_px2()),
           b.motion_px().norm());
  }
  result.usable = converged && fit.contrast() > 0;  // white is brighter than black
  if (!result.usable) return result;

  if (std::getenv("DUMP")) {
    printf("TAG %zu\n", fit.samples().size());
    for (size_t i = 0; i < fit.samples().size(); ++i)
      printf("S %d %d %.3f %.3f %.3f %.4f\n", fit.samples()[i].u, fit.samples()[i].v,
             fit.residual()[i], fit.gradient()(i, 0), fit.gradient()(i, 1), fit.robust()[i]);
  }
  const std::array<CornerPlace, 4> places = corner_places(fit, pixel_from_tag, pixel_by_tag);
  for (size_t c = 0; c < 4; ++c) {
    result.corner_px[c] = places[c].pixel_px;
    result.sigma_px[c] = places[c].sigma_px;
    result.usable =
        result.usable && places[c].pixel_px.allFinite() && std::isfinite(places[c].sigma_px);
  }
  return result;
}

}  // namespace clothfit
