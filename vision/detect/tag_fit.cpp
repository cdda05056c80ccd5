#include "vision/detect/tag_fit.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "data/median.h"

namespace clothfit {
namespace {

using Unknowns = TagUnknowns::Vector;

double square(double x) {
  return x * x;
}

/// Mean weight above which the pattern explains the pixels; clean tags have 0.9.
constexpr double kExplained = 0.8;
/// Length of steps, in standard deviations per unknown, from which on the solution is near.
constexpr double kNearSolution = 2;
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
               const TagSamples& samples, const PictureBlur::Unknowns& start)
    : pattern_(&pattern),
      samples_(&samples),
      pixel_by_tag_(pixel_by_tag),
      tag_by_pixel_(pixel_by_tag.inverse()),
      prior_mean_(Unknowns::Zero()),
      prior_(TagUnknowns::prior_precision()) {
  constexpr double kRoughest = 0.1;  // cells; more would pass for another print
  most_roughness_px_ = kRoughest * cell_px();
  prior_mean_.segment<3>(TagUnknowns::kBlur) =
      PictureBlur::unknowns(kSharp, Eigen::Vector2d::Zero());
  unknowns_.segment<3>(TagUnknowns::kBlur) = start;
  const auto grey = samples.grey.head(samples.count);
  unknowns_[TagUnknowns::kLight] = grey.minCoeff();
  const double range = grey.maxCoeff() - grey.minCoeff();
  unknowns_[TagUnknowns::kLight + 3] = range;
  // Light varies little over a tag; what hides half of one must not pass for its dark side.
  constexpr double kLightSlope = 0.15;  // of the range, to the edge of the tag
  for (const int slope : {1, 2, 4, 5})
    prior_[TagUnknowns::kLight + slope] = 1 / square(kLightSlope * std::max(range, 1.0));
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

bool TagFit::converge(int most_steps, Ending ending) {
  // A step this short leaves an error of about its square. Where the pattern explains the pixels,
  // steps shrink by about the same ratio each time, which tells the next one.
  constexpr double kStill = 0.3, kNextStill = 0.2;
  double before = 0;
  for (int i = 0; i < most_steps; ++i) {
    evaluate();
    const double moved = step();
    if (!unknowns_.allFinite() || !leaves_cells(unknowns_.segment<3>(TagUnknowns::kBlur)))
      return false;
    const bool fades = ending == Ending::kPredicted && i > 0 && robust().mean() > kExplained &&
                       moved < kNearSolution && moved * moved < kNextStill * before;
    before = moved;
    if (moved < kStill || fades) {
      covariance_ = solver_.solve(TagUnknowns::Matrix::Identity());
      return true;
    }
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
  const Eigen::Index count = samples_->count;
  const auto residual = rows_.residual.head(count), slope = rows_.slope.head(count);
  const float steepest = slope.maxCoeff();
  std::vector<double> flat, rough, inverse_square_slope;
  constexpr Eigen::Index kEnough = 1000;  // samples; medians are then right to some per cent
  Eigen::Index step = std::max<Eigen::Index>(1, count / kEnough);
  while (std::gcd(step, samples_->width) > 1) ++step;  // so that all columns have their turn
  for (Eigen::Index i = 0; i < count; i += step) {
    if (slope[i] < 0.1F * steepest) flat.push_back(std::abs(residual[i]));
    if (slope[i] > 0.4F * steepest) {
      rough.push_back(std::abs(residual[i] / slope[i]));
      inverse_square_slope.push_back(1 / square(slope[i]));
    }
  }
  constexpr double kRounding = 0.3;  // grey levels; what 8 bits leave
  const double by_median = flat.empty() ? 0 : kMadToSigma * median(std::move(flat));
  noise_levels_ = std::max(std::min(by_median, most_noise_levels_), kRounding);
  double square_roughness = 0;
  if (!rough.empty())
    square_roughness = square(kMadToSigma * median(std::move(rough))) -
                       square(noise_levels_) * median(std::move(inverse_square_slope));
  roughness_px_ = std::sqrt(std::clamp(square_roughness, 0.0, square(most_roughness_px_)));
  constexpr float kCauchy = 3;
  weigh_rows({.noise_levels = static_cast<float>(noise_levels_),
              .roughness_px = static_cast<float>(roughness_px_),
              .loss = kCauchy},
             *samples_, rows_);
}

/// Makes the pattern under the blur. One made before serves as long as the blur is nearly the same.
void TagFit::blur_pattern() {
  constexpr double kNearly = 0.01;  // of the logarithms; leaves 5e-5 of what the blur does
  const PictureBlur::Unknowns now = unknowns_.segment<3>(TagUnknowns::kBlur);
  if (!blurred_ || (now - blurred_for_).cwiseAbs().maxCoeff() > kNearly) {
    blurred_.emplace(*pattern_, pixel_by_tag_, PictureBlur(now));
    blurred_for_ = now;
    blurred_with_ = PictureBlur::unknowns(blurred_->covariance_px2());
    const std::array<Eigen::Matrix2d, 3> slopes = PictureBlur(blurred_with_).covariance_slopes();
    for (size_t k = 0; k < 3; ++k) {
      const Eigen::Matrix2f half =
          (0.5 * tag_by_pixel_ * slopes[k] * tag_by_pixel_.transpose()).cast<float>();
      model_.by_blur[k] = {half(0, 0), 2 * half(0, 1), half(1, 1)};
    }
  }
  for (size_t k = 0; k < 3; ++k) {
    const auto which = static_cast<Eigen::Index>(k);
    model_.blur_change[k] = static_cast<float>(now[which] - blurred_with_[which]);
  }
}

void TagFit::evaluate() {
  using Layout = TagUnknowns;
  blur_pattern();
  const auto copy = [&](int first, auto& to) {
    for (size_t k = 0; k < to.size(); ++k)
      to[k] = static_cast<float>(unknowns_[first + static_cast<int>(k)]);
  };
  copy(Layout::kBendX, model_.bend_x);
  copy(Layout::kBendY, model_.bend_y);
  copy(Layout::kBlurSlope, model_.blur_slope);
  copy(Layout::kLight, model_.offset);
  copy(Layout::kLight + 3, model_.contrast);
  for (size_t k = 0; k < 4; ++k)
    model_.tag_by_pixel[k] = static_cast<float>(
        tag_by_pixel_(static_cast<Eigen::Index>(k / 2), static_cast<Eigen::Index>(k % 2)));
  model_.grid = blurred_->grid();
  evaluate_rows(model_, *samples_, rows_);
  model_.grid = {};
  weigh();
}

/// Returns by how much steps near the solution are too short (farther off they are not) because
/// robust weights depend on the residuals: the mean weight over the mean slope of Cauchy's
/// influence.
double TagFit::stretch() const {
  const double weight = robust().mean();
  return weight > kExplained ? weight / (2 * robust().square() - robust()).mean() : 1;
}

/// Adds one Gauss-Newton step to the unknowns. Returns its length in standard deviations per
/// unknown; not finite when there is no step.
double TagFit::step() {
  NormalEquations equations = normal_equations(*samples_, rows_);
  equations.information.diagonal() += prior_;
  const Unknowns gradient = equations.gradient - prior_.cwiseProduct(unknowns_ - prior_mean_);
  solver_.compute(equations.information);
  const Unknowns change = solver_.solve(gradient);
  const double length = std::sqrt(change.dot(gradient) / TagUnknowns::kCount);
  unknowns_ += (length < kNearSolution ? stretch() : 1) * change;
  return length;
}

}  // namespace clothfit
