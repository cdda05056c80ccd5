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
  float noise_levels = 0;
  float square_roughness = 0;  ///< px^2
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

/// Estimates the noise from medians over the dot's pixels: of flat ones, and of steep ones by
/// slope.
void estimate_noise(DotModel& model) {
  const float steepest = model.slope.maxCoeff();
  std::vector<float> flat, rough;
  flat.reserve(static_cast<size_t>(model.residual.size()));
  rough.reserve(flat.capacity());
  float square_slopes = 0;
  for (Eigen::Index i = 0; i < model.residual.size(); ++i) {
    const float slope = model.slope[i];
    if (slope < 0.1F * steepest) flat.push_back(std::abs(model.residual[i]));
    if (slope > 0.4F * steepest) {
      rough.push_back(std::abs(model.residual[i]) / slope);
      square_slopes += 1 / square_of(slope);
    }
  }
  constexpr float kRounding = 0.3F;  // grey levels; what 8 bits leave
  constexpr auto kSigma = static_cast<float>(kMadToSigma);
  model.noise_levels = std::max(flat.empty() ? 0 : kSigma * middle_of(flat), kRounding);
  model.square_roughness = 0;
  if (!rough.empty())
    model.square_roughness = std::max(
        0.0F, square_of(kSigma * middle_of(rough)) -
                  square_of(model.noise_levels) * square_slopes / static_cast<float>(rough.size()));
}

/// Weighs the residuals as vision/detect/tag_refine.cpp does: variance = noise^2 + (roughness *
/// slope)^2, and a Cauchy loss on top.
void weigh_dot(DotModel& model) {
  constexpr float kCauchy = 3;
  const PixelValues variance =
      square_of(model.noise_levels) + model.square_roughness * model.slope.square();
  const PixelValues robust =
      (1 + model.residual.square() / (square_of(kCauchy) * variance)).inverse();
  model.weight = robust / variance;
  model.explained = static_cast<double>(robust.mean());
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
  /// Says whether the steps to come do not change the noise.
  bool near_end() const { return centre_px < centre_sigma_px && shape < 0.02; }
  bool settled() const {
    return centre_px < std::max(0.15 * centre_sigma_px, 0.001) && shape < 0.03;
  }
};

/// Returns J^T W J and the prior's precision.
DotNormal information_of(const PixelRows& whitened, const DotPrior& prior) {
  DotNormal information = prior.precision.asDiagonal();
  for (int i = 0; i < kDotUnknowns; ++i)
    for (int j = 0; j <= i; ++j)
      information(i, j) += static_cast<double>((whitened.col(i) * whitened.col(j)).sum());
  return information;
}

/// Adds one step to the unknowns, shortened where it goes beyond what is nearly linear. Sets the
/// covariance of the centre.
DotStep take_step(const DotPrior& prior, DotModel& model, Eigen::Matrix2d& covariance) {
  const PixelValues root = model.weight.sqrt();
  const PixelRows whitened = model.jacobian.colwise() * root;
  const PixelValues whitened_residual = root * model.residual;
  DotUnknowns gradient = -prior.precision.cwiseProduct(model.unknowns - prior.mean);
  for (int i = 0; i < kDotUnknowns; ++i)
    gradient[i] += static_cast<double>((whitened.col(i) * whitened_residual).sum());
  const Eigen::LLT<DotNormal> solver(information_of(whitened, prior));
  DotUnknowns change = solver.solve(gradient);
  // The centre comes first among the unknowns.
  static_assert(kDotCentre == 0);
  const Eigen::Matrix<double, kDotUnknowns, 2> ends =
      solver.matrixL().solve(Eigen::Matrix<double, kDotUnknowns, 2>::Identity());
  covariance = ends.transpose() * ends;
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
          .centre_sigma_px = std::sqrt(covariance.trace() / 2),
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

constexpr Eigen::Index kFewestPixels = 3 * kDotUnknowns;

/// Everything that changes while a dot is fitted.
struct DotFit {
  DotWindow window;
  double light_scale_px = 1;
  DotModel model{};
  DotPrior prior{};
  DotStep moved{};
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Zero();
  int steps = 0;
};

/// Starts from the outline, a round blur, and light from the extremes.
DotUnknowns start_unknowns(const DotWindow& window, const DotStart& start) {
  DotUnknowns unknowns = DotUnknowns::Zero();
  const Eigen::Vector2d centre = start.outline.centre_px - window.origin_px;
  unknowns.segment<2>(kDotCentre) = centre;
  const Eigen::Matrix2d b = inverse_root(start.outline.shape_px2);
  unknowns.segment<3>(kDotInverse) << b(0, 0), b(0, 1), b(1, 1);
  unknowns[kDotBlur] = start.blur_px * start.blur_px;
  const double darkest = static_cast<double>(window.grey.minCoeff());
  const double brightest = static_cast<double>(window.grey.maxCoeff());
  Eigen::Index middle = 0;
  ((window.x - static_cast<float>(centre.x())).square() +
   (window.y - static_cast<float>(centre.y())).square())
      .minCoeff(&middle);
  const bool bright = static_cast<double>(window.grey[middle]) > 0.5 * (darkest + brightest);
  const double paper = std::max(bright ? darkest : brightest, 1.0);
  unknowns[kDotLight] = paper;
  unknowns[kDotContrast] = 1 - (bright ? brightest : darkest) / paper;
  return unknowns;
}

DotOutline outline_of(const DotFit& fit) {
  const Eigen::Matrix2d a = inverse_map(fit.model.unknowns).inverse();
  const Eigen::Vector2d centre = fit.model.unknowns.segment<2>(kDotCentre);
  return {.centre_px = fit.window.origin_px + centre, .shape_px2 = a * a.transpose()};
}

/// Lets the window follow the outline.
void regather(const cv::Mat& grey, DotFit& fit) {
  DotUnknowns& unknowns = fit.model.unknowns;
  const Eigen::Vector2d origin = fit.window.origin_px;
  fit.window = gather_pixels(grey, outline_of(fit), std::sqrt(unknowns[kDotBlur]));
  const Eigen::Vector2d shift = fit.window.origin_px - origin;
  unknowns.segment<2>(kDotCentre) -= shift;
  fit.prior.mean.segment<2>(kDotCentre) -= shift;
  unknowns[kDotLight] += shift.dot(unknowns.segment<2>(kDotLight + 1)) / fit.light_scale_px;
}

/// Puts the fit's result into words of the picture.
void describe(const DotFit& fit, Dot& dot) {
  const DotUnknowns& unknowns = fit.model.unknowns;
  dot.outline = outline_of(fit);
  dot.blur_px2 = blur_px2(unknowns);
  // Blurring light that varies times a disc moves the disc by the variance times the light's
  // relative slope.
  dot.outline.centre_px += dot.blur_px2 * unknowns.segment<2>(kDotLight + 1) /
                           (fit.light_scale_px * unknowns[kDotLight]);
  dot.blur_px = std::sqrt(unknowns[kDotBlur]);
  dot.paper_levels = unknowns[kDotLight];
  dot.contrast = unknowns[kDotContrast];
  dot.explained = fit.model.explained;
  dot.noise_levels = static_cast<double>(fit.model.noise_levels);
  dot.covariance_px2 = fit.covariance_px2;
  const double step_levels = std::abs(dot.contrast * dot.paper_levels);
  dot.misfit = std::sqrt(static_cast<double>(fit.model.residual.square().mean())) / step_levels;
  measure_waves(fit.window, fit.model, dot);
  dot.steps = fit.steps;
  if (fit.moved.settled())
    dot.doubt = DotDoubt::none;
  else if (fit.window.cut_by_border)
    dot.doubt = DotDoubt::border;
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
  DotFit fit{.window = gather_pixels(grey, start.outline, start.blur_px),
             .light_scale_px = std::sqrt(start.outline.shape_px2.trace())};
  if (fit.window.size() < kFewestPixels) {
    if (fit.window.cut_by_border) dot.doubt = DotDoubt::border;
    return dot;
  }
  fit.model.unknowns = start_unknowns(fit.window, start);
  fit.prior = prior_about(fit.model.unknowns);

  constexpr int kMaxSteps = 14;
  bool regathered = false;
  for (; fit.steps < kMaxSteps && !(fit.moved.settled() && regathered); ++fit.steps) {
    if (fit.moved.near() && !regathered) {
      regather(grey, fit);
      regathered = true;
      if (fit.window.size() < kFewestPixels) return dot;
    }
    evaluate_dot(fit.window, fit.light_scale_px, fit.model);
    if (!fit.moved.near_end()) estimate_noise(fit.model);
    weigh_dot(fit.model);
    fit.moved = take_step(fit.prior, fit.model, fit.covariance_px2);
    constexpr double kNoDot = 100;  // px^2
    if (!fit.model.unknowns.allFinite() || fit.model.unknowns[kDotBlur] > kNoDot ||
        inverse_map(fit.model.unknowns).determinant() <= 0)
      return dot;
  }
  describe(fit, dot);
  return dot;
}

}  // namespace clothfit
