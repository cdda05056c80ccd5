#include "vision/detect/dot_refine.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <vector>

#include "data/median.h"

namespace clothfit {
namespace {

// Unknowns: centre; the symmetric matrix B with q = B (p - c); the blur's variance as mean, half
// the difference of x and y, and mixed; contrast; light.
constexpr int kDotCentre = 0;
constexpr int kDotInverse = 2;
constexpr int kDotBlur = 5;
constexpr int kDotContrast = 8;
constexpr int kDotLight = 9;
constexpr int kDotUnknowns = 12;

constexpr int kMostPixels = 700;

using DotUnknowns = Eigen::Matrix<double, kDotUnknowns, 1>;
using DotNormal = Eigen::Matrix<double, kDotUnknowns, kDotUnknowns>;
using PixelValues = Eigen::Array<float, Eigen::Dynamic, 1, 0, kMostPixels, 1>;
using PixelRows = Eigen::Array<float, Eigen::Dynamic, kDotUnknowns, 0, kMostPixels, kDotUnknowns>;

/// The pixels around a dot. Places count from `origin_px` in units of `scale_px`.
struct DotWindow {
  Eigen::Vector2d origin_px = Eigen::Vector2d::Zero();
  PixelValues x, y, grey;  ///< px from the origin; grey levels
  bool cut_by_border = false;

  Eigen::Index size() const { return x.size(); }
};

/// The model's values at the pixels of a window.
struct DotModel {
  DotUnknowns unknowns = DotUnknowns::Zero();
  PixelRows jacobian;
  PixelValues residual;  ///< grey levels
  PixelValues slope;     ///< of the model, grey levels per px
  PixelValues weight;    ///< inverse variance times robust weight
  double noise_levels = 0;
  double explained = 0;
};

Eigen::Matrix2d inverse_map(const DotUnknowns& unknowns) {
  Eigen::Matrix2d map;
  map << unknowns[kDotInverse], unknowns[kDotInverse + 1], unknowns[kDotInverse + 1],
      unknowns[kDotInverse + 2];
  return map;
}

/// Returns the blur's covariance.
Eigen::Matrix2d blur_px2(const DotUnknowns& unknowns) {
  const double mean = unknowns[kDotBlur], difference = unknowns[kDotBlur + 1];
  Eigen::Matrix2d blur;
  blur << mean + difference, unknowns[kDotBlur + 2], unknowns[kDotBlur + 2], mean - difference;
  return blur;
}

/// Keeps the blur's smallest variance above what a pixel's area alone makes.
void keep_blur_positive(DotUnknowns& unknowns) {
  constexpr double kSharpest = 0.07;  // px^2
  double& mean = unknowns[kDotBlur];
  mean = std::max(mean, 1.5 * kSharpest);
  const double apart = unknowns.segment<2>(kDotBlur + 1).norm();
  const double most = mean - kSharpest;
  if (apart > most) unknowns.segment<2>(kDotBlur + 1) *= most / apart;
}

/// Returns the symmetric B with B^-2 = shape; the root of a 2 x 2 matrix in closed form.
Eigen::Matrix2d inverse_root(const Eigen::Matrix2d& shape_px2) {
  const double root = std::sqrt(std::max(shape_px2.determinant(), 1e-12));
  const Eigen::Matrix2d a =
      (shape_px2 + root * Eigen::Matrix2d::Identity()) / std::sqrt(shape_px2.trace() + 2 * root);
  return a.inverse();
}

/// Gathers the pixels within `beyond_px` of the outline, and no further out than `kReach` times it:
/// what lies beyond is other print, or the sheet's edge.
DotWindow gather_pixels(const cv::Mat& grey, const DotOutline& outline, double blur_px) {
  constexpr double kReach = 1.8;
  const double beyond_px = 1.5 + 1.5 * blur_px;
  const Eigen::Matrix2d inverse = inverse_root(outline.shape_px2);
  const Eigen::Vector2d half =
      outline.shape_px2.diagonal().cwiseSqrt() + Eigen::Vector2d::Constant(beyond_px);
  DotWindow window;
  window.origin_px = outline.centre_px.array().round().matrix();
  const int left = static_cast<int>(std::ceil(outline.centre_px.x() - half.x()));
  const int right = static_cast<int>(std::floor(outline.centre_px.x() + half.x()));
  const int top = static_cast<int>(std::ceil(outline.centre_px.y() - half.y()));
  const int bottom = static_cast<int>(std::floor(outline.centre_px.y() + half.y()));
  const Eigen::Vector2d radii =
      outline.shape_px2.diagonal().cwiseSqrt() + Eigen::Vector2d::Constant(0.5);
  window.cut_by_border = outline.centre_px.x() - radii.x() < 0 ||
                         outline.centre_px.y() - radii.y() < 0 ||
                         outline.centre_px.x() + radii.x() > grey.cols - 1 ||
                         outline.centre_px.y() + radii.y() > grey.rows - 1;
  const double box = static_cast<double>(right - left + 1) * (bottom - top + 1);
  const int stride = std::max(1, static_cast<int>(std::ceil(std::sqrt(box / kMostPixels))));
  window.x.resize(kMostPixels);
  window.y.resize(kMostPixels);
  window.grey.resize(kMostPixels);
  Eigen::Index count = 0;
  for (int v = std::max(top, 0); v <= std::min(bottom, grey.rows - 1); v += stride) {
    const std::uint8_t* row = grey.ptr<std::uint8_t>(v);
    for (int u = std::max(left, 0); u <= std::min(right, grey.cols - 1); u += stride) {
      const Eigen::Vector2d q = inverse * (Eigen::Vector2d(u, v) - outline.centre_px);
      const double radius = q.norm();
      const double distance_px = (radius - 1) * radius / std::max((inverse * q).norm(), 1e-9);
      if (radius > 1 && (distance_px > beyond_px || radius > kReach)) continue;
      window.x[count] = static_cast<float>(u - window.origin_px.x());
      window.y[count] = static_cast<float>(v - window.origin_px.y());
      window.grey[count] = row[u];
      if (++count == kMostPixels) break;
    }
    if (count == kMostPixels) break;
  }
  window.x.conservativeResize(count);
  window.y.conservativeResize(count);
  window.grey.conservativeResize(count);
  return window;
}

/// Sets residuals, slopes and derivatives. The derivative of d by A leaves out how |grad |q||
/// changes, which vanishes on the outline; c is not affected, as the rest is even about it.
void evaluate_dot(const DotWindow& window, double light_scale_px, DotModel& model) {
  const DotUnknowns& now = model.unknowns;
  const Eigen::Matrix2f b = inverse_map(now).cast<float>();
  const Eigen::Matrix2f spread = blur_px2(now).cast<float>();
  const auto contrast = static_cast<float>(now[kDotContrast]);
  const PixelValues dx = window.x - static_cast<float>(now[kDotCentre]);
  const PixelValues dy = window.y - static_cast<float>(now[kDotCentre + 1]);
  const PixelValues qx = b(0, 0) * dx + b(0, 1) * dy;
  const PixelValues qy = b(0, 1) * dx + b(1, 1) * dy;
  const PixelValues square = (qx.square() + qy.square()).max(1e-8F);
  const PixelValues inverse_length = square.rsqrt();
  const PixelValues ex = qx * inverse_length, ey = qy * inverse_length;
  PixelValues nx = b(0, 0) * ex + b(0, 1) * ey, ny = b(0, 1) * ex + b(1, 1) * ey;
  // A pixel right on the centre has no direction; whatever it gets is inside.
  const PixelValues inverse_gradient = (nx.square() + ny.square()).max(1e-10F).rsqrt();
  nx *= inverse_gradient;
  ny *= inverse_gradient;
  // The blur across the normal in units of q; for a circle that of q itself.
  const float across = 0.5F * (b * spread * b).trace();
  const PixelValues inverse_blur =
      (spread(0, 0) * nx.square() + 2 * spread(0, 1) * nx * ny + spread(1, 1) * ny.square())
          .max(1e-4F)
          .rsqrt();
  const PixelValues radius = (square + across).sqrt();
  const PixelValues distance = (radius - 1) * inverse_gradient * inverse_blur;  // in blurs
  // Phi and its density by one exponential [abramowitz1964, 7.1.26]; errors below 1e-6.
  const PixelValues density = (-0.5F * distance.square()).exp();
  const PixelValues z = distance.abs() * static_cast<float>(M_SQRT1_2);
  const PixelValues t = (1 + 0.3275911F * z).inverse();
  const PixelValues tail =
      0.5F * density * t *
      (0.254829592F +
       t * (-0.284496736F + t * (1.421413741F + t * (-1.453152027F + t * 1.061405429F))));
  const PixelValues inside = (distance > 0).select(tail, 1 - tail);
  const PixelValues lx = window.x / static_cast<float>(light_scale_px);
  const PixelValues ly = window.y / static_cast<float>(light_scale_px);
  const PixelValues light = static_cast<float>(now[kDotLight]) +
                            static_cast<float>(now[kDotLight + 1]) * lx +
                            static_cast<float>(now[kDotLight + 2]) * ly;
  const PixelValues left = 1 - contrast * inside;
  model.residual = window.grey - light * left;
  // d grey / d distance_px
  const PixelValues steepness =
      contrast * light * density * inverse_blur * static_cast<float>(0.5 * M_2_SQRTPI * M_SQRT1_2);
  model.slope = steepness.abs();
  const PixelValues pull = radius.inverse() / inverse_length;  // |q| / sqrt(|q|^2 + t^2)
  const PixelValues by_square = steepness * pull * inverse_gradient;
  PixelRows& jacobian = model.jacobian;
  jacobian.resize(window.size(), kDotUnknowns);
  jacobian.col(kDotCentre) = -steepness * pull * nx;
  jacobian.col(kDotCentre + 1) = -steepness * pull * ny;
  jacobian.col(kDotInverse) = by_square * ex * dx;
  jacobian.col(kDotInverse + 1) = by_square * (ex * dy + ey * dx);
  jacobian.col(kDotInverse + 2) = by_square * ey * dy;
  const PixelValues by_variance = -0.5F * steepness * distance * inverse_blur;
  jacobian.col(kDotBlur) = by_variance;
  jacobian.col(kDotBlur + 1) = by_variance * (nx.square() - ny.square());
  jacobian.col(kDotBlur + 2) = 2 * by_variance * nx * ny;
  jacobian.col(kDotContrast) = -light * inside;
  jacobian.col(kDotLight) = left;
  jacobian.col(kDotLight + 1) = left * lx;
  jacobian.col(kDotLight + 2) = left * ly;
}

float square_of(float x) {
  return x * x;
}

float middle_of(std::vector<float>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Weighs the residuals as vision/detect/tag_refine.cpp does: variance = noise^2 + (roughness *
/// slope)^2, both from medians, and a Cauchy loss on top.
void weigh_dot(DotModel& model, std::vector<float>& flat, std::vector<float>& rough) {
  const float steepest = model.slope.maxCoeff();
  flat.clear();
  rough.clear();
  float square_slopes = 0;
  for (Eigen::Index i = 0; i < model.residual.size(); ++i) {
    if (model.slope[i] < 0.1F * steepest) flat.push_back(std::abs(model.residual[i]));
    if (model.slope[i] > 0.4F * steepest) {
      rough.push_back(std::abs(model.residual[i]) / model.slope[i]);
      square_slopes += 1 / square_of(model.slope[i]);
    }
  }
  constexpr float kRounding = 0.3F;  // grey levels; what 8 bits leave
  constexpr auto kSigma = static_cast<float>(kMadToSigma);
  const float noise = std::max(flat.empty() ? 0 : kSigma * middle_of(flat), kRounding);
  float square_roughness = 0;
  if (!rough.empty())
    square_roughness =
        std::max(0.0F, square_of(kSigma * middle_of(rough)) -
                           square_of(noise) * square_slopes / static_cast<float>(rough.size()));
  constexpr float kCauchy = 3;
  const PixelValues variance = square_of(noise) + square_roughness * model.slope.square();
  const PixelValues robust =
      (1 + model.residual.square() / (square_of(kCauchy) * variance)).inverse();
  model.weight = robust / variance;
  model.noise_levels = noise;
  model.explained = robust.mean();
}

/// Independent normal priors. They are wide, and keep the fit near its start where the picture says
/// nothing; the centre of a clean dot is shifted by some 1e-5 px.
struct DotPrior {
  DotUnknowns mean;
  DotUnknowns precision;  ///< 1 / sd^2
};

DotPrior prior_about(const DotUnknowns& start) {
  const double inverse = inverse_map(start).norm() * M_SQRT1_2;  // of the radius
  const double paper = start[kDotLight];
  DotUnknowns sd;
  sd.segment<2>(kDotCentre).setConstant(1 / inverse);
  sd.segment<3>(kDotInverse).setConstant(0.5 * inverse);
  sd[kDotBlur] = 3;                              // px^2
  sd.segment<2>(kDotBlur + 1).setConstant(1.5);  // px^2
  sd[kDotContrast] = 0.3 * (1 + std::abs(start[kDotContrast]));
  sd.segment<3>(kDotLight).setConstant(0.5 * paper);
  DotPrior prior{.mean = start, .precision = sd.cwiseAbs2().cwiseInverse()};
  constexpr double kUsualBlur = 0.6;  // px^2
  prior.mean[kDotBlur] = kUsualBlur;
  prior.mean.segment<2>(kDotBlur + 1).setZero();
  prior.mean.segment<2>(kDotLight + 1).setZero();
  return prior;
}

/// How far a step went.
struct DotStep {
  double centre_px = std::numeric_limits<double>::infinity();
  double centre_sigma_px = 0;
  double shape = std::numeric_limits<double>::infinity();  ///< relative change of outline and blur

  /// Says whether the outline is near enough for its window to be gathered.
  bool near() const { return shape < 0.2; }
  bool settled() const {
    return centre_px < std::max(0.15 * centre_sigma_px, 0.001) && shape < 0.03;
  }
};

/// Adds one step to the unknowns, shortened where it goes beyond what is nearly linear.
DotStep take_step(const DotPrior& prior, DotModel& model, DotNormal& covariance) {
  const PixelValues root = model.weight.sqrt();
  const PixelRows whitened = model.jacobian.colwise() * root;
  const auto rows = whitened.matrix();
  DotNormal information = rows.transpose().lazyProduct(rows).eval().cast<double>() +
                          DotNormal(prior.precision.asDiagonal());
  const DotUnknowns gradient =
      (rows.transpose() * (root * model.residual).matrix()).cast<double>() -
      prior.precision.cwiseProduct(model.unknowns - prior.mean);
  const Eigen::LDLT<DotNormal> solver(information);
  DotUnknowns change = solver.solve(gradient);
  covariance = solver.solve(DotNormal::Identity());
  const Eigen::Matrix2d b = inverse_map(model.unknowns);
  Eigen::Matrix2d db;
  db << change[kDotInverse], change[kDotInverse + 1], change[kDotInverse + 1],
      change[kDotInverse + 2];
  const double shape = (db * b.inverse()).norm();
  const double blur =
      change.segment<3>(kDotBlur).cwiseAbs().maxCoeff() / (0.2 + model.unknowns[kDotBlur]);
  const double far =
      std::max({(b * change.segment<2>(kDotCentre)).norm() / 0.5, shape / 0.4, blur / 1.0});
  if (far > 1) change /= far;
  model.unknowns += change;
  keep_blur_positive(model.unknowns);
  return {.centre_px = change.segment<2>(kDotCentre).norm(),
          .centre_sigma_px = std::sqrt(covariance.topLeftCorner<2, 2>().trace() / 2),
          .shape = std::max(shape, 0.5 * blur)};
}

/// Measures the outline's deviation from an ellipse by its waves with 3, 4 and 5 periods around.
void measure_waves(const DotWindow& window, const DotModel& model, Dot& dot) {
  const Eigen::Matrix2f b = inverse_map(model.unknowns).cast<float>();
  const PixelValues dx = window.x - static_cast<float>(model.unknowns[kDotCentre]);
  const PixelValues dy = window.y - static_cast<float>(model.unknowns[kDotCentre + 1]);
  const PixelValues qx = b(0, 0) * dx + b(0, 1) * dy, qy = b(0, 1) * dx + b(1, 1) * dy;
  const PixelValues inverse_length = (qx.square() + qy.square()).max(1e-8F).rsqrt();
  const PixelValues cosine = qx * inverse_length, sine = qy * inverse_length;
  const PixelValues score = model.weight * model.residual * model.slope;
  const PixelValues information = model.weight * model.slope.square();
  const PixelValues plain_score = model.residual * model.slope;
  const PixelValues plain_information = model.slope.square();
  PixelValues c = cosine, s = sine;  // of k times the angle
  float squares = 0;
  dot.waves_chi2.fill(0);
  constexpr int kFewestWaves = 3, kMostWaves = 5;
  for (int k = 2; k <= kMostWaves; ++k) {
    const PixelValues next = c * cosine - s * sine;
    s = s * cosine + c * sine;
    c = next;
    if (k < kFewestWaves) continue;
    for (const PixelValues* wave : {&c, &s}) {
      const PixelValues square = wave->square();
      // Weights would spare the very pixels that tell a cut dot.
      squares += square_of((plain_score * *wave).sum() / (plain_information * square).sum());
      dot.waves_chi2[static_cast<size_t>(k - kFewestWaves)] += static_cast<double>(
          0.5F * square_of((score * *wave).sum()) / (information * square).sum());
    }
  }
  dot.waves_px = std::sqrt(static_cast<double>(squares));
}

}  // namespace

Eigen::Vector2d DotOutline::radii_px() const {
  const double mean = 0.5 * shape_px2.trace();
  const double half = std::sqrt(std::max(mean * mean - shape_px2.determinant(), 0.0));
  return {std::sqrt(std::max(mean - half, 0.0)), std::sqrt(mean + half)};
}

double DotOutline::area_px2() const {
  return M_PI * std::sqrt(std::max(shape_px2.determinant(), 0.0));
}

double Dot::sigma_px() const {
  return std::sqrt(covariance_px2.trace() / 2);
}

Dot refine_dot(const cv::Mat& grey, const DotStart& start) {
  assert(grey.type() == CV_8UC1);
  Dot dot;
  dot.outline = start.outline;
  dot.blur_px = start.blur_px;
  DotWindow window = gather_pixels(grey, start.outline, start.blur_px);
  constexpr Eigen::Index kFewest = 3 * kDotUnknowns;
  if (window.size() < kFewest) {
    dot.doubt = window.cut_by_border ? DotDoubt::border : DotDoubt::unsettled;
    return dot;
  }

  DotModel model;
  const double scale_px = std::sqrt(start.outline.shape_px2.trace());
  const auto put_outline = [&](const DotOutline& outline) {
    model.unknowns.segment<2>(kDotCentre) = outline.centre_px - window.origin_px;
    const Eigen::Matrix2d b = inverse_root(outline.shape_px2);
    model.unknowns[kDotInverse] = b(0, 0);
    model.unknowns[kDotInverse + 1] = b(0, 1);
    model.unknowns[kDotInverse + 2] = b(1, 1);
  };
  put_outline(start.outline);
  model.unknowns[kDotBlur] = start.blur_px * start.blur_px;
  const double darkest = window.grey.minCoeff(), brightest = window.grey.maxCoeff();
  const Eigen::Vector2d middle = start.outline.centre_px;
  const int mu = std::clamp(static_cast<int>(std::lround(middle.x())), 0, grey.cols - 1);
  const int mv = std::clamp(static_cast<int>(std::lround(middle.y())), 0, grey.rows - 1);
  const bool bright = grey.at<std::uint8_t>(mv, mu) > 0.5 * (darkest + brightest);
  const double paper = std::max(bright ? darkest : brightest, 1.0);
  model.unknowns[kDotLight] = paper;
  model.unknowns[kDotContrast] = 1 - (bright ? brightest : darkest) / paper;

  DotPrior prior = prior_about(model.unknowns);

  constexpr int kMaxSteps = 14;
  DotNormal covariance;
  DotStep moved;
  std::vector<float> flat, rough;
  int steps = 0;
  bool regathered = false;
  for (; steps < kMaxSteps && !(moved.settled() && regathered); ++steps) {
    if (moved.near() && !regathered) {
      // The window follows the outline once.
      DotOutline outline;
      const Eigen::Matrix2d a = inverse_map(model.unknowns).inverse();
      outline.shape_px2 = a * a.transpose();
      const Eigen::Vector2d centre = model.unknowns.segment<2>(kDotCentre);
      outline.centre_px = window.origin_px + centre;
      const Eigen::Vector2d origin = window.origin_px;
      window = gather_pixels(grey, outline, std::sqrt(model.unknowns[kDotBlur]));
      if (window.size() < kFewest) return dot;
      const Eigen::Vector2d shift = window.origin_px - origin;
      model.unknowns.segment<2>(kDotCentre) -= shift;
      prior.mean.segment<2>(kDotCentre) -= shift;
      model.unknowns[kDotLight] += shift.dot(model.unknowns.segment<2>(kDotLight + 1)) / scale_px;
      regathered = true;
    }
    evaluate_dot(window, scale_px, model);
    weigh_dot(model, flat, rough);
    moved = take_step(prior, model, covariance);
    constexpr double kNoDot = 100;  // px^2
    if (!model.unknowns.allFinite() || model.unknowns[kDotBlur] > kNoDot ||
        inverse_map(model.unknowns).determinant() <= 0)
      return dot;
  }

  const Eigen::Matrix2d a = inverse_map(model.unknowns).inverse();
  dot.outline.shape_px2 = a * a.transpose();
  dot.outline.centre_px = window.origin_px + model.unknowns.segment<2>(kDotCentre);
  // Blurring light that varies times a disc moves the disc by the variance times the light's
  // relative slope.
  dot.outline.centre_px += blur_px2(model.unknowns) * model.unknowns.segment<2>(kDotLight + 1) /
                           (scale_px * model.unknowns[kDotLight]);
  dot.blur_px2 = blur_px2(model.unknowns);
  dot.blur_px = std::sqrt(model.unknowns[kDotBlur]);
  dot.paper_levels = model.unknowns[kDotLight];
  dot.contrast = model.unknowns[kDotContrast];
  dot.explained = model.explained;
  dot.noise_levels = model.noise_levels;
  dot.covariance_px2 = covariance.topLeftCorner<2, 2>();
  const double step_levels = std::abs(dot.contrast * dot.paper_levels);
  dot.misfit = std::sqrt(static_cast<double>(model.residual.square().mean())) / step_levels;
  measure_waves(window, model, dot);
  dot.steps = steps;
  if (moved.settled())
    dot.doubt = DotDoubt::none;
  else if (window.cut_by_border)
    dot.doubt = DotDoubt::border;
  return dot;
}

}  // namespace clothfit
