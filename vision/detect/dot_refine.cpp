#include "vision/detect/dot_refine.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "data/median.h"
#include "vision/detect/dot_kernels.h"

namespace clothfit {
namespace {

// Unknowns: centre; the symmetric matrix B with q = B (p - c); the blur's variance as mean, half
// the difference of x and y, and mixed; contrast; light.
constexpr int kDotCentre = 0;
constexpr int kDotInverse = 2;
constexpr int kDotBlur = 5;
constexpr int kDotContrast = 8;
constexpr int kDotLight = 9;
static_assert(kDotLight + 3 == kDotUnknowns);

using DotUnknowns = Eigen::Matrix<double, kDotUnknowns, 1>;

/// The pixels around a dot. Places count from `origin_px`.
struct DotWindow {
  Eigen::Vector2d origin_px = Eigen::Vector2d::Zero();
  DotPixels pixels;
  bool cut_by_border = false;
};

/// The model and its values at the pixels of a window.
struct DotModel {
  DotUnknowns unknowns = DotUnknowns::Zero();
  DotRows rows;
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

/// Returns the three different entries of a symmetric matrix: xx, xy, yy.
std::array<float, 3> upper_of(const Eigen::Matrix2d& symmetric) {
  return {static_cast<float>(symmetric(0, 0)), static_cast<float>(symmetric(0, 1)),
          static_cast<float>(symmetric(1, 1))};
}

/// A box of pixels, both ends included, cut by the picture's border.
struct PictureBox {
  int left = 0, right = -1, top = 0, bottom = -1;

  PictureBox(const cv::Mat& grey, const Eigen::Vector2d& low, const Eigen::Vector2d& high)
      : left(std::max(static_cast<int>(std::ceil(low.x())), 0)),
        right(std::min(static_cast<int>(std::floor(high.x())), grey.cols - 1)),
        top(std::max(static_cast<int>(std::ceil(low.y())), 0)),
        bottom(std::min(static_cast<int>(std::floor(high.y())), grey.rows - 1)) {}

  bool empty() const { return left > right || top > bottom; }
  /// The stride at which a row has kMostDotPixels at most.
  int least_stride() const { return 1 + (right - left) / kMostDotPixels; }

  /// Every `stride`-th pixel; places count from `origin_px`.
  PixelBox pixels(const cv::Mat& grey, int stride, const Eigen::Vector2d& origin_px) const {
    return {.first = grey.ptr<std::uint8_t>(top) + left,
            .row_bytes = stride * static_cast<std::ptrdiff_t>(grey.step[0]),
            .stride = stride,
            .columns = (right - left) / stride + 1,
            .rows = (bottom - top) / stride + 1,
            .left = static_cast<float>(left - origin_px.x()),
            .top = static_cast<float>(top - origin_px.y())};
  }
};

/// Gathers the pixels within `beyond_px` of the outline, and no further out than `kReach` times it:
/// what lies beyond is other print, or the sheet's edge.
void gather_pixels(const cv::Mat& grey, const DotOutline& outline, double blur_px,
                   DotWindow& window) {
  constexpr double kReach = 1.8;
  const double beyond_px = 1.5 + 1.5 * blur_px;
  const Eigen::Vector2d& centre = outline.centre_px;
  const Eigen::Vector2d radii = outline.shape_px2.diagonal().cwiseSqrt();
  const Eigen::Vector2d half = radii + Eigen::Vector2d::Constant(beyond_px);
  window.origin_px = centre.array().round().matrix();
  const Eigen::Vector2d low = centre - half, high = centre + half;
  const Eigen::Vector2d edge = radii + Eigen::Vector2d::Constant(0.5);
  window.cut_by_border = centre.x() - edge.x() < 0 || centre.y() - edge.y() < 0 ||
                         centre.x() + edge.x() > grey.cols - 1 ||
                         centre.y() + edge.y() > grey.rows - 1;
  window.pixels.count = 0;
  const PictureBox box(grey, low, high);
  if (box.empty()) return;
  const double whole = (std::floor(high.x()) - std::ceil(low.x()) + 1) *
                       (std::floor(high.y()) - std::ceil(low.y()) + 1);
  const int stride =
      std::max(box.least_stride(), static_cast<int>(std::ceil(std::sqrt(whole / kMostDotPixels))));
  const Eigen::Vector2d from_origin = centre - window.origin_px;
  gather_dot(box.pixels(grey, stride, window.origin_px),
             {.x = static_cast<float>(from_origin.x()),
              .y = static_cast<float>(from_origin.y()),
              .inverse = upper_of(inverse_root(outline.shape_px2)),
              .beyond_px = static_cast<float>(beyond_px),
              .ratio = static_cast<float>(kReach)},
             window.pixels);
}

DotShape shape_of(const DotUnknowns& unknowns, double light_scale_px) {
  const Eigen::Matrix2d b = inverse_map(unknowns), spread = blur_px2(unknowns);
  const auto single = [&](int k) { return static_cast<float>(unknowns[k]); };
  return {.x = single(kDotCentre),
          .y = single(kDotCentre + 1),
          .inverse = upper_of(b),
          .blur = upper_of(spread),
          .across = static_cast<float>(0.5 * (b * spread * b).trace()),
          .contrast = single(kDotContrast),
          .light = {single(kDotLight), single(kDotLight + 1), single(kDotLight + 2)},
          .per_light_scale = static_cast<float>(1 / light_scale_px)};
}

float square_of(float x) {
  return x * x;
}

/// Estimates the noise from medians over the dot's pixels: of flat ones, and of steep ones by
/// slope.
void estimate_noise(const DotPixels& pixels, DotModel& model) {
  constexpr float kRounding = 0.3F;  // grey levels; what 8 bits leave
  constexpr auto kSigma = static_cast<float>(kMadToSigma);
  const DotResiduals residuals = dot_residuals(pixels, model.rows);
  model.noise_levels = std::max(kSigma * residuals.flat_levels, kRounding);
  model.square_roughness = 0;
  if (residuals.steep > 0)
    model.square_roughness =
        std::max(0.0F, square_of(kSigma * residuals.steep_px) -
                           square_of(model.noise_levels) * residuals.square_slopes /
                               static_cast<float>(residuals.steep));
}

/// Independent normal priors. They are wide, and keep the fit near its start where the picture says
/// nothing; the centre of a clean dot is shifted by some 1e-5 px.
struct DotPrior {
  DotUnknowns mean = DotUnknowns::Zero();
  DotUnknowns precision = DotUnknowns::Zero();  ///< 1 / sd^2
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

/// What a dot's normal equations say of its unknowns.
struct DotSolution {
  DotUnknowns change = DotUnknowns::Zero();
  Eigen::Matrix2d centre_covariance = Eigen::Matrix2d::Zero();
};

/// Solves normal equations. With L L' = information, the covariance of the centre is that of the
/// columns of L^-1 that belong to it.
DotSolution solve(const DotEquations& equations) {
  using Information = Eigen::Matrix<double, kDotUnknowns, kDotUnknowns, Eigen::RowMajor>;
  const Eigen::LLT<Information> solver(
      Eigen::Map<const Information>(equations.information.front().data()));
  Eigen::Matrix<double, kDotUnknowns, 2> centre =
      Eigen::Matrix<double, kDotUnknowns, 2>::Identity();
  solver.matrixL().solveInPlace(centre);
  return {.change = solver.solve(Eigen::Map<const DotUnknowns>(equations.gradient.data())),
          .centre_covariance = centre.transpose() * centre};
}

/// Weighs the residuals as vision/detect/tag_refine.cpp does: variance = noise^2 + (roughness *
/// slope)^2, and a Cauchy loss on top. Adds the prior.
DotEquations weighed_equations(const DotPixels& pixels, const DotPrior& prior, DotModel& model) {
  constexpr float kCauchy = 3;
  DotEquations equations = dot_equations(pixels,
                                         {.square_noise = square_of(model.noise_levels),
                                          .square_roughness = model.square_roughness,
                                          .square_loss = square_of(kCauchy)},
                                         model.rows);
  model.explained = equations.explained;
  const DotUnknowns pull = prior.precision.cwiseProduct(model.unknowns - prior.mean);
  for (size_t k = 0; k < kDotUnknowns; ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    equations.information[k][k] += prior.precision[at];
    equations.gradient[k] -= pull[at];
  }
  return equations;
}

/// Adds one step to the unknowns, shortened where it goes beyond what is nearly linear. Sets the
/// covariance of the centre.
DotStep take_step(const DotPixels& pixels, const DotPrior& prior, DotModel& model,
                  Eigen::Matrix2d& covariance) {
  // The centre comes first among the unknowns.
  static_assert(kDotCentre == 0);
  DotSolution solution = solve(weighed_equations(pixels, prior, model));
  DotUnknowns& change = solution.change;
  covariance = solution.centre_covariance;
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
void measure_waves(const DotWaves& waves, Dot& dot) {
  float squares = 0;
  dot.waves_chi2.fill(0);
  for (size_t k = 0; k < waves.waves.size(); ++k)
    for (const DotWaves::Wave& wave : waves.waves[k]) {
      // Weights would spare the very pixels that tell a cut dot.
      squares += square_of(wave.plain_score / wave.plain_information);
      dot.waves_chi2[k] += static_cast<double>(0.5F * square_of(wave.score) / wave.information);
    }
  dot.waves_px = std::sqrt(static_cast<double>(squares));
}

constexpr int kFewestPixels = 3 * kDotUnknowns;

/// Everything that changes while a dot is fitted.
struct DotFit {
  DotWindow window;
  double light_scale_px = 1;
  DotModel model;
  DotPrior prior;
  DotStep moved;
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Zero();
  int steps = 0;
};

/// Starts from the outline, a round blur, and light from the extremes.
DotUnknowns start_unknowns(const cv::Mat& grey, const DotWindow& window, const DotStart& start) {
  DotUnknowns unknowns = DotUnknowns::Zero();
  unknowns.segment<2>(kDotCentre) = start.outline.centre_px - window.origin_px;
  const Eigen::Matrix2d b = inverse_root(start.outline.shape_px2);
  unknowns.segment<3>(kDotInverse) << b(0, 0), b(0, 1), b(1, 1);
  unknowns[kDotBlur] = start.blur_px * start.blur_px;
  const auto darkest = static_cast<double>(window.pixels.darkest);
  const auto brightest = static_cast<double>(window.pixels.brightest);
  const int u = std::clamp(static_cast<int>(window.origin_px.x()), 0, grey.cols - 1);
  const int v = std::clamp(static_cast<int>(window.origin_px.y()), 0, grey.rows - 1);
  const bool bright = grey.at<std::uint8_t>(v, u) > 0.5 * (darkest + brightest);
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
  gather_pixels(grey, outline_of(fit), std::sqrt(unknowns[kDotBlur]), fit.window);
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
  const DotPixels& pixels = fit.window.pixels;
  const DotWaves waves = dot_waves(shape_of(unknowns, fit.light_scale_px), pixels, fit.model.rows);
  dot.misfit = std::sqrt(static_cast<double>(waves.square_residuals) / pixels.count) / step_levels;
  measure_waves(waves, dot);
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

void centre_on_dark(const cv::Mat& grey, double half_level, bool bright, DotOutline& outline) {
  constexpr double kReach = 1.5;  // radii; what is further away is something else
  const Eigen::Vector2d reach =
      kReach * outline.shape_px2.diagonal().cwiseSqrt() + Eigen::Vector2d::Ones();
  const Eigen::Matrix2d inverse = inverse_root(outline.shape_px2);
  const Eigen::Vector2d start = outline.centre_px;
  constexpr int kMostMoves = 5;
  constexpr double kStill_px = 0.3;
  for (int move = 0; move < kMostMoves; ++move) {
    const Eigen::Vector2d& centre = outline.centre_px;
    const PictureBox box(grey, centre - reach, centre + reach);
    if (box.empty()) return;
    const DarkSums sums =
        dark_sums(box.pixels(grey, box.least_stride(), centre),
                  {.inverse = upper_of(inverse), .ratio = static_cast<float>(kReach)},
                  static_cast<float>(half_level), bright);
    if (sums.weight <= 0) return;
    const Eigen::Vector2d moved =
        Eigen::Vector2d(sums.x, sums.y) / static_cast<double>(sums.weight);
    outline.centre_px += moved;
    if ((inverse * (outline.centre_px - start)).norm() > kReach) {
      outline.centre_px = start;
      return;
    }
    if (moved.norm() < kStill_px) return;
  }
}

Dot refine_dot(const cv::Mat& grey, const DotStart& start) {
  assert(grey.type() == CV_8UC1);
  Dot dot;
  dot.outline = start.outline;
  dot.blur_px = start.blur_px;
  DotFit fit;
  fit.light_scale_px = std::sqrt(start.outline.shape_px2.trace());
  gather_pixels(grey, start.outline, start.blur_px, fit.window);
  if (fit.window.pixels.count < kFewestPixels) {
    if (fit.window.cut_by_border) dot.doubt = DotDoubt::border;
    return dot;
  }
  fit.model.unknowns = start_unknowns(grey, fit.window, start);
  fit.prior = prior_about(fit.model.unknowns);

  const DotPixels& pixels = fit.window.pixels;
  constexpr int kMaxSteps = 14;
  bool regathered = false;
  for (; fit.steps < kMaxSteps && !(fit.moved.settled() && regathered); ++fit.steps) {
    if (fit.moved.near() && !regathered) {
      regather(grey, fit);
      regathered = true;
      if (pixels.count < kFewestPixels) return dot;
    }
    evaluate_dot(shape_of(fit.model.unknowns, fit.light_scale_px), pixels, fit.model.rows);
    if (!fit.moved.near_end()) estimate_noise(pixels, fit.model);
    fit.moved = take_step(pixels, fit.prior, fit.model, fit.covariance_px2);
    constexpr double kNoDot = 100;  // px^2
    if (!fit.model.unknowns.allFinite() || fit.model.unknowns[kDotBlur] > kNoDot ||
        inverse_map(fit.model.unknowns).determinant() <= 0)
      return dot;
  }
  describe(fit, dot);
  return dot;
}

}  // namespace clothfit
