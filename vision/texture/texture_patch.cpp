#include "vision/texture/texture_patch.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <optional>

namespace clothfit {
namespace {

/// Returns the sample at a place; nothing within two pixels of the picture's border.
std::optional<TexturePatch::Sample> sample_at(const SmoothPicture& picture,
                                              const Eigen::Vector2f& at) {
  const Eigen::Vector2f reach(1, 1);
  if (!picture.covers(at - reach) || !picture.covers(at + reach)) return std::nullopt;
  const auto level = [&](int u, int v) {
    return picture.at(at + Eigen::Vector2i(u, v).cast<float>()).level;
  };
  TexturePatch::Sample sample;
  const float here = sample.level = level(0, 0);
  sample.by_blur << 0.5F * (level(1, 0) - 2 * here + level(-1, 0)),
      0.25F * (level(1, 1) - level(1, -1) - level(-1, 1) + level(-1, -1)),
      0.5F * (level(0, 1) - 2 * here + level(0, -1));
  return sample;
}

void measure_contrast(TexturePatch& patch) {
  float sum = 0, squares = 0, weight = 0;
  for (const TexturePatch::Sample& sample : patch.samples) {
    weight += sample.weight;
    sum += sample.weight * sample.level;
  }
  if (weight <= 0) return;
  patch.mean_level = sum / weight;
  for (const TexturePatch::Sample& sample : patch.samples)
    squares +=
        sample.weight * (sample.level - patch.mean_level) * (sample.level - patch.mean_level);
  patch.contrast_levels = std::sqrt(squares / weight);
}

}  // namespace

TexturePatch make_texture_patch(const SmoothPicture& picture, const Eigen::Vector2d& marker_px,
                                double radius_px, int step_px, const OnCloth& on_cloth) {
  const int reach = static_cast<int>(std::ceil(radius_px / step_px));
  TexturePatch patch{.marker_px = marker_px,
                     .radius_px = radius_px,
                     .step_px = step_px,
                     .grid_columns = 2 * reach + 1,
                     .samples = {}};
  for (int row = -reach; row <= reach; ++row)
    for (int column = -reach; column <= reach; ++column) {
      const Eigen::Vector2d offset(column * step_px, row * step_px);
      const double share = offset.squaredNorm() / (radius_px * radius_px);
      if (share >= 1 || !on_cloth(offset)) continue;
      std::optional<TexturePatch::Sample> sample =
          sample_at(picture, (marker_px + offset).cast<float>());
      if (!sample) continue;
      constexpr double kLeastWeight = 0.25;  // at the rim
      sample->offset_px = offset.cast<float>();
      sample->weight = static_cast<float>(1 - (1 - kLeastWeight) * share);
      sample->column = column + reach;
      sample->row = row + reach;
      patch.samples.push_back(*sample);
    }
  measure_contrast(patch);
  return patch;
}

double attainable_sigma_px(const TexturePatch& patch, const SmoothPicture& picture,
                           double noise_levels) {
  // Unknowns: place and linear part of the warp, gain and offset of the light.
  using Row = Eigen::Matrix<double, 8, 1>;
  Eigen::Matrix<double, 8, 8> normal = Eigen::Matrix<double, 8, 8>::Zero();
  for (const TexturePatch::Sample& sample : patch.samples) {
    const Eigen::Vector2d offset = sample.offset_px.cast<double>();
    const Eigen::Vector2d slope =
        picture.at((patch.marker_px + offset).cast<float>()).slope.cast<double>();
    const Eigen::Vector2d from = offset / patch.radius_px;
    Row row;
    row << slope, slope.x() * from, slope.y() * from,
        double{sample.level - patch.mean_level} / std::max(1.0, double{patch.contrast_levels}), 1;
    normal += double{sample.weight} * row * row.transpose();
  }
  const Eigen::LDLT<Eigen::Matrix<double, 8, 8>> solver(normal);
  const double least = 1e-9 * normal.diagonal().maxCoeff();
  if (patch.samples.size() < 16 || !(solver.vectorD().minCoeff() > least))
    return std::numeric_limits<double>::infinity();
  const Eigen::Matrix<double, 8, 8> covariance =
      solver.solve(Eigen::Matrix<double, 8, 8>::Identity());
  return noise_levels * std::sqrt(std::max(covariance(0, 0), covariance(1, 1)));
}

}  // namespace clothfit
