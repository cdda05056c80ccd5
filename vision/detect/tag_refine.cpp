#include "vision/detect/tag_refine.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "data/median.h"

namespace clothfit {
namespace {

// Unknowns: bending along x and along y, logarithms of the two blurs, light.
constexpr int kTerms = 10;
constexpr int kBendX = 0;
constexpr int kBendY = kTerms;
constexpr int kBlur = 2 * kTerms;
constexpr int kLight = kBlur + 2;
constexpr int kUnknowns = kLight + 6;

using Terms = Eigen::Matrix<double, kTerms, 1>;
using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;
using Normal = Eigen::Matrix<double, kUnknowns, kUnknowns>;

/// Returns the polynomials up to degree 3 in tag coordinates.
Terms polynomials(double x, double y) {
  Terms terms;
  terms << 1, x, y, x * x, x * y, y * y, x * x * x, x * x * y, x * y * y, y * y * y;
  return terms;
}

/// Returns the derivatives of `polynomials` by x and y.
Eigen::Matrix<double, kTerms, 2> polynomial_slopes(double x, double y) {
  Eigen::Matrix<double, kTerms, 2> slopes;
  slopes.col(0) << 0, 1, 0, 2 * x, y, 0, 3 * x * x, 2 * x * y, y * y, 0;
  slopes.col(1) << 0, 0, 1, 0, x, 2 * y, 0, x * x, 2 * x * y, 3 * y * y;
  return slopes;
}

/// Ratio of each degree's coefficients to those of the degree before: the bending is smooth.
constexpr double kDegreeRatio = 0.2;

/// Returns the precision (1 / sd^2) of each unknown before the picture is seen. Lengths are in half
/// tags.
Unknowns prior_precision() {
  constexpr double kQuadratic = 0.03;  // bends to radii of some ten tags, seen askew
  const auto precision = [](double sd) { return 1 / (sd * sd); };
  Unknowns prior = Unknowns::Zero();
  for (const int first : {kBendX, kBendY}) {
    prior.segment(first, 3).setConstant(precision(0.3));  // place, size, shear: nearly free
    prior.segment(first + 3, 3).setConstant(precision(kQuadratic));
    prior.segment(first + 6, 4).setConstant(precision(kDegreeRatio * kQuadratic));
  }
  prior.segment(kBlur, 2).setConstant(precision(0.7));  // lens, focus, motion
  return prior;                                         // light: free
}

/// Cumulative normal distribution and density by table, since the fit needs them millions of times.
/// Linear between entries 1/64 apart; errors below 1e-5.
class NormalTable {
 public:
  struct Entry {
    double value = 0, density = 0;
  };
  NormalTable() {
    for (size_t i = 0; i < entries_.size(); ++i) {
      const double u = static_cast<double>(i) / kPerUnit - kReach;
      entries_[i] = {0.5 * std::erfc(-u * M_SQRT1_2),
                     std::exp(-0.5 * u * u) * (0.5 * M_2_SQRTPI * M_SQRT1_2)};
    }
  }
  Entry at(double u) const {
    const double place = (std::clamp(u, -kReach, kReach) + kReach) * kPerUnit;
    const auto i = std::min(static_cast<size_t>(place), entries_.size() - 2);
    const double share = place - static_cast<double>(i);
    const Entry& a = entries_[i];
    const Entry& b = entries_[i + 1];
    return {a.value + share * (b.value - a.value), a.density + share * (b.density - a.density)};
  }

 private:
  static constexpr double kReach = 5;
  static constexpr int kPerUnit = 64;
  std::array<Entry, 2 * 5 * kPerUnit + 1> entries_;
};

/// One axis of the blurred pattern at a place: how much each cell under the blur counts there.
struct AxisWeights {
  static constexpr int kMaxCells = 16;
  int first = 0;
  int count = 0;
  std::array<double, kMaxCells> weight{};
  std::array<double, kMaxCells> by_place{};
  std::array<double, kMaxCells> by_log_blur{};
};

/// Weighs the cells under the blur; the first and the last cell reach on beyond the pattern.
AxisWeights axis_weights(const TagPattern& pattern, double place, double blur) {
  static const NormalTable normal;
  constexpr double kReach = 4;  // standard deviations
  const double cell = pattern.cell();
  const double origin = -0.5 * cell * pattern.total_cells;
  const auto cell_at = [&](double x) {
    // Clamped before the cast, because a poor step may need any place.
    return static_cast<int>(std::clamp((x - origin) / cell, 0.0, pattern.total_cells - 1.0));
  };
  AxisWeights result;
  result.first = cell_at(place - kReach * blur);
  result.count =
      std::min(cell_at(place + kReach * blur) - result.first + 1, AxisWeights::kMaxCells);
  // Value, density and density times place of the normal distribution at each cell's left end.
  double value = 1, density = 0, moment = 0;
  for (int i = 0; i < result.count; ++i) {
    const auto k = static_cast<size_t>(i);
    double next_value = 0, next_density = 0, next_moment = 0;
    if (i + 1 < result.count) {
      const double u = (place - (origin + cell * (result.first + i + 1))) / blur;
      const NormalTable::Entry entry = normal.at(u);
      next_value = entry.value;
      next_density = entry.density;
      next_moment = next_density * u;
    }
    result.weight[k] = value - next_value;
    result.by_place[k] = (density - next_density) / blur;
    result.by_log_blur[k] = next_moment - moment;
    value = next_value;
    density = next_density;
    moment = next_moment;
  }
  return result;
}

/// The blurred pattern (0 black, 1 white) and its derivatives.
struct PatternValue {
  double value = 0;
  double by_x = 0, by_y = 0;
  double by_log_blur_x = 0, by_log_blur_y = 0;
};

PatternValue pattern_value(const TagPattern& pattern, double x, double y, double blur_x,
                           double blur_y) {
  const AxisWeights across = axis_weights(pattern, x, blur_x);
  const AxisWeights down = axis_weights(pattern, y, blur_y);
  PatternValue result;
  for (int j = 0; j < down.count; ++j) {
    const float* row =
        &pattern.white[static_cast<size_t>((down.first + j) * pattern.total_cells + across.first)];
    double value = 0, by_x = 0, by_blur = 0;
    for (int i = 0; i < across.count; ++i) {
      const auto k = static_cast<size_t>(i);
      const double white = row[i];
      value += white * across.weight[k];
      by_x += white * across.by_place[k];
      by_blur += white * across.by_log_blur[k];
    }
    const auto k = static_cast<size_t>(j);
    result.value += down.weight[k] * value;
    result.by_x += down.weight[k] * by_x;
    result.by_log_blur_x += down.weight[k] * by_blur;
    result.by_y += down.by_place[k] * value;
    result.by_log_blur_y += down.by_log_blur[k] * value;
  }
  return result;
}

/// A pixel that shows the tag.
struct Sample {
  int u = 0, v = 0;
  double x = 0, y = 0;  ///< by the homography
  double grey = 0;
};

Eigen::Vector2d through(const Eigen::Matrix3d& homography, const Eigen::Vector2d& point) {
  return (homography * point.homogeneous()).hnormalized();
}

std::vector<Sample> pixels_of_tag(const cv::Mat& grey, const TagPattern& pattern,
                                  const Eigen::Matrix3d& pixel_from_tag) {
  // Outside the border only a cell of quiet zone is known, so the blur of its surroundings must
  // stay out.
  const double reach = 1 + 0.75 * pattern.cell();
  Eigen::AlignedBox2d box;
  for (const double x : {-reach, reach})
    for (const double y : {-reach, reach}) box.extend(through(pixel_from_tag, {x, y}));
  const int u_begin = std::max(0, static_cast<int>(std::ceil(box.min().x())));
  const int v_begin = std::max(0, static_cast<int>(std::ceil(box.min().y())));
  const int u_end = std::min(grey.cols - 1, static_cast<int>(std::floor(box.max().x())));
  const int v_end = std::min(grey.rows - 1, static_cast<int>(std::floor(box.max().y())));
  const Eigen::Matrix3d tag_from_pixel = pixel_from_tag.inverse();
  std::vector<Sample> samples;
  for (int v = v_begin; v <= v_end; ++v) {
    const std::uint8_t* row = grey.ptr<std::uint8_t>(v);
    for (int u = u_begin; u <= u_end; ++u) {
      const Eigen::Vector2d q = through(tag_from_pixel, Eigen::Vector2d(u, v));
      if (q.cwiseAbs().maxCoeff() > reach) continue;
      samples.push_back(
          {.u = u, .v = v, .x = q.x(), .y = q.y(), .grey = static_cast<double>(row[u])});
    }
  }
  return samples;
}

/// One row per sample. Single precision suffices for grey levels of 8 bits and is twice as fast.
using Rows = Eigen::Matrix<float, Eigen::Dynamic, kUnknowns, Eigen::RowMajor>;

/// The fit's state and the result of its last evaluation, one entry per sample.
struct Fit {
  Unknowns unknowns = Unknowns::Zero();
  Rows jacobian;
  Eigen::VectorXd residual;  ///< grey levels
  Eigen::VectorXd slope;     ///< of the model in the picture, grey levels per px
  Eigen::VectorXd weight;    ///< inverse variance times robust weight
  double trust = 0;          ///< mean robust weight
};

double square(double x) {
  return x * x;
}

/// Weighs residuals, whose spread grows with the slope of the picture,
///
///   variance = noise^2 + (roughness * slope)^2,
///
/// because edges are ragged (print, weave, sampling) by some share of a pixel. Both are estimated
/// from medians over this tag. A Cauchy loss comes on top.
void weigh(Fit& fit) {
  const double steepest = fit.slope.maxCoeff();
  std::vector<double> flat, rough, inverse_square_slope;
  for (Eigen::Index i = 0; i < fit.residual.size(); ++i) {
    if (fit.slope[i] < 0.1 * steepest) flat.push_back(std::abs(fit.residual[i]));
    if (fit.slope[i] > 0.4 * steepest) {
      rough.push_back(std::abs(fit.residual[i]) / fit.slope[i]);
      inverse_square_slope.push_back(1 / square(fit.slope[i]));
    }
  }
  constexpr double kRounding = 0.3;  // grey levels; what 8 bits leave
  const double noise =
      std::max(flat.empty() ? 0 : kMadToSigma * median(std::move(flat)), kRounding);
  double square_roughness = 0;
  if (!rough.empty())
    square_roughness = square(kMadToSigma * median(std::move(rough))) -
                       square(noise) * median(std::move(inverse_square_slope));
  square_roughness = std::max(square_roughness, 0.0);

  constexpr double kCauchy = 3;
  const Eigen::ArrayXd variance = square(noise) + square_roughness * fit.slope.array().square();
  const Eigen::ArrayXd robust =
      (1 + fit.residual.array().square() / (square(kCauchy) * variance)).inverse();
  fit.weight = robust / variance;
  fit.trust = robust.mean();
}

void evaluate(const TagPattern& pattern, const std::vector<Sample>& samples,
              const Eigen::Matrix2d& pixel_by_tag, Fit& fit) {
  const Unknowns& now = fit.unknowns;
  const double blur_x = std::exp(now[kBlur]);
  const double blur_y = std::exp(now[kBlur + 1]);
  const Eigen::Matrix2d tag_by_pixel = pixel_by_tag.inverse();
  for (size_t i = 0; i < samples.size(); ++i) {
    const Sample& sample = samples[i];
    const auto row = static_cast<Eigen::Index>(i);
    const Terms terms = polynomials(sample.x, sample.y);
    const double x = sample.x + terms.dot(now.segment<kTerms>(kBendX));
    const double y = sample.y + terms.dot(now.segment<kTerms>(kBendY));
    const PatternValue white = pattern_value(pattern, x, y, blur_x, blur_y);
    const Eigen::Vector3d linear(1, sample.x, sample.y);
    const double offset = linear.dot(now.segment<3>(kLight));
    const double contrast = linear.dot(now.segment<3>(kLight + 3));
    Eigen::Matrix<double, 1, kUnknowns> derivative;
    derivative.segment<kTerms>(kBendX) = contrast * white.by_x * terms;
    derivative.segment<kTerms>(kBendY) = contrast * white.by_y * terms;
    derivative[kBlur] = contrast * white.by_log_blur_x;
    derivative[kBlur + 1] = contrast * white.by_log_blur_y;
    derivative.segment<3>(kLight) = linear;
    derivative.segment<3>(kLight + 3) = white.value * linear;
    fit.jacobian.row(row) = derivative.cast<float>();
    fit.residual[row] = sample.grey - (offset + contrast * white.value);
    fit.slope[row] =
        std::abs(contrast) * (Eigen::RowVector2d(white.by_x, white.by_y) * tag_by_pixel).norm();
  }
  weigh(fit);
}

/// Thins out samples that say little. Flat ones tell only the light, and one in four of them stays;
/// of a large tag's samples `kEnough` stay in all. Sigma accounts for the samples left out.
void thin_out(std::vector<Sample>& samples, const Fit& fit) {
  constexpr size_t kEnough = 4000;
  const double flat = 0.03 * fit.slope.maxCoeff();
  std::vector<Sample> kept;
  for (size_t i = 0; i < samples.size(); ++i) {
    const bool tells = fit.slope[static_cast<Eigen::Index>(i)] > flat;
    if (tells || (samples[i].u + 2 * samples[i].v) % 4 == 0) kept.push_back(samples[i]);
  }
  const size_t stride = (kept.size() + kEnough - 1) / kEnough;
  samples.clear();
  for (size_t i = 0; i < kept.size(); i += stride) samples.push_back(kept[i]);
}

void resize(Fit& fit, size_t count) {
  const auto rows = static_cast<Eigen::Index>(count);
  fit.jacobian.resize(rows, kUnknowns);
  fit.residual.resize(rows);
  fit.slope.resize(rows);
}

/// Adds one Gauss-Newton step to `fit.unknowns` and sets `covariance` to the posterior's. Returns
/// the length of the step in standard deviations per unknown; not finite when there is no step.
double step(const Unknowns& prior_mean, const Unknowns& prior, Fit& fit, Normal& covariance) {
  const Rows whitened = fit.weight.cwiseSqrt().cast<float>().asDiagonal() * fit.jacobian;
  Eigen::Matrix<float, kUnknowns, kUnknowns> lower =
      Eigen::Matrix<float, kUnknowns, kUnknowns>::Zero();
  lower.selfadjointView<Eigen::Lower>().rankUpdate(whitened.transpose());
  Normal information = lower.cast<double>().selfadjointView<Eigen::Lower>();
  information.diagonal() += prior;
  const Unknowns gradient =
      (fit.jacobian.transpose() * fit.weight.cwiseProduct(fit.residual).cast<float>())
          .cast<double>() -
      prior.cwiseProduct(fit.unknowns - prior_mean);
  const Eigen::LDLT<Normal> solver(information);
  const Unknowns change = solver.solve(gradient);
  covariance = solver.solve(Normal::Identity());
  fit.unknowns += change;
  return std::sqrt(change.dot(gradient) / kUnknowns);
}

/// A corner of the border: its pixel, and the pixel's derivative by the unknowns.
struct Corner {
  Eigen::Vector2d pixel;
  Eigen::Matrix<double, 2, kUnknowns> by_unknowns;
};

Corner corner_of(const Unknowns& unknowns, const Eigen::Vector2d& corner,
                 const Eigen::Matrix3d& pixel_from_tag) {
  Eigen::Matrix<double, 2, kTerms> bend;
  bend.row(0) = unknowns.segment<kTerms>(kBendX).transpose();
  bend.row(1) = unknowns.segment<kTerms>(kBendY).transpose();

  // q + d(q) = corner by Newton's method; d is a few hundredths.
  constexpr int kSteps = 5;
  Eigen::Vector2d q = corner;
  Eigen::Matrix2d slope_inverse;
  for (int i = 0; i < kSteps; ++i) {
    slope_inverse =
        (Eigen::Matrix2d::Identity() + bend * polynomial_slopes(q.x(), q.y())).inverse();
    q -= slope_inverse * (q + bend * polynomials(q.x(), q.y()) - corner);
  }

  const Eigen::Vector3d image = pixel_from_tag * q.homogeneous();
  const Eigen::Vector2d pixel = image.hnormalized();
  const Eigen::Matrix2d pixel_by_q =
      (pixel_from_tag.topLeftCorner<2, 2>() - pixel * pixel_from_tag.block<1, 2>(2, 0)) / image.z();
  const Eigen::Matrix2d pixel_by_bend = -pixel_by_q * slope_inverse;
  const Terms terms = polynomials(q.x(), q.y());
  Corner result{.pixel = pixel, .by_unknowns = decltype(Corner::by_unknowns)::Zero()};
  result.by_unknowns.middleCols<kTerms>(kBendX) = pixel_by_bend.col(0) * terms.transpose();
  result.by_unknowns.middleCols<kTerms>(kBendY) = pixel_by_bend.col(1) * terms.transpose();
  return result;
}

/// Returns the variance (px^2 per coordinate) that bending of degree 4 and more may add at a
/// corner. It is extrapolated from the two highest degrees found here.
double left_out_variance(const Unknowns& unknowns, const Eigen::Matrix2d& pixel_by_tag) {
  const auto size = [&](int first, int count) {
    Eigen::Matrix2Xd bend(2, count);
    bend.row(0) = unknowns.segment(kBendX + first, count).transpose();
    bend.row(1) = unknowns.segment(kBendY + first, count).transpose();
    return (pixel_by_tag * bend).norm();
  };
  return square(kDegreeRatio * size(6, 4)) + square(square(kDegreeRatio) * size(3, 3));
}

}  // namespace

RefinedTag refine_tag(const cv::Mat& grey, const TagPattern& pattern,
                      const Eigen::Matrix3d& pixel_from_tag) {
  assert(grey.type() == CV_8UC1);
  assert(pattern.total_cells <= AxisWeights::kMaxCells);
  RefinedTag result;
  std::vector<Sample> samples = pixels_of_tag(grey, pattern, pixel_from_tag);
  constexpr size_t kFewest = 4 * kUnknowns;
  if (samples.size() < kFewest) return result;

  // The start has no bending, a sharp lens and a square pixel, and light from the extremes.
  Eigen::Matrix2d pixel_by_tag;  // in the middle
  pixel_by_tag.col(0) = (through(pixel_from_tag, {1, 0}) - through(pixel_from_tag, {-1, 0})) / 2;
  pixel_by_tag.col(1) = (through(pixel_from_tag, {0, 1}) - through(pixel_from_tag, {0, -1})) / 2;
  const Eigen::Matrix2d tag_by_pixel = pixel_by_tag.inverse();
  constexpr double kSharp = 0.5;  // px
  Fit fit;
  fit.unknowns[kBlur] = std::log(kSharp * tag_by_pixel.row(0).norm());
  fit.unknowns[kBlur + 1] = std::log(kSharp * tag_by_pixel.row(1).norm());
  const Unknowns prior_mean = fit.unknowns;
  const Unknowns prior = prior_precision();
  const auto [darkest, brightest] =
      std::minmax_element(samples.begin(), samples.end(),
                          [](const Sample& a, const Sample& b) { return a.grey < b.grey; });
  fit.unknowns[kLight] = darkest->grey;
  fit.unknowns[kLight + 3] = brightest->grey - darkest->grey;

  resize(fit, samples.size());
  evaluate(pattern, samples, pixel_by_tag, fit);
  thin_out(samples, fit);
  if (samples.size() < kFewest) return result;
  resize(fit, samples.size());

  // A step below a third of a standard deviation leaves an error of about its square.
  constexpr double kStill = 0.3;
  constexpr int kMaxSteps = 10;
  Normal covariance;
  double moved = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kMaxSteps && !(moved < kStill); ++i) {
    evaluate(pattern, samples, pixel_by_tag, fit);
    moved = step(prior_mean, prior, fit, covariance);
    constexpr double kFarBlur = 3;  // of the logarithm: a factor of 20, no tag any more
    if (!fit.unknowns.allFinite() ||
        (fit.unknowns - prior_mean).segment<2>(kBlur).cwiseAbs().maxCoeff() > kFarBlur)
      return result;
  }
  result.explained = fit.trust;
  result.usable = moved < kStill && fit.unknowns[kLight + 3] > 0;  // white is brighter than black
  if (!result.usable) return result;

  const double left_out = left_out_variance(fit.unknowns, pixel_by_tag);
  constexpr std::array<std::array<double, 2>, 4> kCorners = {{{-1, 1}, {1, 1}, {1, -1}, {-1, -1}}};
  for (size_t c = 0; c < 4; ++c) {
    const Corner corner = corner_of(fit.unknowns, {kCorners[c][0], kCorners[c][1]}, pixel_from_tag);
    const double variance =
        (corner.by_unknowns * covariance * corner.by_unknowns.transpose()).trace() / 2;
    result.corner_px[c] = corner.pixel;
    result.sigma_px[c] = std::sqrt(variance + left_out);
    result.usable = result.usable && corner.pixel.allFinite() && std::isfinite(variance);
  }
  return result;
}

}  // namespace clothfit
