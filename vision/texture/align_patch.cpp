#include "vision/texture/align_patch.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "data/median.h"

namespace clothfit {
namespace align {

Unknowns to_unknowns(const PatchWarp& warp, double radius_px) {
  Unknowns unknowns = Unknowns::Zero();
  unknowns.segment<2>(0) = warp.place_px;
  unknowns.segment<4>(2) = radius_px * warp.linear.reshaped();
  unknowns.segment<6>(6) = radius_px * radius_px * warp.second.reshaped();
  return unknowns;
}

PatchWarp to_warp(const Unknowns& unknowns, double radius_px) {
  PatchWarp warp;
  warp.place_px = unknowns.segment<2>(0);
  warp.linear.reshaped() = unknowns.segment<4>(2) / radius_px;
  warp.second.reshaped() = unknowns.segment<6>(6) / (radius_px * radius_px);
  return warp;
}

Linearised linearise(const SmoothPicture& picture, const TexturePatch& patch,
                     const Unknowns& unknowns) {
  const auto count = static_cast<Eigen::Index>(patch.samples.size());
  Linearised result{
      .residual = Eigen::VectorXf::Zero(count),
      .jacobian = Eigen::Matrix<float, Eigen::Dynamic, kUnknowns>::Zero(count, kUnknowns),
      .weight = Eigen::VectorXf::Zero(count)};
  const Eigen::Matrix<float, kUnknowns, 1> x = unknowns.cast<float>();
  const auto radius = static_cast<float>(patch.radius_px);
  for (Eigen::Index i = 0; i < count; ++i) {
    const TexturePatch::Sample& sample = patch.samples[static_cast<size_t>(i)];
    const Eigen::Vector2f d = sample.offset_px / radius;
    const Eigen::Vector3f square(0.5F * d.x() * d.x(), d.x() * d.y(), 0.5F * d.y() * d.y());
    Eigen::Vector2f at = x.segment<2>(0) + d.x() * x.segment<2>(2) + d.y() * x.segment<2>(4);
    for (int k = 0; k < 3; ++k) at += square[k] * x.segment<2>(6 + 2 * k);
    if (!picture.covers(at)) continue;
    const PictureSample seen = picture.at(at);
    const float relief = sample.level - patch.mean_level;
    const Eigen::Vector2f lit = d * sample.level;
    result.weight[i] = sample.weight;
    result.residual[i] = seen.level - x[12] * relief - x[13] * lit.x() - x[14] * lit.y() - x[15] -
                         x.segment<3>(16).dot(sample.by_blur);
    auto row = result.jacobian.row(i);
    const Eigen::RowVector2f slope = seen.slope.transpose();
    row << slope, d.x() * slope, d.y() * slope, square[0] * slope, square[1] * slope,
        square[2] * slope, -relief, -lit.x(), -lit.y(), -1, -sample.by_blur.transpose();
  }
  return result;
}

}  // namespace align

namespace {

using align::kUnknowns;
using align::Linearised;
using align::Unknowns;
using NormalMatrix = Eigen::Matrix<double, kUnknowns, kUnknowns>;

/// Returns the robust standard deviation of the residuals within the picture.
double robust_spread(const Linearised& now, double least) {
  std::vector<double> sizes;
  sizes.reserve(static_cast<size_t>(now.residual.size()));
  for (Eigen::Index i = 0; i < now.residual.size(); ++i)
    if (now.weight[i] > 0) sizes.push_back(std::abs(double{now.residual[i]}));
  return sizes.empty() ? least : std::max(least, kMadToSigma * median(std::move(sizes)));
}

Eigen::VectorXf robust_weights(const Linearised& now, double spread) {
  constexpr float kDoubted = 3;  // standard deviations
  return (1 + (now.residual.array() / (kDoubted * static_cast<float>(spread))).square()).inverse();
}

/// Returns the place, px, of the sample that an addition to the unknowns moves most.
double largest_move_px(const Unknowns& step) {
  return step.segment<2>(0).norm() + step.segment<4>(2).norm() + 0.5 * step.segment<6>(6).norm();
}

/// Returns the gain and level that a patch has at its start, by moments of the samples.
void start_light(const Linearised& at_start, const TexturePatch& patch, Unknowns& unknowns) {
  // Without light the residual is the picture's level.
  double weight = 0, sum = 0, mixed = 0, square = 0;
  for (Eigen::Index i = 0; i < at_start.residual.size(); ++i) {
    const double w = double{at_start.weight[i]}, level = double{at_start.residual[i]};
    const double relief =
        double{patch.samples[static_cast<size_t>(i)].level} - double{patch.mean_level};
    weight += w;
    sum += w * level;
    mixed += w * level * relief;
    square += w * relief * relief;
  }
  unknowns[15] = weight > 0 ? sum / weight : 0;
  // A covariance below a part of the contrast says that the start is off by more than the texture.
  unknowns[12] = square > 0 ? std::clamp(mixed / square, 0.3, 3.0) : 1;
}

/// The information of the priors, per variance of the residuals.
struct Priors {
  Unknowns mean = Unknowns::Zero();
  Unknowns information = Unknowns::Zero();

  Priors(const Unknowns& start, double radius_px, const AlignOptions& options) {
    const auto of = [](double sigma) { return 1 / (sigma * sigma); };
    mean.segment<4>(2) = start.segment<4>(2);
    information.segment<4>(2).setConstant(of(options.linear_prior * radius_px));
    information.segment<6>(6).setConstant(of(2 * options.second_prior * radius_px));
    information.segment<2>(13).setConstant(of(options.light_prior));
    information.segment<3>(16).setConstant(of(options.blur_prior_px2));
  }
};

/// Says how well the fit explains the samples.
void describe_explained(const Linearised& now, const Eigen::VectorXf& robust,
                        const TexturePatch& patch, PatchFit& fit) {
  double whole = 0, kept = 0, middle = 0, kept_in_middle = 0, level = 0, squares = 0;
  const auto radius = static_cast<float>(patch.radius_px);
  const auto relief = [&](const TexturePatch::Sample& sample) {
    return double{sample.level - patch.mean_level} * fit.gain;
  };
  for (Eigen::Index i = 0; i < robust.size(); ++i) {
    const TexturePatch::Sample& sample = patch.samples[static_cast<size_t>(i)];
    const double share = double{now.weight[i]}, used = share * double{robust[i]};
    whole += share;
    kept += used;
    const bool in_middle = sample.offset_px.norm() < radius / 3;
    middle += in_middle ? share : 0;
    kept_in_middle += in_middle ? used : 0;
    level += used * relief(sample);
    squares += used * double{now.residual[i]} * double{now.residual[i]};
  }
  double contrast = 0;
  for (Eigen::Index i = 0; i < robust.size(); ++i) {
    const double off = relief(patch.samples[static_cast<size_t>(i)]) - level / std::max(kept, 1.0);
    contrast += double{now.weight[i]} * double{robust[i]} * off * off;
  }
  fit.kept = whole > 0 ? kept / whole : 0;
  fit.kept_in_middle = middle > 0 ? kept_in_middle / middle : 0;
  fit.explained = contrast + squares > 0 ? contrast / (contrast + squares) : 0;
}

/// Says how each sample moves the place: an M-estimator's influence is the loss's derivative psi
/// over the mean of its second derivative [huber1981].
void describe_influence(const Linearised& now, const Eigen::VectorXf& robust,
                        const NormalMatrix& normal, PatchFit& fit) {
  const Eigen::ArrayXf weight = now.weight.array(), kept = robust.array();
  // Of Cauchy's loss psi is robust r, and its derivative robust (2 robust - 1).
  const Eigen::VectorXf psi = now.residual.cwiseProduct(robust);
  const double whole = std::max(1.0, double{weight.sum()});
  fit.residual_levels = std::sqrt(double{(weight * psi.array().square()).sum()} / whole);
  const float used = (weight * kept).sum();
  constexpr float kLeastShare = 0.5F;  // a patch half covered has outliers for whom it is negative
  const float curved = std::max((weight * kept * (2 * kept - 1)).sum(), kLeastShare * used);
  const NormalMatrix inverse = normal.ldlt().solve(NormalMatrix::Identity());
  fit.influence = -(used / curved) * (now.weight.asDiagonal() * now.jacobian *
                                      inverse.topRows<2>().transpose().cast<float>());
  fit.residual = psi / static_cast<float>(std::max(fit.residual_levels, 1e-3));
}

AlignEnd judge_warp(const PatchWarp& warp, const TexturePatch& patch) {
  constexpr double kLeastArea = 0.03;
  if (!(warp.linear.determinant() > kLeastArea)) return AlignEnd::collapsed;
  for (const double x : {-0.7, 0.7})
    for (const double y : {-0.7, 0.7})
      if (!(warp.jacobian(patch.radius_px * Eigen::Vector2d(x, y)).determinant() > 0))
        return AlignEnd::collapsed;
  return AlignEnd::converged;
}

/// Says whether enough of the patch lies in the picture.
bool shows_enough(const Linearised& now, const TexturePatch& patch) {
  constexpr double kLeastShare = 0.6;
  double seen = 0, whole = 0;
  for (Eigen::Index i = 0; i < now.weight.size(); ++i) {
    seen += double{now.weight[i]};
    whole += double{patch.samples[static_cast<size_t>(i)].weight};
  }
  return whole > 0 && seen > kLeastShare * whole;
}

}  // namespace

PatchFit align_patch(const SmoothPicture& picture, const TexturePatch& patch,
                     const PatchWarp& start, const AlignOptions& options) {
  PatchFit fit;
  fit.warp = start;
  Unknowns x = align::to_unknowns(start, patch.radius_px);
  const Priors priors(x, patch.radius_px, options);
  constexpr double kLongestStep_px = 2;
  constexpr double kRepeats = 2;  // samples that err alike, about; a prior counts as one of them
  for (int iteration = 0; iteration < options.most_iterations; ++iteration) {
    Linearised now = align::linearise(picture, patch, x);
    if (!shows_enough(now, patch)) {
      fit.end = AlignEnd::outside;
      return fit;
    }
    if (iteration == 0) {
      start_light(now, patch, x);
      now = align::linearise(picture, patch, x);
    }
    const double spread = robust_spread(now, options.least_levels);
    const Eigen::VectorXf robust = robust_weights(now, spread);
    const Eigen::VectorXf weight = now.weight.cwiseProduct(robust);
    const Eigen::Matrix<float, Eigen::Dynamic, kUnknowns> weighted =
        weight.asDiagonal() * now.jacobian;
    NormalMatrix normal = (now.jacobian.transpose() * weighted).cast<double>();
    const Unknowns information = kRepeats * spread * spread * priors.information;
    normal.diagonal() += information;
    const Unknowns gradient = (weighted.transpose() * now.residual).cast<double>() +
                              information.cwiseProduct(x - priors.mean);
    Unknowns step = -normal.ldlt().solve(gradient);
    if (!step.allFinite()) return fit;
    const double move_px = largest_move_px(step);
    if (move_px > kLongestStep_px) step *= kLongestStep_px / move_px;
    x += step;
    fit.warp = align::to_warp(x, patch.radius_px);
    fit.end = judge_warp(fit.warp, patch);
    if (fit.end != AlignEnd::converged) return fit;
    fit.gain = x[12];
    fit.level = x[15];
    constexpr double kNearlyThere = 10;  // times the last step
    const bool last = iteration + 1 == options.most_iterations;
    if (move_px < options.step_px || (last && move_px < kNearlyThere * options.step_px)) {
      describe_explained(now, robust, patch, fit);
      describe_influence(now, robust, normal, fit);
      return fit;
    }
  }
  fit.end = AlignEnd::unsettled;
  return fit;
}

}  // namespace clothfit
