#include "vision/detect/tag_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "data/median.h"
#include "vision/detect/blurred_pattern.h"

namespace clothfit {
namespace {

using Unknowns = TagUnknowns::Vector;
using Normal = TagUnknowns::Matrix;

double square(double x) {
  return x * x;
}

constexpr double kSharp = 0.5;  // px; a sharp lens and a square pixel

}  // namespace

TagUnknowns::Terms TagUnknowns::polynomials(double x, double y) {
  Terms terms;
  terms << 1, x, y, x * x, x * y, y * y, x * x * x, x * x * y, x * y * y, y * y * y;
  return terms;
}

Eigen::Matrix<double, TagUnknowns::kTerms, 2> TagUnknowns::polynomial_slopes(double x, double y) {
  Eigen::Matrix<double, kTerms, 2> slopes;
  slopes.col(0) << 0, 1, 0, 2 * x, y, 0, 3 * x * x, 2 * x * y, y * y, 0;
  slopes.col(1) << 0, 0, 1, 0, x, 2 * y, 0, x * x, 2 * x * y, 3 * y * y;
  return slopes;
}

TagUnknowns::Vector TagUnknowns::prior_precision() {
  constexpr double kQuadratic = 0.03;  // bends to radii of some ten tags, seen askew
  const auto precision = [](double sd) { return 1 / square(sd); };
  Vector prior = Vector::Zero();
  for (const int first : {kBendX, kBendY}) {
    prior.segment(first, 3).setConstant(precision(0.3));  // place, size, shear: nearly free
    prior.segment(first + 3, 3).setConstant(precision(kQuadratic));
    prior.segment(first + 6, 4).setConstant(precision(kDegreeRatio * kQuadratic));
  }
  prior.segment(kBlur, 3).setConstant(precision(1.4));  // of log variances: lens, focus, motion
  prior.segment(kBlurSlope, 6).setConstant(precision(0.4));  // motion that differs over the tag
  return prior;
}

TagFit::TagFit(const TagPattern& pattern, const Eigen::Matrix2d& pixel_by_tag,
               std::vector<TagSample> samples, const PictureBlur::Unknowns& start)
    : pattern_(&pattern),
      pixel_by_tag_(pixel_by_tag),
      samples_(std::move(samples)),
      prior_mean_(Unknowns::Zero()),
      prior_(TagUnknowns::prior_precision()) {
  constexpr double kRoughest = 0.1;  // cells; more would pass for another print
  most_roughness_px_ = kRoughest * cell_px();
  prior_mean_.segment<3>(TagUnknowns::kBlur) =
      PictureBlur::unknowns(kSharp, Eigen::Vector2d::Zero());
  unknowns_.segment<3>(TagUnknowns::kBlur) = start;
  const auto [darkest, brightest] = std::ranges::minmax_element(samples_, {}, &TagSample::grey);
  unknowns_[TagUnknowns::kLight] = darkest->grey;
  const double range = brightest->grey - darkest->grey;
  unknowns_[TagUnknowns::kLight + 3] = range;
  // Light varies little over a tag; what hides half of one must not pass for its dark side.
  constexpr double kLightSlope = 0.15;  // of the range, to the edge of the tag
  for (const int slope : {1, 2, 4, 5})
    prior_[TagUnknowns::kLight + slope] = 1 / square(kLightSlope * std::max(range, 1.0));
}

void TagFit::thin_out() {
  evaluate();
  clothfit::thin_out(samples_, slope_);
}

void TagFit::expect_light(double black_levels, double contrast_levels) {
  constexpr double kKnown = 0.15;
  const double precision = 1 / square(kKnown * contrast_levels);
  for (const auto& [which, level] : {std::pair(0, black_levels), std::pair(3, contrast_levels)}) {
    unknowns_[TagUnknowns::kLight + which] = level;
    prior_mean_[TagUnknowns::kLight + which] = level;
    prior_[TagUnknowns::kLight + which] = precision;
  }
}

void TagFit::bound_noise(double noise_levels, double roughness_px) {
  most_noise_levels_ = noise_levels;
  most_roughness_px_ = std::min(most_roughness_px_, roughness_px);
}

double TagFit::cell_px() const {
  return pattern_->cell() * pixel_by_tag_.colwise().norm().maxCoeff();
}

/// Says whether a blur leaves cells that can be told apart.
bool TagFit::leaves_cells(const PictureBlur::Unknowns& unknowns) const {
  constexpr double kWidestMotion = 3, kWidestLens = 1;  // cells
  constexpr double kLeastLens_px = 0.1;
  constexpr double kAnyBlur = 20;  // of the logarithms: larger ones overflow
  if (!(unknowns.cwiseAbs().maxCoeff() < kAnyBlur)) return false;
  const PictureBlur blur(unknowns);
  const double lens_px = std::sqrt(blur.lens_variance_px2());
  return blur.motion_px().norm() < kWidestMotion * cell_px() && lens_px < kWidestLens * cell_px() &&
         lens_px > kLeastLens_px;
}

bool TagFit::converge(int most_steps) {
  // A step below a third of a standard deviation leaves an error of about its square.
  constexpr double kStill = 0.3;
  for (int i = 0; i < most_steps; ++i) {
    evaluate();
    const double moved = step();
    if (!unknowns_.allFinite() || !leaves_cells(unknowns_.segment<3>(TagUnknowns::kBlur)))
      return false;
    if (moved < kStill) return true;
  }
  return false;
}

/// Weighs residuals, whose spread grows with the slope of the picture,
///
///   variance = noise^2 + (roughness * slope)^2,
///
/// because edges are ragged (print, weave, sampling) by some share of a pixel. Both are estimated
/// from medians over this tag. A Cauchy loss comes on top.
void TagFit::weigh() {
  const double steepest = slope_.maxCoeff();
  std::vector<double> flat, rough, inverse_square_slope;
  for (Eigen::Index i = 0; i < residual_.size(); ++i) {
    if (slope_[i] < 0.1 * steepest) flat.push_back(std::abs(residual_[i]));
    if (slope_[i] > 0.4 * steepest) {
      rough.push_back(std::abs(residual_[i]) / slope_[i]);
      inverse_square_slope.push_back(1 / square(slope_[i]));
    }
  }
  constexpr double kRounding = 0.3;  // grey levels; what 8 bits leave
  const double by_median = flat.empty() ? 0 : kMadToSigma * median(std::move(flat));
  const double noise = std::max(std::min(by_median, most_noise_levels_), kRounding);
  double square_roughness = 0;
  if (!rough.empty())
    square_roughness = square(kMadToSigma * median(std::move(rough))) -
                       square(noise) * median(std::move(inverse_square_slope));
  square_roughness = std::clamp(square_roughness, 0.0, square(most_roughness_px_));
  noise_levels_ = noise;
  roughness_px_ = std::sqrt(square_roughness);

  constexpr double kCauchy = 3;
  const Eigen::ArrayXd variance = square(noise) + square_roughness * slope_.array().square();
  robust_ = (1 + residual_.array().square() / (square(kCauchy) * variance)).inverse();
  weight_ = robust_.array() / variance;
}

void TagFit::evaluate() {
  using Layout = TagUnknowns;
  const auto rows = static_cast<Eigen::Index>(samples_.size());
  jacobian_.resize(rows, Layout::kCount);
  residual_.resize(rows);
  gradient_.resize(rows, 2);
  const PictureBlur blur(unknowns_.segment<3>(Layout::kBlur));
  const BlurredPattern blurred(*pattern_, pixel_by_tag_, blur);
  const Eigen::Matrix2d tag_by_pixel = pixel_by_tag_.inverse();
  // Change of the pattern with each unknown of the blur: these times its second derivatives.
  std::array<Eigen::Matrix2d, 3> half_slopes = blur.covariance_slopes();
  for (Eigen::Matrix2d& slope : half_slopes)
    slope = 0.5 * tag_by_pixel * slope * tag_by_pixel.transpose();
  for (Eigen::Index row = 0; row < rows; ++row) {
    const TagSample& sample = samples_[static_cast<size_t>(row)];
    const Layout::Terms terms = Layout::polynomials(sample.x, sample.y);
    const double x = sample.x + terms.dot(unknowns_.segment<Layout::kTerms>(Layout::kBendX));
    const double y = sample.y + terms.dot(unknowns_.segment<Layout::kTerms>(Layout::kBendY));
    const BlurredPattern::Value white = blurred.at(x, y);
    const Eigen::Vector3d linear(1, sample.x, sample.y);
    const double offset = linear.dot(unknowns_.segment<3>(Layout::kLight));
    const double contrast = linear.dot(unknowns_.segment<3>(Layout::kLight + 3));
    Eigen::Matrix<double, 1, Layout::kCount> derivative;
    derivative.segment<Layout::kTerms>(Layout::kBendX) = contrast * white.by_x * terms;
    derivative.segment<Layout::kTerms>(Layout::kBendY) = contrast * white.by_y * terms;
    double level = white.value;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Matrix2d& half = half_slopes[static_cast<size_t>(k)];
      const double by_blur =
          half(0, 0) * white.by_xx + 2 * half(0, 1) * white.by_xy + half(1, 1) * white.by_yy;
      derivative[Layout::kBlur + k] = contrast * by_blur;
      derivative[Layout::kBlurSlope + 2 * k] = contrast * by_blur * sample.x;
      derivative[Layout::kBlurSlope + 2 * k + 1] = contrast * by_blur * sample.y;
      level += by_blur * (sample.x * unknowns_[Layout::kBlurSlope + 2 * k] +
                          sample.y * unknowns_[Layout::kBlurSlope + 2 * k + 1]);
    }
    derivative.segment<3>(Layout::kLight) = linear;
    derivative.segment<3>(Layout::kLight + 3) = level * linear;
    jacobian_.row(row) = derivative.cast<float>();
    residual_[row] = sample.grey - (offset + contrast * level);
    gradient_.row(row) = contrast * Eigen::RowVector2d(white.by_x, white.by_y) * tag_by_pixel;
  }
  slope_ = gradient_.rowwise().norm();
  weigh();
}

/// Adds one Gauss-Newton step to the unknowns and sets the covariance to the posterior's. Returns
/// the length of the step in standard deviations per unknown; not finite when there is no step.
double TagFit::step() {
  constexpr int kCount = TagUnknowns::kCount;
  whitened_ = weight_.cwiseSqrt().cast<float>().asDiagonal() * jacobian_;
  Eigen::Matrix<float, kCount, kCount> lower = Eigen::Matrix<float, kCount, kCount>::Zero();
  lower.selfadjointView<Eigen::Lower>().rankUpdate(whitened_.transpose());
  Normal information = lower.cast<double>().selfadjointView<Eigen::Lower>();
  information.diagonal() += prior_;
  const Unknowns gradient =
      (jacobian_.transpose() * weight_.cwiseProduct(residual_).cast<float>()).cast<double>() -
      prior_.cwiseProduct(unknowns_ - prior_mean_);
  const Eigen::LDLT<Normal> solver(information);
  const Unknowns change = solver.solve(gradient);
  covariance_ = solver.solve(Normal::Identity());
  unknowns_ += change;
  return std::sqrt(change.dot(gradient) / kCount);
}

}  // namespace clothfit
